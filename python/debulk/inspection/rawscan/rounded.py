"""Parts of a scan of rounded depths whose points lie where rounding alone would have put them.

Rounding moves no point by more than half a step, but noise does. A part whose points are all that near to a smooth
surface has none, if steps are so fine that elsewhere many are farther off. Where they are not, only what was filled in
after the rounding shows: it lies between the steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from debulk import _core
from debulk.arrays import Bools, Cloud
from debulk.inspection.clouds.enough import SEEN
from debulk.inspection.evidence import medians
from debulk.inspection.evidence.cloud_image import CloudImage
from debulk.inspection.rawscan import vouched
from debulk.inspection.rawscan.vouched import Asked, Axes, Made, beside, not_vouched, pieces, steps_hide


@dataclass(frozen=True)
class Limits:
    """Of rounded depths; `tests/python/inspection/test_filled.py` rounds scans before and after they were filled."""

    window_cells: int = 13  # along the side of the parts that are judged
    # Of a step: farther from the surface lies no point that was rounded alone, and 0.03 of those of a level ply half
    # way between two steps, however little noise it has.
    half_step: float = 0.65
    most: float = 0.3  # with more of them, a part has noise
    deviations: float = 5.0  # by which parts with noise never lie below the median
    covers_cells: int = 5  # of the side of a part without noise; nearer to its rim, some noise is let pass
    late: float = 0.5  # share of points between steps in what was filled in after the rounding


LIMITS = Limits()
_SMOOTH = np.array([-11, 0, 9, 16, 21, 24, 25, 24, 21, 16, 9, 0, -11], np.float32) / np.float32(143)  # Savitzky, Golay


def made_in(
    image: CloudImage,
    asked: Asked,
    xy_mm: Cloud,
    on_ply: Bools,
    axes: Axes,
    threads: int = 0,
    stop: _core.Stop | None = None,
) -> tuple[tuple[Made, ...], str]:
    """Find the parts of a ply that software made, and say why some cannot be found, as `not_vouched` does."""
    step_mm = image.step_mm
    made, unknown = not_vouched(asked, xy_mm, on_ply, step_mm, threads, stop)
    if not unknown or not step_mm or image.laid or not on_ply.any():
        return made, unknown
    more, unknown = _without_noise(image, asked, xy_mm, on_ply, step_mm, axes)
    return made + more, unknown


def _without_noise(
    image: CloudImage, asked: Asked, xy_mm: Cloud, on_ply: Bools, step_mm: float, axes: Axes
) -> tuple[tuple[Made, ...], str]:
    """Find the parts of a ply without noise in a scan's own image, by heights along any of the axes.

    The second value says why parts that were filled in before the rounding cannot be found; empty: they can.
    """
    every = round(asked.cell_mm / asked.pitch_mm)
    between, own_mm = _steps(image.points[..., 2], every, step_mm)
    used = [c for c in range(3) if any(axis[c] for axis in axes)]
    off = {c: _off_mm(image.heights[..., c], every, on_ply.shape) for c in used}
    made, told = np.zeros(on_ply.shape, np.bool_), False
    for axis in axes:
        off_mm = np.abs(sum(axis[c] * off[c] for c in used))
        judged, share = _shares(off_mm > LIMITS.half_step * own_mm, np.isfinite(off_mm) & on_ply)
        if not judged.any():
            continue
        coarser = own_mm - np.mean(own_mm[judged])  # where steps are coarser, fewer points are so far off
        share -= coarser * np.sum((coarser * share)[judged]) / max(np.sum(coarser[judged] ** 2), np.spacing(step_mm))
        middle, high = np.quantile(share[judged], [0.5, 0.75])
        # Parts without noise have the lowest shares, so that the upper half is free of them.
        least = middle - LIMITS.deviations * 2 * medians.OF_QUARTILES * (high - middle)
        if least > vouched.LIMITS.rarest:
            made, told = made | (judged & (share <= min(least, LIMITS.most))), True
    if not told:
        judged, share = _shares(between, on_ply)
        if judged.any() and np.median(share[judged]) < vouched.LIMITS.rarest:
            made = judged & (share > LIMITS.late)
    made = cv2.dilate(made.view(np.uint8), np.ones((LIMITS.covers_cells,) * 2, np.uint8)).view(np.bool_) & on_ply
    marks = np.stack([made, np.zeros_like(made), np.zeros_like(made)])
    return tuple(pieces(made, xy_mm, asked, marks)), "" if told else steps_hide(step_mm)


def _steps(depths: Cloud, every: int, step_mm: float) -> tuple[Bools, Cloud]:
    """Return which asked points (R, C) lie between steps, and the steps around them: a disparity's vary with depth."""
    here = beside(depths, every, 0, 0)
    gap_mm = np.full(here.shape, np.inf, np.float32)
    for place in ((0, 1), (1, 0)):
        apart = np.abs(beside(depths, every, *place) - here)
        np.fmin(gap_mm, apart, where=apart > 0, out=gap_mm)
    low, middle, high = np.quantile(here[np.isfinite(here)], (0.01, 0.5, 0.99))
    far = abs(middle) > high - low  # else depths are not those from a camera, and all steps are alike
    between = gap_mm < 0.5 * step_mm * (np.minimum((here / middle) ** 2, 1) if far else 1)
    gap_mm[between] = np.inf
    own_mm = cv2.erode(gap_mm, np.ones((LIMITS.window_cells,) * 2, np.uint8))
    own_mm[own_mm > 2 * step_mm] = step_mm
    return between, np.asarray(own_mm)


def _shares(marks: Bools, known: Bools) -> tuple[Bools, Cloud]:
    """Return where on the ply enough is known around, and the shares of those that are marked there."""
    count = _around(known)
    share = _around(marks & known) / np.maximum(count, np.float32(1))
    return known & (count >= SEEN * LIMITS.window_cells**2), np.asarray(share, np.float32)


def _around(marks: Bools) -> Cloud:
    """Return how many are marked in the window around each cell."""
    side, ones = (LIMITS.window_cells,) * 2, marks.view(np.uint8)
    return np.asarray(cv2.boxFilter(ones, cv2.CV_32F, side, normalize=False, borderType=cv2.BORDER_CONSTANT))


def _off_mm(of: Cloud, every: int, shape: tuple[int, ...]) -> Cloud:
    """Return by how much the asked points, of this shape, of an image (H, W) differ from a cubic through those around.

    In a dense image the cubic goes through each k-th pixel, so that it is up to 8 mm wide.
    """
    k = next(k for k in range(max(1, every // 2), 0, -1) if every % k == 0)
    asked = np.s_[:: every // k, :: every // k]
    values = of[2::k, 2::k].copy()
    here = values[asked]
    values -= np.median(here[np.isfinite(here)])  # single precision would round sums of depths
    if (unseen := ~np.isfinite(values)).any():  # takes the mean of its neighbours
        values[unseen] = 0
        near, count = (cv2.blur(one, (5, 5)) for one in (values, (~unseen).astype(np.float32)))
        with np.errstate(invalid="ignore", divide="ignore"):
            values[unseen] = (near / count)[unseen]
    out: Cloud = here - cv2.sepFilter2D(values, -1, _SMOOTH, _SMOOTH)[asked]
    out[unseen[asked]] = np.nan
    return out[: shape[0], : shape[1]]
