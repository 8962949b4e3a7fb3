"""Checks whether the cameras are still as they were when calibrated: points of one row must lie in the same row.

Fringes across the rows say nothing about the rows themselves, but the texture of the surface does. In patches, the
modulation of the left image is compared with that of the right image at the matched places, several rows up or down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from debulk.arrays import Floats, Singles
from debulk.scanner.calibration import Rectified
from debulk.scanner.decode import Phase

MOST_ERROR = 4e-4
"""Limit relative to the image's width: half a pixel of 1280. Highlights that move between cameras cause as much."""
_WIDE = 1280  # pixels across; in wider images only every second, third ... pixel and row is used
_HALF = 12  # half the size of a patch, pixels
_REACH = 6  # rows up and down
_GRID = 14, 10  # patches across and down
_LEAST_CORRELATION = 0.7
_LEAST_PATCHES = 6


@dataclass(frozen=True)
class Epipolar:
    """Agreement of the rows of the two images."""

    error_px: float
    """Root mean square distance of a point's row in the right image from its row in the left image, in the form that a
    turned camera would cause; NaN if the surface has too little texture."""
    patches: int
    """Number of patches of the image that contributed."""


def judge_rows(points: Singles, left: Phase, right: Phase, rectified: Rectified) -> tuple[Epipolar, str]:
    """Measure how well the rows agree, and say what is wrong if they do not."""
    shifts, textured, error = np.empty((0, 3)), 0, float("nan")
    most = MOST_ERROR * max(1280, rectified.pixels[0])
    for part in (0, 2, 1, 3):  # the first two: every other column of patches
        found, seen = row_shifts(points, left, right, rectified, part)
        shifts, textured = np.concatenate([shifts, found]), textured + seen
        if len(shifts) >= _LEAST_PATCHES:
            error = float(np.sqrt(np.mean(even(shifts) ** 2)))
        if len(shifts) >= max(4 * _LEAST_PATCHES, textured // 2) and error <= most / 2:
            break  # the other patches would not change this
    judged = Epipolar(error, len(shifts))
    if textured < _LEAST_PATCHES:
        return judged, ""
    if len(shifts) < max(_LEAST_PATCHES, textured // 3):
        return judged, (
            f"the surface's texture agrees in only {len(shifts)} of {textured} patches of the two images: a "
            f"camera was moved "
            "far since the calibration, or the images are of different scans"
        )
    if error > most:
        return judged, (
            f"points of one row lie {error:.1f} rows apart in the two images: a camera was moved since the "
            f"calibration; "
            "calibrate again"
        )
    return judged, ""


def even(shifts: Floats) -> Floats:
    """Fit the part of (K, 3) shifts that a turned camera causes, linear over the image; outliers count less."""
    basis = np.column_stack([np.ones(len(shifts)), shifts[:, :2]])
    weight = np.ones(len(shifts))
    fit = np.zeros(len(shifts))
    for _ in range(10):
        solved, *_ = np.linalg.lstsq(basis * weight[:, None], shifts[:, 2] * weight, rcond=None)
        fit = basis @ solved
        off = np.abs(shifts[:, 2] - fit)
        weight = np.sqrt(1 / np.maximum(off, 0.5 * float(np.median(off)) + 1e-9))
    return np.asarray(fit)


def row_shifts(points: Singles, left: Phase, right: Phase, rectified: Rectified, part: int) -> tuple[Floats, int]:
    """Return the row shift in each patch that agrees, (K, 3) with its place, and the number of patches with texture.

    Every fourth column of patches belongs to the same part. A place is given relative to the middle of the image, as a
    fraction of its width.
    """
    width, height = rectified.pixels
    shifts, textured = [], 0
    step = max(1, width // _WIDE)
    reach = _HALF * step
    margin = reach + _REACH * step + 1
    for y in np.linspace(margin, height - 1 - margin, _GRID[1]).astype(int):
        for x in np.linspace(reach, width - 1 - reach, _GRID[0]).astype(int)[part::4]:
            found = _patch(int(x), int(y), step, points, left, right, rectified)
            if found is None:
                continue
            textured += 1
            if found[0] >= _LEAST_CORRELATION:
                shifts.append((x / width - 0.5, (y - 0.5 * height) / width, found[1]))
    return np.asarray(shifts).reshape(-1, 3), textured


def _patch(
    x: int, y: int, step: int, points: Singles, left: Phase, right: Phase, rectified: Rectified
) -> tuple[float, float] | None:
    """Best correlation and the row shift there; None without enough points or texture."""
    half = _HALF * step
    rows, columns = slice(y - half, y + half + 1, step), slice(x - half, x + half + 1, step)
    depth = points[rows, columns, 2]
    seen = np.isfinite(depth)
    if y < half or x < half or depth.shape != (2 * _HALF + 1, 2 * _HALF + 1) or seen.mean() < 0.9:
        return None
    if not seen.all():
        depth = np.where(seen, depth, np.median(depth[seen]))
    shift = rectified.right_cx - rectified.left_centre[0]
    there = np.arange(columns.start, columns.stop, step) - (rectified.focal_px * rectified.baseline_mm / depth - shift)
    left_x, left_y, right_x, right_y = rectified.maps
    reference = _textures(left, left_x[rows, columns], left_y[rows, columns], 1)[0]
    if not reference @ reference >= 0.02**2 * reference.size:  # its mean is 0
        return None
    # All shifts in one go: the same columns, in rows up and down.
    wide = np.arange(-_REACH, _REACH + 1)
    lines = wide[:, None] * step + np.arange(rows.start, rows.stop, step)
    at_x = np.tile(there.astype(np.float32), (len(wide), 1))
    at_y = np.repeat(lines.reshape(-1, 1).astype(np.float32), there.shape[1], axis=1)
    there_x, there_y = _remap((right_x, right_y), at_x, at_y)
    textures = _textures(right, there_x, there_y, len(wide))
    scores = textures @ reference / np.sqrt((textures**2).sum(axis=1) * (reference @ reference) + 1e-300)
    scores[np.isnan(scores)] = -1.0
    best = int(np.argmax(scores))
    if best in (0, wide.size - 1) or scores[best - 1] < -0.9 or scores[best + 1] < -0.9:
        return 0.0, 0.0
    before, here, after = scores[best - 1 : best + 2]
    bend = before - 2 * here + after
    return float(here), float(step * (wide[best] + (0.5 * (before - after) / bend if bend < 0 else 0.0)))


def _remap(images: Sequence[Singles], x: Singles, y: Singles) -> list[Singles]:
    """Interpolate several images at the same places."""
    import cv2

    # Cut out only the part that is needed: OpenCV's coordinates end at 32767, and counting from a corner keeps
    # precision.
    i0, j0 = max(int(y.min()) - 2, 0), max(int(x.min()) - 2, 0)
    part = slice(i0, int(y.max()) + 4), slice(j0, int(x.max()) + 4)
    if min(images[0][part].shape) < 2:
        return [np.full(x.shape, np.nan, np.float32)] * len(images)
    # A single row, for which OpenCV wakes no other threads.
    column, row = (x - np.float32(j0)).reshape(1, -1), (y - np.float32(i0)).reshape(1, -1)
    out = []
    for image in images:
        found = cv2.remap(
            image[part],
            column,
            row,
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=float("nan"),
        )
        out.append(np.asarray(found, np.float32).reshape(x.shape))
    return out


def _textures(phase: Phase, x: Singles, y: Singles, parts: int) -> Floats:
    """Logarithm of the modulation at these places, (parts, places) for so many parts, one below the other.

    It does not depend on the exposure, and the slope of the light itself is removed, so that only texture is left. A
    part is NaN where the modulation is not known everywhere.
    """
    height, width = phase.modulation.shape
    x, y = x.reshape(parts, -1), y.reshape(parts, -1)
    left, right, top, bottom = x.min(axis=1), x.max(axis=1), y.min(axis=1), y.max(axis=1)
    whole = (left >= 0) & (top >= 0) & (right <= width - 1) & (bottom <= height - 1)  # False for NaN
    if whole.all():
        out = _logarithms(phase, x, y)
    else:
        out = np.full(x.shape, np.nan)
        if whole.any():
            out[whole] = _logarithms(phase, x[whole], y[whole])
    return np.asarray(out - out @ _slopes() @ _slopes().T)


def _logarithms(phase: Phase, x: Singles, y: Singles) -> Floats:
    i0, j0 = max(int(y.min()) - 1, 0), max(int(x.min()) - 1, 0)
    part = slice(i0, int(y.max()) + 3), slice(j0, int(x.max()) + 3)
    bright = np.asarray(phase.brightness, np.float32)
    # The modulation is NaN where every exposure is saturated.
    light = phase.modulation[part] / bright.take(phase.exposure[part], mode="clip")
    (found,) = _remap((light,), x - np.float32(j0), y - np.float32(i0))
    return np.log(np.maximum(found, 1e-6)).astype(np.float64)


@cache
def _slopes() -> Floats:
    """Orthonormal columns that span a patch's mean and slopes."""
    rows, columns = np.indices((2 * _HALF + 1, 2 * _HALF + 1))
    return np.asarray(np.linalg.qr(np.stack([np.ones(rows.size), rows.ravel(), columns.ravel()], axis=1))[0])
