"""Whether depths repeat from point to point, to the last bit, as they do after a median filter: its windows overlap."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["depths_repeat"]

Floats = NDArray[np.float64]

_NEAR_POINTS, _FAR_POINTS = 3, 13  # distances: windows of 5 overlap at the first, hardly any at the second
_LEVEL = 0.95  # quantile over the squares that is compared: on a slope a median repeats nothing, and changes little
_REPEATED, _TIMES = 0.015, 4.0  # share of equal near pairs, in excess of so many times the share of equal far pairs
_RESOLVED = 3.0  # times a float32's resolution: if all differences are larger, the depths repeat because of rounding
_FEWEST = 20  # squares


def depths_repeat(depths: Floats) -> bool:
    """Return whether (N, S, S) squares of depths, NaN where nothing was seen, repeat; False if they were rounded."""
    if len(depths) < _FEWEST or depths.shape[1] <= _FAR_POINTS:
        return False
    steps = np.abs(np.diff(depths, axis=2))
    steps = steps[steps > 0]
    if not steps.size or float(steps.min()) > _RESOLVED * float(np.spacing(np.float32(np.nanmax(np.abs(depths))))):
        return False
    near, far = (float(np.quantile(_equal(depths, lag), _LEVEL)) for lag in (_NEAR_POINTS, _FAR_POINTS))
    return near > _REPEATED + _TIMES * far


def _equal(depths: Floats, lag: int) -> Floats:
    """Return each square's share of equal pairs of points `lag` apart, along the axis that has more of them."""
    along_rows = np.mean(depths[:, :, lag:] == depths[:, :, :-lag], axis=(1, 2))
    along_columns = np.mean(depths[:, lag:] == depths[:, :-lag], axis=(1, 2))
    return np.asarray(np.maximum(along_rows, along_columns))
