"""Whether depths repeat from point to point, to the last bit, as they do after a median filter: its windows overlap."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from debulk.arrays import Floats
from debulk.inspection.evidence.cloud_image import ROUNDING


@dataclass(frozen=True)
class Limits:
    """Of depths that repeat; bench/trust/smoothing.py has medians: nothing else notices some of them."""

    near_points: int = 3  # distance at which windows of 5 overlap
    far_points: int = 13  # distance at which hardly any windows overlap
    quantile: float = 0.95  # over the squares that is compared: on a slope a median repeats nothing
    repeated_share: float = 0.015  # of equal near pairs, in excess of `times` the share of equal far pairs
    times: float = 4.0


LIMITS = Limits()
LEAST_SQUARES = 20  # from which anything is said about a scan's noise


def depths_repeat(depths: Floats) -> bool:
    """Return whether (N, S, S) squares of depths, NaN where nothing was seen, repeat; False if they were rounded."""
    if len(depths) < LEAST_SQUARES or depths.shape[1] <= LIMITS.far_points:
        return False
    steps = np.abs(np.diff(depths, axis=2))
    steps = steps[steps > 0]
    if not steps.size or float(steps.min()) > ROUNDING * float(np.spacing(np.float32(np.nanmax(np.abs(depths))))):
        return False
    near, far = (
        float(np.quantile(_equal(depths, lag), LIMITS.quantile)) for lag in (LIMITS.near_points, LIMITS.far_points)
    )
    return near > LIMITS.repeated_share + LIMITS.times * far


def _equal(depths: Floats, lag: int) -> Floats:
    """Return each square's share of equal pairs of points `lag` apart, along the axis that has more of them."""
    along_rows = np.mean(depths[:, :, lag:] == depths[:, :, :-lag], axis=(1, 2))
    along_columns = np.mean(depths[:, lag:] == depths[:, :-lag], axis=(1, 2))
    return np.asarray(np.maximum(along_rows, along_columns))
