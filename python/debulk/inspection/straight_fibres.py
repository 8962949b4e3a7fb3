"""What stands between the fibres of a net: straight lines along them, a few millimetres apart, over the heights.

A net of some hundred nodes on a wide pocket has fibres 10 to 30 mm apart, and steps over a bump that rides on it. The
lines do not: each is as long as the heights say, from one end of the foot to the other.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk import pocket
from debulk.inspection.fibre_angles import angles_at
from debulk.inspection.found import FoundPocket
from debulk.inspection.missed import filtered_once_more
from debulk.inspection.ply_on_mold import PlyOnMold
from debulk.inspection.windows import heights_at, labels_at

__all__ = ["StraightFibre", "longest"]

Floats = NDArray[np.float64]
_APART_MM = 2.0  # what the filters leave is 8 mm wide
_STEP_MM = 1.5


class StraightFibre(NamedTuple):
    """By how much a straight line over a pocket is longer than the mold below it, and where it is highest."""

    excess_mm: float
    top_mm: tuple[float, float]


def longest(found: FoundPocket, ply: PlyOnMold, held_over_mm: float = 0.0) -> StraightFibre:
    """Return the line with the most excess, of both fibre directions at the pocket's centre.

    What the filters take from it is added, told by what they take once more (`missed.missed_share`).

    Parameters
    ----------
    found, ply
        The pocket, and what it is judged by.
    held_over_mm
        Lines count only where the ply goes on so far beyond both of their ends; 0: all of them.
    """
    outline, feet = found.foot.outline_mm, found.feet
    best = StraightFibre(0.0, (0.0, 0.0))
    if not len(outline):
        return best
    low, high = outline.min(axis=0), outline.max(axis=0)
    middle, reach_mm = 0.5 * (low + high), 0.5 * float(np.hypot(*(high - low)))
    step_mm = max(_STEP_MM, feet.heights.spacing_mm)
    along, across = (np.arange(-reach_mm - d, reach_mm + 2 * d, d) for d in (step_mm, _APART_MM))
    for angle in np.radians(angles_at(ply.fibre_angles_deg, found.pocket.centroid_mm)):
        way = np.array([np.cos(angle), np.sin(angle)])
        xy = middle + along[:, None] * way + across[:, None, None] * np.array([-way[1], way[0]])
        on = labels_at(feet.labels, xy) == found.foot.label
        height_mm = np.zeros(on.shape)
        height_mm[on] = _lower_side(found, xy[on])
        mold_mm = np.zeros(on.shape)
        mold_mm[on] = ply.reference.height(xy[on])
        excess_mm = _excess_mm(height_mm, mold_mm, on, step_mm)
        if held_over_mm and ply.outline is not None:
            excess_mm[~_held(on, xy, ply.outline, way * held_over_mm)] = 0.0
        k = int(np.argmax(excess_mm))
        if excess_mm[k] <= 0:
            continue
        lowered_mm = height_mm[k].copy()
        lowered_mm[on[k]] += filtered_once_more(feet.heights, xy[k, on[k]], feet.smooth_mm)
        again_mm = float(_excess_mm(lowered_mm[None], mold_mm[[k]], on[[k]], step_mm)[0])
        whole_mm = float(excess_mm[k]) + max(0.0, float(excess_mm[k]) - again_mm)
        if whole_mm > best.excess_mm:
            x, y = xy[k, int(np.argmax(height_mm[k]))].tolist()
            best = StraightFibre(whole_mm, (x, y))
    return best


def _excess_mm(height_mm: Floats, mold_mm: Floats, on: NDArray[np.bool_], step_mm: float) -> Floats:
    """Of each line, over the steps whose ends both lie on the foot."""
    rise = np.diff(mold_mm, axis=1)
    longer = np.hypot(step_mm, rise + np.diff(height_mm, axis=1)) - np.hypot(step_mm, rise)
    total: Floats = np.where(on[:, 1:] & on[:, :-1], longer, 0.0).sum(axis=1)
    return total


def _lower_side(found: FoundPocket, xy: Floats) -> Floats:
    """Heights of the ply's lower side above the reference; unknown: 0."""
    above = heights_at(found.feet.heights, xy)
    lower: Floats = np.maximum(np.nan_to_num(above) - found.feet.thickness_mm, 0.0)
    return lower


def _held(on: NDArray[np.bool_], xy: Floats, ply_outline: Floats, beyond: Floats) -> NDArray[np.bool_]:
    """Whether the ply goes on beyond both ends of each line: half way there, and there."""
    first = np.argmax(on, axis=1)
    last = on.shape[1] - 1 - np.argmax(on[:, ::-1], axis=1)
    lines = np.arange(len(on))
    held: NDArray[np.bool_] = np.asarray(on.any(axis=1))
    for share in (0.1, 0.5, 1.0):
        held &= pocket.inside(ply_outline, xy[lines, first] - share * beyond)
        held &= pocket.inside(ply_outline, xy[lines, last] + share * beyond)
    return held
