"""Whether two outlines come close to each other."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from debulk import pocket

__all__ = ["come_within"]

Floats = NDArray[np.float64]
_EVERY = 16  # corners


def come_within(one_mm: Floats, other_mm: Floats, most_mm: float) -> bool:
    """Return whether a corner of the other polygon, (M, 2), lies within a distance of the first one's sides.

    Outlines have thousands of corners, and most pairs are plainly near or plainly far. So every sixteenth corner is
    looked at first: between two of these, no corner is nearer to the first polygon by more than half the way between
    them along the outline.

    Examples
    --------
    >>> square = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]])
    >>> come_within(square, square + [6.0, 0.0], 2.0), come_within(square, square + [6.0, 0.0], 1.9)
    (True, False)
    """
    low, high = one_mm.min(axis=0), one_mm.max(axis=0)

    def least(points: Floats, reach_mm: float) -> float:
        facing = points[((points >= low - reach_mm) & (points <= high + reach_mm)).all(axis=1)]
        return float(pocket.distance_to_outline(one_mm, facing).min()) if len(facing) else np.inf

    steps_mm = np.linalg.norm(np.diff(other_mm, axis=0, append=other_mm[:1]), axis=1)
    between_mm = 0.5 * float(np.add.reduceat(steps_mm, np.arange(0, len(steps_mm), _EVERY)).max())
    few = least(other_mm[::_EVERY], most_mm + between_mm)
    return few <= most_mm or (few <= most_mm + between_mm and least(other_mm, most_mm) <= most_mm)
