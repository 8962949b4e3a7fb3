"""A scan as an image of heights, in which neighbours are known: the scan's own pixels, or a list of points laid out."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk import cloud
from debulk.arrays import Cloud, Floats
from debulk.inspection.clouds.enough import FEW, POINTS, SEEN
from debulk.inspection.clouds.thinning import complete
from debulk.surface import Reference

SAMPLE_MM = 1.0  # a denser image is read in steps of about this
# A pixel's side over the pitch of the points: of points that lie at random, 92 % of such pixels hold at least one.
_SIDE = 1.6
_MOST_PIXELS = 8_000_000  # a denser list is laid out more coarsely
_ROWS = 60  # from which the step of the depths is read
_LEVELS = 5  # of depths, from which on they show a step
_GAP = 2.0  # times the pitch: points of a list that lie farther apart are no neighbours
_BACK = 8.0  # pixels: where a list goes back by more, a line begins; a pixel that flies lies beside its place by fewer
_OUTSIDE, _BEYOND = 1e-3, 0.1  # share of its points that may lie off the lines at either end, and by how much of them
_SPARSE = 4.0  # pixels per point of an image that was one
ROUNDING = 4.0  # times a float32's resolution: smaller steps of depths are its own
_AROUND = 5  # pixels along the side of the window from which a pixel's slope is read


@dataclass(frozen=True, eq=False)
class CloudImage:
    """An image of some of a list's points, one for each pixel."""

    points: Cloud
    """(H, W, 3), scanner's frame, NaN where a pixel holds none: the points as they came."""
    heights: Cloud
    """(H, W, 3) the pixels' middles in mold XY, and the heights above the reference there. A point lies anywhere in its
    pixel. Its height is moved to the middle along the slope of the heights around."""
    pitch_mm: float
    """Side of a pixel; inf: not known."""

    @property
    def laid(self) -> bool:
        """Whether a list was laid out; the scan's own image has its points for heights."""
        return self.heights is not self.points

    @property
    def step_mm(self) -> float:
        """Step to which most depths, the scanner's z, were rounded; 0: no coarser than float32, or no steps are seen.

        What was filled in after the rounding lies between the steps, mostly once at each depth.
        """
        depths = self.points[:: max(1, len(self.points) // _ROWS), :, 2]
        depths = np.sort(depths[np.isfinite(depths)])
        same = depths[1:] == depths[:-1]
        levels = depths[1:][same & ~np.append(False, same[:-1])]  # each depth that repeats, once
        if len(levels) < _LEVELS or 2 * (len(levels) + np.count_nonzero(same)) < len(depths):
            return 0.0
        step = float(np.median(np.diff(levels)))
        return step if step > ROUNDING * float(np.spacing(np.abs(levels).max())) else 0.0


def step_of(depths: NDArray[np.float32]) -> float:
    """Return the step to which some depths, all finite, were rounded; 0: no coarser than float32."""
    apart = np.diff(np.unique(depths))
    if not len(apart):
        return 0.0
    least = float(apart.min())
    return least if least > ROUNDING * float(np.spacing(np.abs(depths).max())) else 0.0


def in_lines(scan: Cloud, pitch_mm: float) -> CloudImage | None:
    """Return a list of points (N, 3) that came line by line as the image that it was; None: it came in another order.

    Software that exports an image as a list writes row after row, mostly without the pixels that were not seen.
    """
    if len(scan) < FEW or not np.isfinite(pitch_mm):
        return None
    first = np.arange(0, len(scan) - 1, max(1, len(scan) // POINTS))
    with np.errstate(invalid="ignore", over="ignore"):  # points that are not finite or far off have no neighbours
        steps = (scan[first + 1, :2] - scan[first, :2]).astype(np.float64)
        apart = np.hypot(*steps.T)
    beside = steps[apart < _GAP * pitch_mm]
    if len(beside) < SEEN * len(first):
        return None
    along = np.median(beside, axis=0)
    wide_mm = float(np.hypot(*along))
    if not wide_mm > 0:
        return None
    right, up = (along / wide_mm**2).tolist()
    with np.errstate(invalid="ignore"):
        place = right * scan[:, 0].astype(np.float64) + up * scan[:, 1].astype(np.float64)
    some = place[first]
    ends = np.quantile(some[np.isfinite(some)], (_OUTSIDE, 1 - _OUTSIDE))
    on = (place > ends[0] - _BEYOND * np.ptp(ends)) & (place < ends[1] + _BEYOND * np.ptp(ends))
    on &= np.isfinite(scan[:, 2])
    scan, place = scan[on], place[on]
    row = np.concatenate([[0], np.cumsum(np.diff(place) < -_BACK)])
    column = np.rint(place - place.min()).astype(np.int64)
    shape = int(row[-1]) + 1, int(column.max()) + 1
    if min(shape) < 2 or np.prod(shape) > _SPARSE * len(scan):
        return None
    points = np.full((*shape, 3), np.nan, dtype=np.float32)
    points[row, column] = scan
    with np.errstate(over="ignore"):
        across = np.hypot(*np.moveaxis(points[1:, :, :2] - points[:-1, :, :2], -1, 0))
    if np.count_nonzero(across < _GAP * max(pitch_mm, pitch_mm**2 / wide_mm)) < SEEN * len(scan):
        return None
    return CloudImage(points, points, pitch_mm)


def laid_out(
    scan: Cloud, mold_from_scanner: Floats | None, reference: Reference, box_mm: Floats, pitch_mm: float, threads: int
) -> CloudImage | None:
    """Lay a list of points (N, 3), scanner's frame, out as an image over a part of the mold.

    The part is a box (2, 2) of lowest and highest mold XY. None: the part, or the points' pitch, is not known.
    """
    lowest, highest = reference.box_mm
    low, high = np.maximum(box_mm[0], lowest), np.minimum(box_mm[1], highest)
    if not np.isfinite(pitch_mm) or not (low < high).all():
        return None
    side = max(_SIDE * pitch_mm, float(np.sqrt(np.prod(high - low) / _MOST_PIXELS)))
    nx, ny = (int(n) for n in np.ceil((high - low) / side))
    mold = scan if mold_from_scanner is None else cloud.transform(scan, mold_from_scanner, threads=threads)
    with np.errstate(invalid="ignore", over="ignore"):
        cell = np.floor((mold[:, :2] - np.float32(low)) / np.float32(side))
        inside = complete(np.isfinite(mold)) & (cell >= 0).all(axis=1) & (cell[:, 0] < nx) & (cell[:, 1] < ny)
    inside = np.flatnonzero(inside)
    off = mold[inside, :2] - np.float32(low) - np.float32(side) * (cell[inside] + np.float32(0.5))
    inside = inside[np.argsort(-(off**2).sum(axis=1), kind="stable")]
    column, row = cell[inside].astype(np.int64).T
    chosen = np.full(nx * ny, -1)
    chosen[row * nx + column] = inside  # of several points in a pixel, the last one stays: that nearest to its middle
    held = np.flatnonzero(chosen >= 0)
    points = np.full((ny * nx, 3), np.nan, dtype=np.float32)
    points[held] = scan[chosen[held]]
    x, y = low[0] + side * (np.arange(nx) + 0.5), low[1] + side * (np.arange(ny) + 0.5)
    image = np.stack([*np.meshgrid(x, y), np.full((ny, nx), np.nan)], axis=-1).reshape(-1, 3)
    of = mold[chosen[held]].astype(np.float64)
    image[held, 2] = of[:, 2] - reference.height(np.clip(of[:, :2], lowest, highest))
    beside = np.zeros((ny * nx, 2))
    beside[held] = (of[:, :2] - image[held, :2]) / side
    heights = image.reshape(ny, nx, 3)
    heights[..., 2] -= _along_the_slope(heights[..., 2], beside.reshape(ny, nx, 2))
    return CloudImage(points.reshape(ny, nx, 3), heights.astype(np.float32), side)


def _along_the_slope(height: Floats, off: Floats) -> Floats:
    """Return by how much each height changes over the way (in pixels) from its pixel's middle to its point."""
    seen = np.isfinite(height)
    weight = cv2.blur(seen.astype(np.float64), (_AROUND, _AROUND))
    level = cv2.blur(np.where(seen, height, 0.0), (_AROUND, _AROUND)) / np.maximum(weight, 1e-9)
    level[weight <= 0] = 0.0
    down, right = np.gradient(level)
    return np.where(seen, off[..., 0] * right + off[..., 1] * down, 0.0)
