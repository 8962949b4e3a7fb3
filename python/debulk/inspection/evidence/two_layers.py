"""Two layers in one cloud: scans before and after a ply was laid or moved, or of two poses.

The mean or the median of both in a cell is a ply that is too low, with pockets that are too flat. In small windows the
points of two layers lie at two heights, and neighbours often in different ones. At a step they lie at two heights, but
neighbours nearly always at the same one. An image has them side by side in rows, columns or pixels, and two passes
between which a ply sank differ on its pockets alone: its windows are near each other, and a few of them are enough.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk import pocket
from debulk.arrays import Bools, Floats
from debulk.inspection.clouds.enough import FEW
from debulk.inspection.clouds.products import affine, product
from debulk.inspection.clouds.thinning import complete
from debulk.inspection.evidence.cloud_image import step_of
from debulk.inspection.evidence.ply_zones import SIDES_MM
from debulk.inspection.evidence.sample import sample_of
from debulk.inspection.ply.ply_on_mold import Setup
from debulk.results.number import HIGHEST_MM


@dataclass(frozen=True)
class Limits:
    """Of two layers in one cloud; `tests/python/inspection/test_thicknesses.py` mixes scans."""

    side: int = 7  # pixels or pitches of a window: 49 points, about as many of a list
    most_points: int = 1000  # of a window, those about its middle: all are compared with all
    least_share: float = 0.2  # of the windows looked at that show two layers
    apart_sigmas: float = 4.5  # distance of two halves over the deviation in each: 2.65 for noise, 3.46 if even
    minor_share: float = 0.15  # of the points: a thinner layer is one of outliers
    mixed_share: float = 0.6  # of what chance gives: points whose nearest neighbour lies in the other layer
    apart_thicknesses: float = 0.25  # least distance of the layers
    every_mm: float = 9.0  # from one window of an image to the next: four across a pocket that can crease
    near_windows: int = 4  # that show two layers, at least: of a list, or of three by three of an image
    near_mixed_share: float = 0.9  # in an image; of what chance gives, a streak of two rows has 0.82
    repeated_share: float = 0.25  # of neighbours both ways that are equal: an image was enlarged, and is no other's
    near_thicknesses: float = 0.75  # least distance in an image, above the relief of a woven ply


LIMITS = Limits()
_EVERY_MM = SIDES_MM[0]  # from one window to the next


def layers_apart_mm(scan: NDArray[np.float32], setup: Setup, pitch_mm: float) -> float:
    """Return how far apart, mm, two layers lie in a cloud, by the median over windows; 0: there is one."""
    if not np.isfinite(pitch_mm):
        return 0.0
    return _in_image_mm(scan, setup, pitch_mm) if scan.ndim == 3 else _in_list_mm(scan, setup, pitch_mm)


def _in_list_mm(scan: NDArray[np.float32], setup: Setup, pitch_mm: float) -> float:
    side = LIMITS.side * pitch_mm
    pose = setup.pose
    with np.errstate(invalid="ignore", over="ignore"):  # points that are not finite or far off are in no window
        at = [product(scan, pose[k, :3].astype(np.float32)) + np.float32(pose[k, 3]) for k in (0, 1)]
        near = np.all([np.mod(v, np.float32(_EVERY_MM)) < side for v in at], axis=0) & complete(np.isfinite(scan))
    sample = sample_of(scan[near], setup)
    known = np.isfinite(sample.height_mm)
    xy, height = sample.points_mm[known, :2], sample.height_mm[known]
    _, window = np.unique(np.floor(xy / _EVERY_MM).astype(np.int64), axis=0, return_inverse=True)
    order = np.argsort(window.ravel(), kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(window.ravel()))[:-1]) if len(order) else []
    apart = np.array([_apart_mm(xy[part], height[part]) for part in parts if len(part) >= FEW])
    two = apart[apart > LIMITS.apart_thicknesses * setup.recipe.material.thickness_mm]
    return float(np.median(two)) if len(two) >= max(LIMITS.near_windows, LIMITS.least_share * len(apart)) else 0.0


def _in_image_mm(scan: NDArray[np.float32], setup: Setup, pitch_mm: float) -> float:
    side, least_mm = LIMITS.side, LIMITS.near_thicknesses * setup.recipe.material.thickness_mm
    step = max(side, round(LIMITS.every_mm / pitch_mm))
    up = setup.pose[2, :3].astype(np.float32)
    if min(scan.shape[:2]) < side:
        return 0.0
    with np.errstate(invalid="ignore", over="ignore"):  # points at infinity count as none
        # A pixel beside one of the other layer is off the mean of its neighbours by half of the distance, or by all.
        looked = _jumps_mm(scan, up, step) > 0.5 * least_mm
        middle = scan[side // 2 :: step, side // 2 :: step][: looked.shape[0], : looked.shape[1]]
        looked &= complete(np.isfinite(middle))
        if setup.outline is not None and looked.any():
            at = middle[looked].astype(np.float64)
            xy = np.stack([product(at, setup.pose[k, :3]) + setup.pose[k, 3] for k in (0, 1)], axis=1)
            looked[looked] = pocket.inside(setup.outline, xy)
        if np.count_nonzero(looked) < LIMITS.near_windows:
            return 0.0
        height = _along(_windows(scan, side, step)[looked].reshape(-1, side, side, 3), up)
        height[~np.isfinite(height)] = np.nan
        if setup.mask is not None and setup.mask.shape == scan.shape[:2]:
            height[_windows(setup.mask[..., None], side, step)[looked]] = np.nan
        rest = _off_smooth(height.astype(np.float64))
    apart, share, upper = _halves(rest.reshape(len(rest), -1))
    upper = upper.reshape(rest.shape)
    mixed = [np.mean(np.diff(upper, axis=axis), axis=(1, 2)) for axis in (1, 2)]  # of bools: which neighbours differ
    two = (apart > least_mm) & (apart < HIGHEST_MM)
    two &= np.max(mixed, axis=0) > LIMITS.near_mixed_share * 2 * share * (1 - share)
    repeated = [np.mean(np.diff(height, axis=axis) == 0, axis=(1, 2)) for axis in (1, 2)]
    two &= np.min(repeated, axis=0) < LIMITS.repeated_share
    if rounded_mm := step_of(middle[looked][:, 2]):
        two &= apart > 1.5 * rounded_mm  # between two steps a depth takes one or the other by chance
    shown = np.zeros(looked.shape, dtype=np.float32)
    shown[looked] = two
    near = cv2.boxFilter(shown, -1, (3, 3), normalize=False, borderType=cv2.BORDER_CONSTANT)
    return float(np.median(apart[two])) if near.max() >= LIMITS.near_windows else 0.0


def _windows(image: NDArray[Any], side: int, step: int) -> NDArray[Any]:
    """Return the squares of so many pixels, of an image (H, W, K), as (R, C, side, side * K): each row in one piece."""
    each = image.shape[2]
    wide = np.lib.stride_tricks.sliding_window_view(image.reshape(len(image), -1), (side, side * each))
    return wide[::step, :: step * each]


def _along(points: NDArray[np.float32], up: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.asarray(points[..., 0] * up[0] + points[..., 1] * up[1] + points[..., 2] * up[2])


def _jumps_mm(scan: NDArray[np.float32], up: NDArray[np.float32], step: int) -> Floats:
    """Return for each window how far a pixel of its middle row or column is at most off the mean of its neighbours."""
    side = LIMITS.side
    rows, columns = ((size - side) // step + 1 for size in scan.shape[:2])
    most = np.zeros((rows, columns), dtype=np.float32)
    middle, near = side // 2, range(1, side - 1)
    for places in ([(k, middle) for k in near], [(middle, k) for k in near]):
        at = [_along(scan[i::step, j::step][:rows, :columns], up) for i, j in places]
        for low, here, high in zip(at, at[1:], at[2:], strict=False):
            most = np.fmax(most, np.abs(here - 0.5 * (low + high)))
    return most


def _off_smooth(height: Floats) -> Floats:
    """Return what is left of windows (W, S, S) without what bends smoothly; 0 where nothing was seen.

    What is bent alone parts in two as layers do, and its halves change three times along seven pixels.
    """
    along = np.arange(height.shape[1]) - (height.shape[1] - 1) / 2
    bends = [along, along**2 - np.mean(along**2), along**3 - along * ((along**4).sum() / (along**2).sum())]
    ways = [way for bend in bends for way in (bend[:, None], bend[None, :])] + [along[:, None] * along[None, :]]
    rest = height.reshape(len(height), -1).copy()  # 49 values in one row: NumPy works on rows
    known = np.isfinite(rest)
    unseen = np.nonzero(~known)
    rest[unseen] = 0
    rest -= rest.sum(axis=1, keepdims=True) / np.maximum(known.sum(axis=1, keepdims=True), 1)
    rest[unseen] = 0
    for way in ways:
        whole = np.broadcast_to(way, height.shape[1:]).ravel()
        rest -= whole * ((rest * whole).sum(axis=1, keepdims=True) / (whole**2).sum())
        rest[unseen] = 0
    return rest.reshape(height.shape)


def _apart_mm(xy: Floats, height: Floats) -> float:
    """Return how far apart two mixed layers lie in a window of (N, 2) places and their heights; 0: there is one."""
    if len(xy) > LIMITS.most_points:  # a scan in metres has all its points in a few windows
        middle = np.argsort(((xy - xy.mean(axis=0)) ** 2).sum(axis=1), kind="stable")[: LIMITS.most_points]
        xy, height = xy[middle], height[middle]
    factors = affine(xy, height[:, None])
    rest = height - product(xy, factors[:2])[:, 0] - factors[2]
    (apart,), (share,), (upper,) = _halves(rest[None])
    far = ((xy[:, None] - xy[None]) ** 2).sum(axis=2)
    np.fill_diagonal(far, np.inf)
    mixed = np.mean(upper[np.argmin(far, axis=1)] != upper)
    return float(apart) if mixed > LIMITS.mixed_share * 2 * share * (1 - share) else 0.0


def _halves(rest: Floats) -> tuple[Floats, Floats, Bools]:
    """Part each window (W, N) into those above and below so that they scatter least.

    Returned are the distance of the two (W,), 0 where they are no two layers, the lower one's share, and which are the
    upper ones (W, N).
    """
    ranked, count = np.sort(rest, axis=1), rest.shape[1]
    below = np.arange(1, count)
    low = np.cumsum(ranked, axis=1)[:, :-1] / below
    high = (ranked.sum(axis=1)[:, None] - below * low) / (count - below)
    between = below * (count - below) * (high - low) ** 2 / count**2
    best = np.argmax(between, axis=1)
    each = np.arange(len(rest))
    apart = (high - low)[each, best]
    within = np.maximum(np.var(rest, axis=1) - between[each, best], 1e-12)
    share = (best + 1) / count
    thin = np.minimum(share, 1 - share) < LIMITS.minor_share
    apart = np.where(thin | (apart < LIMITS.apart_sigmas * np.sqrt(within)), 0.0, apart)
    return apart, share, rest > ranked[each, best][:, None]


def layers_reason(apart_mm: float) -> str:
    """Say that a cloud holds two layers, and what to do."""
    return (
        f"the scan holds two layers, {apart_mm:.2f} mm apart, whose points lie side by side: two scans in one cloud, "
        "such as one before the ply was laid and one after it, two passes between which it moved, or a buffer that was "
        "not cleared; give one scan alone"
    )
