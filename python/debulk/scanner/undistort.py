"""Where a pinhole without distortion would see pixels, with the accuracy asked for."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def undistorted(
    pixels: NDArray[np.float64], matrix: Any, distortion: Any, *, rotation: Any = None, most: int, accuracy: float
) -> NDArray[np.float64]:
    """Return (N, 2) x / z and y / z of (N, 2) pixels after at most so many iterations.

    OpenCV 4 has a function of its own for this, which OpenCV 5 joined with `undistortPoints`.
    """
    import cv2

    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, most, accuracy)
    if hasattr(cv2, "undistortPointsIter"):
        seen = cv2.undistortPointsIter(pixels[:, None], matrix, distortion, rotation, None, criteria)
    else:
        seen = cv2.undistortPoints(pixels[:, None], matrix, distortion, R=rotation, criteria=criteria)
    return np.asarray(seen, np.float64).reshape(-1, 2)
