"""Mistakes in the laying itself: the ply is torn, its corner is folded over, or an object lies on it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lab.varied.given import AnyLayup, Cloud, Floats, Given, Mistake
from lab.varied.mistaken_clouds import raised
from lab.varied.polygons import inside

Rng = np.random.Generator
Bools = NDArray[np.bool_]
_NOISE_MM = 0.02


def _torn(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    """Cut an ellipse out of the ply."""
    points = given.in_mold(given.scan)
    size = float(rng.uniform(30, 100))
    return replace(given, scan=_bare(given, _ellipse(points, layup, size, rng), rng), note=f"{size:.0f} mm")


def _folded(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    """Fold over the part farthest in some direction: bare mold remains there, and two plies beside it."""
    way = float(rng.uniform(0, 2 * np.pi))
    normal = np.array([np.cos(way), np.sin(way)])
    depth = float(rng.uniform(25, 80))
    fold = float((layup.ply_outline @ normal).max()) - depth
    xy = given.in_mold(given.scan)[..., :2]
    beyond = xy @ normal - fold
    mirrored = xy - 2 * beyond[..., None] * normal
    double = (beyond < 0) & (beyond > -depth) & inside(layup.ply_outline, mirrored[..., 0], mirrored[..., 1])
    bare = (beyond > 0) & inside(layup.ply_outline, xy[..., 0], xy[..., 1])
    lifted = _lifted(given, double, _thickness_mm(layup))
    return replace(given, scan=_bare(replace(given, scan=lifted), bare, rng), note=f"{depth:.0f} mm")


def _foreign(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    """Lay a flat object on the ply, one to four plies thick."""
    size, thick = float(rng.uniform(25, 100)), float(rng.uniform(1, 4)) * _thickness_mm(layup)
    on = _ellipse(given.in_mold(given.scan), layup, size, rng)
    return replace(given, scan=_lifted(given, on, thick), note=f"{size:.0f} mm, {thick:.2f} mm thick")


def _ellipse(points: Floats, layup: AnyLayup, size: float, rng: Rng) -> Bools:
    """Mark points in an ellipse of the given length, centred somewhere in the middle half of the ply."""
    low, high = layup.ply_outline.min(axis=0), layup.ply_outline.max(axis=0)
    x, y = (points[..., k] - (low[k] + (high[k] - low[k]) * rng.uniform(0.25, 0.75)) for k in range(2))
    turn = rng.uniform(0, np.pi)
    u, v = x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)
    return np.asarray((u / size) ** 2 + (v / size / rng.uniform(0.6, 1)) ** 2 < 0.25)


def _bare(given: Given, where: Bools, rng: Rng) -> Cloud:
    """Show the reference there, with its own noise."""
    noise = (_NOISE_MM * rng.standard_normal(where.shape)).astype(np.float32)
    return np.where(where[..., None], _along_rays(given.reference, noise), given.scan)


def _lifted(given: Given, where: Bools, by_mm: float) -> Cloud:
    higher = raised(given, given.scan, lambda u, v: np.full_like(u, by_mm))
    return np.where(where[..., None], higher, given.scan)


def _along_rays(cloud: Cloud, by_mm: NDArray[np.float32]) -> Cloud:
    ranges = np.linalg.norm(cloud, axis=-1)
    return np.asarray(cloud * (1 + by_mm / ranges)[..., None], np.float32)


def _thickness_mm(layup: AnyLayup) -> float:
    return float(getattr(layup, "truth").thickness_mm)  # noqa: B009


PLY: tuple[Mistake, ...] = (
    Mistake("ply torn", True, _torn),
    Mistake("corner folded over", True, _folded),
    Mistake("something on the ply", False, _foreign),
)
"""Mistakes in the ply."""
