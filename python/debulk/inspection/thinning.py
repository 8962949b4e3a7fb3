"""A few of a cloud's points, spread over all of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["thinned"]

_POINTS = 30_000  # some 30 in a square of 40 mm on a ply of a square metre


def thinned(points: NDArray[np.float32], mask: NDArray[np.bool_] | None = None) -> NDArray[np.float32]:
    """Return about 30 000 points of a cloud, evenly over its image or its list, NaN where the mask hides them."""
    count = points.size // 3
    if points.ndim == 2:
        return np.ascontiguousarray(points[:: max(1, count // _POINTS)])
    step = max(1, int(np.sqrt(count / _POINTS)))
    few = np.ascontiguousarray(points[::step, ::step])
    if mask is not None and mask.shape == points.shape[:2]:
        few[mask[::step, ::step]] = np.nan
    return few.reshape(-1, 3)
