"""The mold's edge, for a ply of unknown outline: what lies below a cliff in the reference is assumed to be no ply."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk.grid import Grid
from debulk.inspection.evidence.outline import BESIDE_MM
from debulk.inspection.evidence.pieces import grown
from debulk.inspection.evidence.ply_zones import LEAST_POINTS, SIDES_MM
from debulk.inspection.evidence.sample import Sample
from debulk.inspection.reference.prepared import Prepared
from debulk.recipe import Recipe
from debulk.results.finding import Finding
from debulk.results.report import LeftOut
from debulk.verdict import Verdict
from debulk.words import in_mm, xy_of


@dataclass(frozen=True)
class Limits:
    """Of what stands below a cliff of the reference; `tests/python/inspection/test_cliffs.py` has such molds."""

    cliff_mm: float = 200.0  # within this distance of the edge the table is visible again, beyond the cliff's shadow


LIMITS = Limits()
_SQUARE_MM = SIDES_MM[0]  # side of the squares whose medians are looked at


@dataclass(frozen=True, eq=False)
class BelowEdge:
    """The part of the reference below the mold's edge, which is taken for a table if a scan shows nothing on it."""

    heights: Grid
    """Heights of the reference there, mm; NaN elsewhere."""
    share: float
    """Its share of the known part of the reference."""
    laid_mm: float
    """The ply's thickness; what stands half of it above the table may be a ply."""

    def finding(self, sample: Sample) -> Finding | None:
        """Say that a ply, or something else, lies there; None if the scan does not stand above the reference there."""
        above = sample.points_mm[:, 2] - self.heights.at(sample.points_mm[:, :2])
        known = np.flatnonzero(np.isfinite(above))
        square = np.floor(sample.points_mm[known, :2] / _SQUARE_MM).astype(np.int64)
        places, which, counts = np.unique(square, axis=0, return_inverse=True, return_counts=True)
        order = np.lexsort((above[known], which.ravel()))
        first = np.cumsum(counts) - counts
        medians = above[known][order][first + counts // 2] if len(known) else np.zeros(0)
        stands = (counts >= LEAST_POINTS) & (medians > 0.5 * self.laid_mm)
        if not stands.any():
            return None
        place = (places[stands][0] + 0.5) * _SQUARE_MM
        reason = (
            "the ply's outline is not given, and the mold's edge does not tell where the ply ends: the reference falls "
            f"by a cliff, and below it the scan stands above the reference in {np.count_nonzero(stands)} squares of "
            f"{_SQUARE_MM:g} mm, the first round {in_mm(place)}; give the ply's outline (ply_outline, "
            "--outline)"
        )
        return Finding("mold_edge", Verdict.INVALID, reason, place_mm=xy_of(place))

    def left_out(self) -> LeftOut:
        """Name the part that is not judged."""
        return LeftOut(
            what=f"{100 * self.share:.0f} % of the reference, below the mold's edge",
            why="the ply's outline is not known, and the reference falls by a cliff: what lies below it is taken for "
            "the table",
            bound=f"no square of {_SQUARE_MM:g} mm there stands {0.5 * self.laid_mm:.2g} mm "
            "above the reference; a ply that hangs over the edge is judged up to "
            f"{BESIDE_MM:g} mm from the edge only",
        )


def parted(prepared: Prepared, recipe: Recipe) -> tuple[Prepared, BelowEdge | None]:
    """Return the reference without the part below a cliff, and that part, which is None if there is no cliff.

    Of a step so low that beyond what the fit left out beside it no cliff is found, that part is what was left out.
    """
    seen = prepared.seen
    marks: NDArray[np.uint8] = _core.surface.above_cliffs(*prepared.seen_on_grid(), recipe.run.threads, _core.Stop())
    known = np.isfinite(seen.values)
    cliff, margin = (round(far_mm / seen.spacing_mm) for far_mm in (LIMITS.cliff_mm, BESIDE_MM))
    if marks.size:
        above = marks.view(np.bool_)
        beside = grown(known & ~above, cliff) & grown(~(known & above), margin)
        below = np.where(above, np.nan, seen.values)
        mold = np.where(above & ~beside, seen.values, np.nan).astype(seen.values.dtype)
        prepared = replace(prepared, seen=replace(seen, values=mold))
    elif prepared.hidden is not None:
        below = np.where(grown(known, margin), np.nan, prepared.hidden.values)
    else:
        return prepared, None
    share = float(np.count_nonzero(np.isfinite(below))) / max(1, int(np.count_nonzero(known)))
    return prepared, BelowEdge(replace(seen, values=below), share, recipe.material.thickness_mm)
