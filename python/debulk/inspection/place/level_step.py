"""A step in the level: one side of a line is higher than the other, as when backing paper was left on the ply."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from debulk.arrays import Floats
from debulk.inspection.clouds.products import product
from debulk.inspection.place.level import Deviation

_WAYS = 36  # directions that are tried, 5 degrees apart
_PLACES = 60  # along each direction, at most
_LEAST_SQUARES, _LEAST_SHARE = 3, 0.05  # on either side
# A step is taken only if it leaves less than this share of the sum of squares that a plane or a paraboloid leaves. A
# plane leaves a quarter of the variance of a step across the middle, and a step leaves a quarter of that of a tilt, as
# each partly fits the other. Noise is the same in both.
_BETTER = 0.5
_SAME_MM = 1e-6  # squares nearer to each other across the line lie in one row along it


@dataclass(frozen=True, eq=False)
class Step:
    """Where the level steps up."""

    height_mm: float
    """Height of the higher side above the other."""
    low_mm: float
    """Deviation of the lower side."""
    share: float
    """Share of the squares that lie on the higher side."""
    at_mm: Floats
    """(2,) a place on the line between both sides."""
    line_deg: float
    """Direction of that line from x, 0 to 180."""
    rest_mm: Floats
    """(B,) deviations of the squares after subtracting the step."""


def best_step(found: Deviation) -> Step | None:
    """Return the straight step that explains a deviation best, if clearly better than a paraboloid does.

    Some squares stand high for other reasons, such as the foot of a pocket, and a few of them would dominate a sum of
    squares. So a side's height is the median of its squares, and no square counts as more than half a step off.
    """
    residual, count = found.residual_mm, len(found.residual_mm)
    smooth = np.abs(residual - found.fits_mm[2])
    least = max(_LEAST_SQUARES, int(np.ceil(_LEAST_SHARE * count)))
    best, smallest = None, _BETTER
    for degrees in np.arange(_WAYS) * (180.0 / _WAYS):
        across = np.array([-np.sin(np.radians(degrees)), np.cos(np.radians(degrees))])
        away_mm = product(found.squares.xy_mm, across)
        ranked = np.argsort(away_mm, kind="stable")
        ordered, along = residual[ranked], away_mm[ranked]
        for below in range(least, count - least + 1, max(1, count // _PLACES)):
            if along[below] - along[below - 1] <= _SAME_MM:
                continue
            low, high = float(np.median(ordered[:below])), float(np.median(ordered[below:]))
            most = 0.5 * abs(high - low)
            sides = np.abs(ordered - np.repeat((low, high), (below, count - below)))
            left, smoothly = _sum_of_squares(sides, most), _sum_of_squares(smooth, most)
            if left >= smallest * smoothly:
                continue
            smallest, share = left / smoothly, (count - below if high > low else below) / count
            middle, here = found.squares.xy_mm.mean(axis=0), 0.5 * (along[below - 1] + along[below])
            rest = residual - np.where(away_mm < here, low, high)
            place_mm = middle + (here - middle @ across) * across
            best = Step(abs(high - low), min(low, high), share, place_mm, float(degrees), rest)
    return best


def _sum_of_squares(off: Floats, most: float) -> float:
    """Return the sum of squares of distances, of which none counts as more than `most`."""
    return float(np.sum(np.minimum(off, most) ** 2))
