"""How fine the rectified images are.

Rectification turns both cameras until their rows agree. Where cameras are toed in, the turned image shows one side of
the scene much wider than the other, and squeezing it into the camera's own size would make all of it coarser: by 13 %
of the pixels for two cameras that are turned by 20 degrees against each other.
"""

from __future__ import annotations

import numpy as np

from debulk.arrays import Floats

LEAST_RESOLUTION = 0.95
"""If the camera's own size would leave less than this share of its focal length, the rectified image is larger."""
_MOST_PIXELS = 2.0  # pixels of the rectified image over the camera's, at most


def resolved(low: Floats, high: Floats, focal_px: float, pixels: tuple[int, int]) -> tuple[float, tuple[int, int]]:
    """Focal length and size, both in pixels, of an image that shows x / z and y / z from ``low`` to ``high``.

    The size is the camera's if that costs hardly any resolution, because clouds of the camera's size are easier to
    handle. Otherwise the focal length is the camera's, and the image as large as that needs.
    """
    width, height = pixels
    wide, tall = high - low
    fit = float(min((width - 1) / wide, (height - 1) / tall))
    fine = min(focal_px, float(np.sqrt(_MOST_PIXELS * width * height / (wide * tall))))
    if fit >= LEAST_RESOLUTION * fine:
        return fit, pixels
    return fine, (int(np.ceil(fine * wide)) + 1, int(np.ceil(fine * tall)) + 1)
