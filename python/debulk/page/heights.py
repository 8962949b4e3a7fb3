"""The heights of the map as a small picture."""

from __future__ import annotations

import base64
import math
from collections.abc import Callable
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk.grid import Grid
from debulk.page.scales import HeightScale

_MAX_PIXELS = 1400  # width and height
MAX_PNG_BYTES = 1_350_000


class Picture(NamedTuple):
    """A PNG in base64, north up, transparent where nothing is known; and its place in the mold frame, mm."""

    png: str
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    scale: HeightScale

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Place on the map: x to the right, y down, width and height, mm."""
        width, height = (float(length) for length in self.high - self.low)
        return float(self.low[0]), -float(self.high[1]), width, height


def picture(
    grid: Grid,
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    top_mm: float | None,
    *,
    keep_all: bool,
    png_bytes: int,
) -> Picture | None:
    """Draw the heights in a window between two (2,) corners, mold XY, or the whole grid; None: it is off the map.

    The last colour is that of `top_mm`; None: of the highest that was seen, apart from a thousandth of the map. The
    picture takes at most `png_bytes`.
    """
    cropped = _crop(grid, low, high, keep_all=keep_all)
    if cropped is None:
        return None
    values, first = cropped
    corner = first - 0.5 * grid.spacing_mm
    seen = values[np.isfinite(values)]
    if top_mm is None or not math.isfinite(top_mm):
        top_mm = float(np.quantile(seen, 0.999)) if seen.size else 1.0
    scale = HeightScale.up_to(top_mm, float(np.quantile(seen, 0.001)) if seen.size else 0.0)
    return Picture(
        _png(values, scale, png_bytes), corner, corner + grid.spacing_mm * np.array(values.shape[::-1]), scale
    )


def _crop(
    grid: Grid, low: NDArray[np.float64], high: NDArray[np.float64], *, keep_all: bool
) -> tuple[NDArray[np.float32], NDArray[np.float64]] | None:
    """Cut the window out of the height map, and return it with the position of its first cell."""
    values = np.asarray(grid.values, dtype=np.float32)
    if keep_all:
        return values, np.asarray(grid.origin_mm, dtype=np.float64)
    ny, nx = values.shape
    i0, j0 = np.clip(np.floor((low - grid.origin_mm) / grid.spacing_mm).astype(int), 0, [nx, ny])
    i1, j1 = np.clip(np.ceil((high - grid.origin_mm) / grid.spacing_mm).astype(int) + 1, 0, [nx, ny])
    if i1 <= i0 or j1 <= j0:
        return None
    return values[j0:j1, i0:i1], grid.origin_mm + grid.spacing_mm * np.array([i0, j0])


def _png(values: NDArray[np.float32], scale: HeightScale, most_bytes: int) -> str:
    seen = np.isfinite(values)
    shown = np.where(seen, values, 0).astype(np.float32)[::-1]
    weight = seen.astype(np.float32)[::-1]

    def paint(size: tuple[int, int]) -> NDArray[np.uint8]:
        share = cv2.resize(weight, size, interpolation=cv2.INTER_AREA)
        mean = cv2.resize(shown, size, interpolation=cv2.INTER_AREA) / np.maximum(share, 1e-6)
        drawn = np.dstack([scale.paint(mean)[..., ::-1], np.full(mean.shape, 255, dtype=np.uint8)])
        drawn[share < 0.5] = 0
        return drawn

    return png(paint, (values.shape[1], values.shape[0]), most_bytes)


def png(paint: Callable[[tuple[int, int]], NDArray[np.uint8]], full: tuple[int, int], most_bytes: int) -> str:
    """Encode a picture in base64, made coarser until it has at most so many bytes before that.

    `paint` returns it in a size (width, height), at most `full`: (height, width, 4) in blue, green, red and alpha.
    """
    finer = min(1.0, _MAX_PIXELS / max(full))
    while True:
        drawn = paint((max(1, round(full[0] * finer)), max(1, round(full[1] * finer))))
        data = cv2.imencode(".png", drawn, [cv2.IMWRITE_PNG_COMPRESSION, 6])[1].tobytes()
        if len(data) <= most_bytes:
            return base64.b64encode(data).decode("ascii")
        finer *= 0.8
