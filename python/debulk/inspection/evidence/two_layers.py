"""Two layers in one list of points: scans before and after a ply was laid, or of two poses, written into one cloud.

The mean or the median of both in a cell is a ply that is too low, with pockets that are too flat. In small windows the
points of two layers lie at two heights, and neighbours often in different ones. At a step they lie at two heights, but
neighbours nearly always at the same one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats
from debulk.inspection.clouds.products import product
from debulk.inspection.evidence.ply_zones import SIDES_MM
from debulk.inspection.evidence.sample import sample_of
from debulk.inspection.ply.setup import Setup


@dataclass(frozen=True)
class Limits:
    """Of two layers in a list of points; `tests/python/inspection/test_thicknesses.py` mixes scans."""

    side_pitches: float = 7.0  # of a window: about 49 points
    least_points: int = 16  # of a window
    least_windows: int = 5  # that show two layers
    least_share: float = 0.2  # of the windows looked at that show two layers
    apart_sigmas: float = 4.5  # distance of two halves over the deviation in each: 2.65 for noise, 3.46 if even
    minor_share: float = 0.15  # of the points: a thinner layer is one of outliers
    mixed_share: float = 0.6  # of what chance gives: points whose nearest neighbour lies in the other layer
    apart_thicknesses: float = 0.25  # least distance of the layers


LIMITS = Limits()
_EVERY_MM = SIDES_MM[0]  # from one window to the next


def layers_apart_mm(scan: NDArray[np.float32], setup: Setup, pitch_mm: float) -> float:
    """Return how far apart, mm, two layers lie in a list of points (N, 3), by the median over windows; 0: one layer."""
    if scan.ndim != 2 or not np.isfinite(pitch_mm):
        return 0.0
    side = LIMITS.side_pitches * pitch_mm
    pose = setup.pose
    with np.errstate(invalid="ignore", over="ignore"):  # points that are not finite or far off are in no window
        at = [product(scan, pose[k, :3].astype(np.float32)) + np.float32(pose[k, 3]) for k in (0, 1)]
        near = np.all([np.mod(v, np.float32(_EVERY_MM)) < side for v in at], axis=0) & np.isfinite(scan).all(axis=1)
    sample = sample_of(scan[near], setup.prepared, setup.mold_from_scanner, setup.recipe.run.threads)
    known = np.isfinite(sample.height_mm)
    xy, height = sample.points_mm[known, :2], sample.height_mm[known]
    _, window = np.unique(np.floor(xy / _EVERY_MM).astype(np.int64), axis=0, return_inverse=True)
    order = np.argsort(window.ravel(), kind="stable")
    parts = np.split(order, np.cumsum(np.bincount(window.ravel()))[:-1]) if len(order) else []
    apart = np.array([_apart_mm(xy[part], height[part]) for part in parts if len(part) >= LIMITS.least_points])
    two = apart[apart > LIMITS.apart_thicknesses * setup.recipe.material.thickness_mm]
    return float(np.median(two)) if len(two) >= max(LIMITS.least_windows, LIMITS.least_share * len(apart)) else 0.0


def _apart_mm(xy: Floats, height: Floats) -> float:
    """Return how far apart two mixed layers lie in a window of (N, 2) places and their heights; 0: there is one."""
    terms = np.column_stack([np.ones(len(xy)), xy - xy.mean(axis=0)])
    rest = height - terms @ np.linalg.lstsq(terms, height, rcond=None)[0]
    ranked = np.sort(rest)
    count = len(rest)
    below = np.arange(1, count)
    low = np.cumsum(ranked)[:-1] / below
    high = (ranked.sum() - below * low) / (count - below)
    between = below * (count - below) * (high - low) ** 2 / count**2
    k = int(np.argmax(between))
    within = max(float(np.mean((rest - rest.mean()) ** 2) - between[k]), 1e-12)
    share = (k + 1) / count
    if min(share, 1 - share) < LIMITS.minor_share or high[k] - low[k] < LIMITS.apart_sigmas * np.sqrt(within):
        return 0.0
    upper = rest > ranked[k]
    far = ((xy[:, None] - xy[None]) ** 2).sum(axis=2)
    np.fill_diagonal(far, np.inf)
    mixed = np.mean(upper[np.argmin(far, axis=1)] != upper)
    return float(high[k] - low[k]) if mixed > LIMITS.mixed_share * 2 * share * (1 - share) else 0.0


def layers_reason(apart_mm: float) -> str:
    """Say that a cloud holds two layers, and what to do."""
    return (
        f"the scan holds two layers, {apart_mm:.2f} mm apart, whose points lie side by side: two scans in one cloud, "
        "such as one before the ply was laid and one after it, or a buffer that was not cleared; give one scan alone"
    )
