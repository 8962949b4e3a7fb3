"""Checks whether the cameras are still as they were when calibrated: points of one row must lie in the same row.

Fringes across the rows say nothing about the rows themselves, but the texture of the surface does. In patches, the
modulation of the left image is compared with that of the right image at the matched places, several rows up or down.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from debulk import _core
from debulk.arrays import Floats, Singles
from debulk.scanner.calibration import Rectified
from debulk.scanner.decode import Phase

MOST_ERROR = 4e-4
"""Limit relative to the image's width: half a pixel of 1280. Highlights that move between cameras cause as much."""
_WIDE = 1280  # pixels across; in wider images only every second, third ... pixel and row is used
_HALF = _core.scanner.patch_half  # steps: half the size of a patch
_REACH = _core.scanner.row_reach  # steps: how far up and down it is sought
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


def judge_rows(
    points: Singles, left: Phase, right: Phase, rectified: Rectified, threads: int, stop: _core.Stop
) -> tuple[Epipolar, str]:
    """Measure how well the rows agree, and say what is wrong if they do not."""
    shifts, textured, error = np.empty((0, 3)), 0, float("nan")
    most = MOST_ERROR * max(1280, rectified.pixels[0])
    for part in (0, 2, 1, 3):  # the first two: every other column of patches
        found, seen = row_shifts(points, left, right, rectified, part, threads, stop)
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


def row_shifts(
    points: Singles, left: Phase, right: Phase, rectified: Rectified, part: int, threads: int, stop: _core.Stop
) -> tuple[Floats, int]:
    """Return the row shift in each patch that agrees, (K, 3) with its place, and the number of patches with texture.

    Every fourth column of patches belongs to the same part. A place is given relative to the middle of the image, as a
    fraction of its width.
    """
    width, height = rectified.pixels
    step = max(1, width // _WIDE)
    reach = _HALF * step
    margin = reach + _REACH * step + 1
    rows = np.linspace(margin, height - 1 - margin, _GRID[1]).astype(int)
    columns = np.linspace(reach, width - 1 - reach, _GRID[0]).astype(int)[part::4]
    places = [(int(x), int(y)) for y in rows for x in columns]
    found = _core.scanner.row_shifts(
        places,
        step,
        points,
        rectified.focal_px * rectified.baseline_mm,
        rectified.right_cx - rectified.left_centre[0],
        (left.modulation, left.exposure, left.brightness, *rectified.maps[:2]),
        (right.modulation, right.exposure, right.brightness, *rectified.maps[2:]),
        threads=threads,
        stop=stop,
    )
    shifts = [
        (x / width - 0.5, (y - 0.5 * height) / width, shift)
        for (x, y), (textured, correlation, shift) in zip(places, found, strict=True)
        if textured and correlation >= _LEAST_CORRELATION
    ]
    return np.asarray(shifts).reshape(-1, 3), sum(textured for textured, *_ in found)
