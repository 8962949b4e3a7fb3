"""Filters of scanners' software, which smooth the ranges of a scan."""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from lab.varied.given import Cloud

__all__ = ["FILTERS", "filtered"]

Image = NDArray[np.float32]
Filter = Callable[[Image], Image]

_FILL = 21  # size in pixels of the window whose mean a filter gets for an unseen pixel


def _gaussian(sigma: float) -> Filter:
    return lambda image: np.asarray(cv2.GaussianBlur(image, (0, 0), sigma), np.float32)


def _box(size: int) -> Filter:
    return lambda image: np.asarray(cv2.blur(image, (size, size)), np.float32)


def _median(size: int, times: int) -> Filter:
    def median(image: Image) -> Image:
        for _ in range(times):
            image = np.asarray(cv2.medianBlur(image, size), np.float32)
        return image

    return median


def _bilateral(size: int, sigma_mm: float, sigma: float) -> Filter:
    return lambda image: np.asarray(cv2.bilateralFilter(image, size, sigma_mm, sigma), np.float32)


def _guided(size: int, edge_mm: float) -> Filter:
    """Preserve edges: in each window, variation well above `edge_mm` is kept, and variation well below it averaged."""

    def guided(image: Image) -> Image:
        def mean(values: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.asarray(cv2.blur(values, (size, size)))

        about = image.astype(np.float64) - float(image.mean())
        local = mean(about)
        variance = np.maximum(mean(about**2) - local**2, 0.0)
        kept = variance / (variance + edge_mm**2)
        return np.asarray(mean(kept) * about + mean(local * (1 - kept)) + float(image.mean()), np.float32)

    return guided


FILTERS: dict[str, Filter] = {
    "Gaussian of 1 pixel": _gaussian(1),
    "Gaussian of 2 pixels": _gaussian(2),
    "Gaussian of 4 pixels": _gaussian(4),
    "box of 5 pixels": _box(5),
    "box of 9 pixels": _box(9),
    "median of 5 pixels": _median(5, 1),
    "median of 5 pixels, twice": _median(5, 2),
    "median of 5 pixels, eight times": _median(5, 8),
    "bilateral, 5 pixels, 2 mm": _bilateral(5, 2.0, 2.0),
    "bilateral, 9 pixels, 2 mm": _bilateral(9, 2.0, 4.0),
    "bilateral, 9 pixels, 0.5 mm": _bilateral(9, 0.5, 4.0),
    "bilateral, 9 pixels, 0.2 mm": _bilateral(9, 0.2, 4.0),
    "bilateral, 15 pixels, 0.5 mm": _bilateral(15, 0.5, 6.0),
    "guided, 9 pixels, 0.3 mm": _guided(9, 0.3),
    "guided, 9 pixels, 0.1 mm": _guided(9, 0.1),
}
"""Filters by their settings in such software, in mm; they take depth images without gaps."""


def filtered(scan: Cloud, change: Filter) -> Cloud:
    """Change the ranges along the rays of an organised scan, as the software of its scanner does.

    Parameters
    ----------
    scan
        (H, W, 3), scanner's frame, NaN where nothing was seen; these points stay NaN.
    change
        One of `FILTERS`.
    """
    depth = scan[..., 2]
    seen = np.isfinite(depth)
    share = np.maximum(cv2.blur(seen.astype(np.float64), (_FILL, _FILL)), 1e-9)
    around = cv2.blur(np.where(seen, depth, 0.0).astype(np.float64), (_FILL, _FILL)) / share
    whole = np.where(seen, depth, np.where(share > 1e-6, around, np.nanmedian(depth))).astype(np.float32)
    times = change(whole) / np.where(seen, depth, 1.0)
    return np.where(seen[..., None], scan * times[..., None], np.nan).astype(np.float32)
