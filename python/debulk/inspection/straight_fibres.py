"""Straight lines over the heights, parallel to the fibres and a few millimetres apart, to see between a net's fibres.

A net of some hundred nodes on a wide pocket has fibres 10 to 30 mm apart, and may step over a bump that rides on the
pocket. The lines do not: the length of each is read from the heights, from one end of the foot to the other.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from debulk import _core
from debulk.inspection.fibre_angles import angles_at
from debulk.inspection.found import FoundPocket
from debulk.inspection.friction_length import friction_length
from debulk.inspection.missed import filtered_once_more, tail_mm
from debulk.inspection.ply_on_mold import PlyOnMold

__all__ = ["StraightFibre", "longest"]


class StraightFibre(NamedTuple):
    """The excess length of a straight line over a pocket, compared with the mold below, and where it is highest."""

    excess_mm: float
    top_mm: tuple[float, float]


def longest(
    found: FoundPocket, ply: PlyOnMold, held_over_mm: float = 0.0, stop: _core.Stop | None = None
) -> StraightFibre:
    """Return the line with the most excess, of both fibre directions at the pocket's centre.

    If more ply lies on the mold between two parts of a foot, as within a ring, than one fold can draw over, each part
    has its own lines. The length that the filters have removed is added; it is estimated by what filtering the filtered
    heights once more removes (`missed.missed_share`).

    Parameters
    ----------
    found, ply
        The pocket, and the ply and the recipe by which it is judged.
    held_over_mm
        A line counts only if the ply goes on this far beyond both of its ends; 0: all lines count.
    stop
        Ends the search with `Stopped`.
    """
    feet, best = found.feet, StraightFibre(0.0, (0.0, 0.0))
    if not len(found.foot.outline_mm):
        return best
    lines = _core.ridge.straight_fibres(
        feet._core,
        feet._core.feet[found.index],
        ply.reference,
        np.radians(angles_at(ply.fibre_angles_deg, found.pocket.centroid_mm)),
        ply.outline,
        held_over_mm,
        friction_length(ply.recipe) + 2 * tail_mm(found),
        stop or _core.Stop(),
    )
    for line in lines:
        if line.excess_mm <= 0:
            continue
        points_mm, gaps_mm, molds_mm = line.points_mm, line.gaps_mm, line.molds_mm
        lowered_mm = gaps_mm + filtered_once_more(feet.heights, points_mm, feet.smooth_mm)
        step_mm, rise = np.linalg.norm(np.diff(points_mm, axis=0), axis=1), np.diff(molds_mm)
        longer = np.hypot(step_mm, rise + np.diff(lowered_mm)) - np.hypot(step_mm, rise)
        whole_mm = line.excess_mm + max(0.0, line.excess_mm - float(np.nansum(longer)))
        if whole_mm > best.excess_mm:
            x, y = points_mm[int(np.nanargmax(gaps_mm))].tolist()
            best = StraightFibre(whole_mm, (x, y))
    return best
