"""Whether depths repeat from point to point, to the last bit: a median of windows that overlap makes them do so."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["depths_repeat"]

Floats = NDArray[np.float64]

_NEAR, _FAR = 3, 13  # points: windows of 5 overlap at the first, hardly any do at the second
_LEVEL = 0.95  # the quantile of the squares: on a slope a median repeats nothing, and changes little
_REPEATED, _TIMES = 0.015, 4.0  # share of pairs, beyond so many times that of those far apart
_RESOLVED = 3.0  # times what a float32 resolves: depths with no smaller differences were rounded, and repeat by that
_FEWEST = 20  # squares


def depths_repeat(depths: Floats) -> bool:
    """Tell it from squares of depths, (N, S, S), NaN where nothing was seen; not where they were rounded."""
    if len(depths) < _FEWEST or depths.shape[1] <= _FAR:
        return False
    steps = np.abs(np.diff(depths, axis=2))
    steps = steps[steps > 0]
    if not steps.size or float(steps.min()) > _RESOLVED * float(np.spacing(np.float32(np.nanmax(np.abs(depths))))):
        return False
    near, far = (float(np.quantile(_equal(depths, lag), _LEVEL)) for lag in (_NEAR, _FAR))
    return near > _REPEATED + _TIMES * far


def _equal(depths: Floats, lag: int) -> Floats:
    """Share of pairs of points so far apart that are equal, along the axis of each square that has more of them."""
    along_rows = np.mean(depths[:, :, lag:] == depths[:, :, :-lag], axis=(1, 2))
    along_columns = np.mean(depths[:, lag:] == depths[:, :-lag], axis=(1, 2))
    return np.asarray(np.maximum(along_rows, along_columns))
