"""Clouds far from the origin of their frame, where float32 is too coarse, and the shift that brings them near.

A robot's world frame or a map's easting and northing put a scan hundreds of metres to thousands of kilometres away. A
float32 resolves 0.002 mm up to 33 m from the origin, 0.06 mm at a kilometre, and half a metre at 5 000 km.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats

FAR_MM = 2.0**15
"""Farther from the origin than this, mm, on one axis with all its points, a cloud is far: float32 rounds it by more
than 0.002 mm."""
_SAMPLE = 4096  # points
_STEP_MM = 1000.0  # shifts are whole metres, which no rounding changes


def is_far(low: Sequence[float], high: Sequence[float]) -> bool:
    """Whether a box, from its lowest to its highest coordinates in mm, lies far from the origin on some axis.

    Examples
    --------
    >>> is_far([-100, -100, 2000], [50_000, 100, 2100]), is_far([40_000, 0, 0], [40_500, 500, 20])
    (False, True)
    """
    return any(a <= b and (a > FAR_MM or b < -FAR_MM) for a, b in zip(low, high, strict=True))


def resolution_mm(mm: float) -> float:
    """Return the distance from one float32 to the next at a coordinate."""
    return float(np.spacing(np.float32(abs(mm))))


def shift_of(points: NDArray[np.floating[Any]]) -> Floats | None:
    """Return the (3,) vector of whole metres, in mm, to be subtracted from a far cloud; None if it is not far.

    A few thousand points, evenly taken from the (H, W, 3) or (N, 3), decide. Only far axes are shifted.
    """
    step = max(1, round((points.size / 3 / _SAMPLE) ** (1 / (points.ndim - 1))))
    some = points[(slice(None, None, step),) * (points.ndim - 1)].reshape(-1, 3).astype(np.float64)
    some = some[np.isfinite(some).all(axis=1)]
    if not len(some):
        return None
    low, high = some.min(axis=0), some.max(axis=0)
    far = (low > FAR_MM) | (high < -FAR_MM)
    if not far.any():
        return None
    whole: Floats = np.where(far, np.round(np.median(some, axis=0) / _STEP_MM) * _STEP_MM, 0.0)
    return whole


def shifted(points: NDArray[np.floating[Any]], shift: Floats) -> NDArray[np.float32]:
    """Subtract a shift in double precision, and round to float32 only then.

    Examples
    --------
    >>> far = np.array([[5e9 + 0.125, 0, 0]])
    >>> float(far.astype(np.float32)[0, 0]) - 5e9, float(shifted(far, np.array([5e9, 0, 0]))[0, 0])
    (0.0, 0.125)
    """
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(points - shift, dtype=np.float32)
