"""The draped ply: a thickness, an outline, and the air below it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.varied.bumps import Box, Bump
from lab.varied.molds import Mold
from lab.varied.polygons import inside

Floats = NDArray[np.float64]
_DIFFERENCE_MM = 0.1


@dataclass(frozen=True)
class Ply:
    """A ply of constant thickness along the mold's normal, over gaps along z that add up, also beyond the outline."""

    mold: Mold
    outline: Floats
    thickness_mm: float
    bumps: tuple[Bump, ...]

    def gap(self, x: Floats, y: Floats) -> Floats:
        """Height of the air under the ply, mm, as if the ply continued beyond its outline."""
        total = np.zeros(np.shape(x))
        for bump in self.bumps:
            where = _within(bump.box, x, y)
            total[where] += bump.gap(x[where], y[where])
        return total

    def gap_in_image(self, x: Floats, y: Floats) -> Floats:
        """Return the same for (H, W) positions that vary smoothly over the image, evaluating small windows only."""
        total = np.zeros(x.shape)
        for bump, window in zip(self.bumps, _windows((b.box for b in self.bumps), x, y), strict=True):
            if window is not None:
                total[window] += bump.gap(x[window], y[window]) * _within(bump.box, x[window], y[window])
        return total

    def laid(self, x: Floats, y: Floats) -> Floats:
        """Height of the upper side of a ply without air below it in the mold's frame, continued beyond its outline."""
        mold = self.mold.smooth_height
        rises = [mold(x + d, y + e) - mold(x - d, y - e) for d, e in ((_DIFFERENCE_MM, 0.0), (0.0, _DIFFERENCE_MM))]
        upright = np.sqrt(1 + sum((rise / (2 * _DIFFERENCE_MM)) ** 2 for rise in rises))  # 1 / cos(slope)
        return np.asarray(mold(x, y) + self.thickness_mm * upright)

    def top(self, x: Floats, y: Floats) -> Floats:
        """Height of the ply's upper side in the mold's frame, continued beyond its outline."""
        return self.laid(x, y) + self.gap(x, y)

    def height_above_mold(self, x: Floats, y: Floats) -> Floats:
        """Thickness and gap, 0 beside the ply; on a slope its upper side stands higher by what the thickness leans."""
        return np.where(inside(self.outline, x, y), self.thickness_mm + self.gap(x, y), 0.0)


def _within(box: Box, x: Floats, y: Floats) -> NDArray[np.bool_]:
    inner: NDArray[np.bool_] = (x > box[0]) & (x < box[2]) & (y > box[1]) & (y < box[3])
    return inner


_STEP = 8


def _windows(boxes: Iterable[Box], x: Floats, y: Floats) -> list[tuple[slice, slice] | None]:
    """Windows of the image that contain all pixels in each box, from every eighth pixel; None if there are none."""
    xs, ys = x[::_STEP, ::_STEP], y[::_STEP, ::_STEP]
    margin = 0.0  # every pixel is within one coarse step of a coarse pixel
    for axis in (0, 1):
        if xs.shape[axis] > 1:
            step = np.hypot(np.diff(xs, axis=axis), np.diff(ys, axis=axis)).max()
            margin = max(margin, float(step))
    windows: list[tuple[slice, slice] | None] = []
    for box in boxes:
        grown = (box[0] - 2 * margin, box[1] - 2 * margin, box[2] + 2 * margin, box[3] + 2 * margin)
        rows, columns = np.nonzero(_within(grown, xs, ys))
        if len(rows) == 0:
            windows.append(None)
            continue
        first_row, last_row = _STEP * (rows.min() - 1), _STEP * (rows.max() + 1)
        first_column, last_column = _STEP * (columns.min() - 1), _STEP * (columns.max() + 1)
        windows.append((slice(max(first_row, 0), last_row + 1), slice(max(first_column, 0), last_column + 1)))
    return windows
