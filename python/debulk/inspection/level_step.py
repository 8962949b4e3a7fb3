"""A step in the level: one side of a line is higher than the other, as when backing paper was left on the ply."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk.inspection.level import Deviation
from debulk.inspection.products import product

__all__ = ["Step", "step_of"]

Floats = NDArray[np.float64]
_WAYS = 36  # directions that are tried, 5 degrees apart
_LEAST_SQUARES = 3  # on either side
# A step is taken only if it leaves less than this share of the sum of squares that a plane or a paraboloid leaves. A
# plane leaves a quarter of the variance of a step across the middle, and a step leaves a quarter of that of a tilt, as
# each partly fits the other. Noise is the same in both.
_BETTER = 0.5


@dataclass(frozen=True, eq=False)
class Step:
    """Where the level steps up.

    Attributes
    ----------
    height_mm
        Height of the higher side above the other.
    share
        Share of the squares that lie on the higher side.
    at_mm
        (2,) a place on the line between both sides.
    line_deg
        Direction of that line from x, 0 to 180.
    rest_mm
        (B,) deviations of the squares after subtracting the step.
    """

    height_mm: float
    share: float
    at_mm: Floats
    line_deg: float
    rest_mm: Floats


def step_of(found: Deviation, order: int) -> Step | None:
    """Return the straight step that explains a deviation best, if clearly better than the fit of that order."""
    residual = found.residual_mm
    smooth = float(np.sum((residual - found.fits_mm[order]) ** 2))
    best, least = None, _BETTER * smooth
    for degrees in np.arange(_WAYS) * (180.0 / _WAYS):
        across = np.array([-np.sin(np.radians(degrees)), np.cos(np.radians(degrees))])
        way = product(found.xy_mm, across)
        ranked = np.argsort(way, kind="stable")
        left, sums = _left(residual[ranked], way[ranked])
        k = int(np.argmin(left))
        if left[k] >= least:
            continue
        least, below, count = float(left[k]), k + 1, len(residual)
        low, high = sums[k] / below, (sums[-1] - sums[k]) / (count - below)
        share = (count - below if high > low else below) / count
        middle, here = found.xy_mm.mean(axis=0), 0.5 * (way[ranked[k]] + way[ranked[k + 1]])
        rest = residual - np.where(way < here, low, high)
        best = Step(abs(high - low), share, middle + (here - middle @ across) * across, float(degrees), rest)
    return best


def _left(values: Floats, way: Floats) -> tuple[Floats, Floats]:
    """Return the sum of squares after a step behind each value (infinite if none can be there), and running sums."""
    below = np.arange(1, len(values))
    sums = np.cumsum(values)
    left = float(np.sum(values**2)) - sums[:-1] ** 2 / below - (sums[-1] - sums[:-1]) ** 2 / (len(values) - below)
    can = (below >= _LEAST_SQUARES) & (len(values) - below >= _LEAST_SQUARES) & (np.diff(way) > 1e-6)
    return np.where(can, left, np.inf), sums
