"""Humps of the reference that look like a pocket of the ply before, which was scanned before it was debulked.

Heights are measured from the reference, so that a pocket that it already holds is invisible: the ply on it lies flat.
A hump counts if all round it the surface is smooth, as a quadratic surface predicts it that is fitted to a ring, or one
that is straight in one direction with any profile across, as a spar's is; and if a fibre over it, together with what
the ply shows there, would make a ridge above the limit. Bosses of a mold look the same: a hump by itself is only named.
Where the ply stands off it, too, it may be one pocket of which the reference holds a part, and the layup is UNDECIDED.
One that it holds wholly is, bit for bit, a mold with a boss: only a mold's nominal shape, or the stack, could tell.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from debulk import _core
from debulk.arrays import Floats
from debulk.grid import Grid
from debulk.inspection.ply.excess import LEAST_ERROR_MM, ridge_of
from debulk.inspection.ply.fibre_runs import left_by_means
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.recipe import Recipe
from debulk.results.finding import Finding
from debulk.results.number import HIGHEST_MM
from debulk.results.report import LeftOut
from debulk.verdict import Verdict
from debulk.words import in_cm2, in_mm, xy_of

_NEAR_MM = 25.0  # from its top a hump reaches so far at least
_AROUND = (2.2, 3.5)  # of the radius of what is half as high: where the ply lies down again
_LEAST_CELLS = 10
_STANDS_MM = 0.03  # on 18 humps that the ply lay on it was at most 0.018 mm more than the ply's scatter


@dataclass(frozen=True)
class Hump:
    """A hump of the reference."""

    place_mm: tuple[float, float]
    """Mold XY of its top."""
    height_mm: float
    area_mm2: float
    """`height_mm`, `area_mm2`: above the surface that its surroundings predict, and the area of what stands above half
    of that."""
    excess_mm: float
    ridge_mm: float
    """`excess_mm`, `ridge_mm`: of the fibre over it that is longest, compared with that surface, and the ridge that
    this makes."""
    shown_mm: float = 0.0
    """Of `excess_mm`, what a scan shows on the hump."""
    gap_mm: float = 0.0
    """By how much the ply surely stands higher on the hump than round it; 0: by no more than it scatters."""

    def covers(self, place_mm: Floats) -> bool:
        """Return whether a place (2,) lies on the hump, or near it."""
        return bool(np.hypot(*(place_mm - self.place_mm)) <= max(_NEAR_MM, np.sqrt(self.area_mm2)))


def humps_of(seen: Grid, ply: PlyOnMold, stop: _core.Stop | None = None) -> tuple[Hump, ...]:
    """Return the humps of a reference's heights under the ply, the highest ridge first.

    They are read along its fibres, or along x and y if those turn from place to place.
    """
    angles = (0.0, 90.0) if isinstance(ply.fibre_angles_deg, Grid) else tuple(map(float, ply.fibre_angles_deg))
    found = []
    for one in _core.pocket.find_humps(
        seen.values, seen.origin_mm, seen.spacing_mm, ply.outline, angles, stop or _core.Stop()
    ):
        if one.height < HIGHEST_MM:
            # A bump (1 - r²)² is 3.7 times as wide at its foot as the radius of the circle where it is half as high.
            kept = float(left_by_means(one.cell, np.array(3.7 * np.sqrt(one.area / np.pi))))
            excess_mm = one.excess / kept
            ridge_mm = ridge_of(excess_mm, ply.recipe)
            found.append(Hump(xy_of(one.top), one.height, one.area, excess_mm, ridge_mm))
    found.sort(key=lambda one: -one.ridge_mm)
    humps: list[Hump] = []
    for hump in found:
        if not any(one.covers(np.array(hump.place_mm)) for one in humps):
            humps.append(hump)
    return tuple(humps)


def named(
    humps: tuple[Hump, ...], largest: Grid | None, recipe: Recipe, heights: Grid | None = None
) -> tuple[Hump, ...]:
    """Return the humps whose ridge exceeds the limit together with the largest excess that a scan shows on them.

    By the heights above the reference it is seen whether the ply stands off them.
    """
    out = []
    for hump in humps:
        own_mm = 0.0
        if largest is not None:
            nearest_mm = largest.origin_mm + largest.spacing_mm * largest.cells(np.array(hump.place_mm))
            reach_mm = largest.spacing_mm * np.ceil(np.sqrt(hump.area_mm2) / largest.spacing_mm)
            shown = largest.values[largest.around(np.stack([nearest_mm, nearest_mm]), reach_mm)]
            own_mm = max(0.0, float(np.nan_to_num(shown).max(initial=0.0)))
        total_mm = hump.excess_mm + own_mm  # a scan's excess is measured from the reference with the hump in it
        ridge_mm = ridge_of(total_mm, recipe)
        if ridge_mm > recipe.verdict.max_ridge_mm:
            gap_mm = 0.0 if heights is None else _gap(hump, heights, recipe.material.thickness_mm)
            out.append(replace(hump, excess_mm=total_mm, ridge_mm=ridge_mm, shown_mm=own_mm, gap_mm=gap_mm))
    return tuple(out)


def _gap(hump: Hump, heights: Grid, thickness_mm: float) -> float:
    """Return by how much the ply stands higher on a hump than round it, beyond its scatter there.

    A pocket of which the reference holds all but a few hundredths leaves an excess that is lost in the noise of lines,
    but a gap in its shape over an area: one of 3 mm of which 98 % were held, 0.06 mm.
    """
    radius_mm, place = float(np.sqrt(hump.area_mm2 / np.pi)), np.array(hump.place_mm)
    part = heights.part(*heights.around(np.stack([place, place]), _AROUND[1] * radius_mm))
    x, y = np.meshgrid(part.x_mm - place[0], part.y_mm - place[1])
    far = np.hypot(x, y) / radius_mm
    on_ply = part.values > 0.5 * thickness_mm  # and not NaN
    top = part.values[on_ply & (far < 1)]
    ground = part.values[on_ply & (far > _AROUND[0]) & (far < _AROUND[1])]
    if min(len(top), len(ground)) < _LEAST_CELLS:
        return 0.0
    low, level = np.quantile(ground, (0.16, 0.5))  # a standard deviation apart; air beside the hump lifts neither much
    return max(0.0, float(np.median(top) - level - (level - low)))


_AIR_BELOW = "if that is a pocket of the ply before, give the scan that was taken after the ply before was debulked"
_SHAPED_SO = "; if it is a bead or boss of the mold, smooth the ply down onto it and scan again: it then only is named"


def findings(humps: tuple[Hump, ...], recipe: Recipe) -> list[Finding]:
    """Name each hump, with its ridge against the limit; UNDECIDED where the ply stands off it."""
    limit = recipe.verdict.max_ridge_mm
    out = []
    for hump in humps:
        air = hump.shown_mm > LEAST_ERROR_MM or hump.gap_mm > _STANDS_MM  # with less the ply lies on the hump
        stands = f", and the ply stands off it: together a ridge of {hump.ridge_mm:.2f} mm" if air else ""
        remedy = _AIR_BELOW + (_SHAPED_SO if air else "")
        reason = f"the reference has {_what(hump)}{stands}: {remedy}"
        at_best = Verdict.UNDECIDED if air else None
        place = hump.place_mm
        out.append(Finding("reference_humps", at_best, reason, hump.ridge_mm, limit, "mm", place, remedy=remedy))
    return out


def left_out(humps: tuple[Hump, ...]) -> tuple[LeftOut, ...]:
    """Say that what the reference already holds is not judged; the map shows the places."""
    return tuple(
        LeftOut(
            what=f"{_what(hump)} of the reference",
            why="heights are measured from the reference: air that was below the ply before when it was scanned is "
            "not seen",
            bound=f"a fibre over it is as long as for a ridge of {hump.ridge_mm:.2f} mm, unless the mold is so shaped",
            place_mm=hump.place_mm,
        )
        for hump in humps
    )


def _what(hump: Hump) -> str:
    return f"a hump of {in_cm2(hump.area_mm2)} at {in_mm(hump.place_mm)}, {hump.height_mm:.1f} mm high"
