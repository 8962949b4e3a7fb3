"""What a verdict does not take into account: what, why, and a bound on what it could change."""

from __future__ import annotations

from typing import TYPE_CHECKING

from debulk import sheet
from debulk.inspection import unseen
from debulk.inspection.found import Found
from debulk.inspection.starts import Settled
from debulk.results.report import LeftOut

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["merged", "of_pocket", "of_scan"]

_TERMS = {
    "friction": LeftOut(
        what="friction of pockets inside the ply",
        why="their nets have no free edge",
        bound="none: friction acts on free boundary nodes only",
    ),
    "gravity": LeftOut(what="gravity", why="the recipe's density or gravity is zero", bound="below 1e-4 of the vacuum"),
}


def of_pocket(ply: sheet.Sheet, settled: Settled) -> tuple[LeftOut, ...]:
    """Name the energies that a pocket's ply does without, and the starts that a deadline cut off."""
    entries = [_TERMS[name] for name in ply.left_out if name in _TERMS]
    if settled.cut:
        entries.append(
            LeftOut(
                what="some seeded starts",
                why="the deadline passed",
                bound="the ranges of RMS and ridge height come from fewer minima than the recipe asks for",
            )
        )
    return tuple(entries)


def of_scan(found: Found, outline_known: bool, recipe: Recipe) -> tuple[LeftOut, ...]:
    """Name the bumps that are no pockets, the ply's edge where it is not known, and what the finder did not look at."""
    wanted = recipe.segmentation
    entries = [
        LeftOut(
            what=f"bump of {d.area_mm2 / 100:.2f} cm² at ({d.centroid_mm[0]:.0f}, {d.centroid_mm[1]:.0f}) mm",
            why=f"no pocket: below the tolerance of {d.reason.replace('_', ' ')}",
            bound=f"stands {d.peak_mm:.2f} mm above the reference; limits {wanted.area_tol_mm2 / 100:g} cm² at the "
            f"cut and {wanted.cut_height_mm + wanted.peak_tol_mm:g} mm",
            place_mm=(float(d.centroid_mm[0]), float(d.centroid_mm[1])),
        )
        for d in found.dropped
    ]
    if not outline_known:
        entries.append(
            LeftOut(
                what="free edges and friction",
                why="the ply's outline is not known",
                bound="a pocket at the ply's edge is judged as if held there: ridges come out higher, not lower",
            )
        )
    return (*entries, *unseen.left_out(found), *found.left_out)


def merged(entries: tuple[LeftOut, ...]) -> tuple[LeftOut, ...]:
    """Return entries that say the same of several pockets once."""
    seen: dict[tuple[str, str, str], LeftOut] = {}
    for entry in entries:
        seen.setdefault((entry.what, entry.why, entry.bound), entry)
    return tuple(seen.values())
