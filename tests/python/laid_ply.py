"""A ply laid on a virtual layup's mold, with whatever shape stands on it: its scan, as the layup's camera sees it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
from numpy.typing import NDArray

import debulk
from debulk import pocket, scenes

Floats = NDArray[np.float64]
Shape = Callable[[Floats, Floats], Floats]  # height above the laid ply from x and y, mold frame, mm

CENTRE_MM = (0.0, 0.0)
THICKNESS_MM = 0.3
_NOTHING_MM = 1e-9  # beside a bell stands cos(pi / 2)², which is not quite zero; a depth in float32 is kept to 1e-4


@cache
def layup(seed: int = 3) -> scenes.Layup:
    """Return the layup whose mold, camera and outline are used."""
    return scenes.layup(seed, (1280, 960))


@cache
def inspector() -> debulk.Inspector:
    """Prepare for scans of plies on that mold."""
    one = layup()
    return debulk.Inspector(None, one.reference, one.ply_outline, mold_from_scanner=one.mold_from_scanner)


@cache
def _laid() -> tuple[Floats, Floats, NDArray[np.intp], Floats, NDArray[np.bool_]]:
    """Return the seen points (N, 3) of a ply without any shape, their rays, which are on it and where; what is seen."""
    pose = layup().mold_from_scanner
    points = layup().reference.reshape(-1, 3).astype(np.float64) @ pose[:3, :3].T + pose[:3, 3]
    seen = np.isfinite(points).all(axis=1)
    at = points[seen]
    rays = at - pose[:3, 3]
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    on_ply = np.flatnonzero(pocket.inside(layup().ply_outline, at[:, :2]))
    _lift(at, rays, on_ply, lambda x, y: np.zeros_like(x))
    places = np.ascontiguousarray(at[on_ply, :2].T)
    places.setflags(write=False)  # shapes are given it
    return at, rays, on_ply, places, seen


def _lift(at: Floats, rays: Floats, those: NDArray[np.intp], shape: Shape) -> None:
    """Move those of the points along their rays to a thickness and the shape above the mold."""
    moved, along = at[those], rays[those]
    for _ in range(6):
        x, y = moved[:, 0], moved[:, 1]
        off = inspector().reference.height(moved[:, :2]) + THICKNESS_MM + shape(x, y) - moved[:, 2]
        moved += along * (off / along[:, 2])[:, None]
    at[those] = moved


def scan(shape: Shape, noise_mm: float = 0.02, seed: int = 0) -> NDArray[np.float32]:
    """Move each point of the reference along its ray to where the ply is: a thickness and the shape above the mold."""
    laid, rays, on_ply, places, seen = _laid()
    at = laid.copy()
    _lift(at, rays, on_ply[np.abs(shape(*places)) > _NOTHING_MM], shape)
    at += rays * np.random.default_rng(seed).normal(0.0, noise_mm, len(at))[:, None]
    pose, points = layup().mold_from_scanner, np.full((len(seen), 3), np.nan)
    points[seen] = (at - pose[:3, 3]) @ pose[:3, :3]
    return points.astype(np.float32).reshape(layup().reference.shape)


def bell(x0: float, y0: float, wide_mm: float, high_mm: float, long_mm: float | None = None) -> Shape:
    """Squares of cosines along x and y; `wide_mm` and `long_mm` from foot to foot."""
    long_mm = wide_mm if long_mm is None else long_mm

    def height(x: Floats, y: Floats) -> Floats:
        u, v = np.clip((x - x0) / wide_mm, -0.5, 0.5), np.clip((y - y0) / long_mm, -0.5, 0.5)
        return high_mm * (np.cos(np.pi * u) * np.cos(np.pi * v)) ** 2

    return height
