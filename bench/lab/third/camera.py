"""A pinhole camera above the mold: organised clouds by ray casting, with noise along each ray."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates, spline_filter

from lab.third.ply import Ply, inside

__all__ = ["Camera", "Patch"]

Floats = NDArray[np.float64]
Cloud = NDArray[np.float32]
_GRID_MM = 1.0


class Patch:
    """A surface by its points over a grid of parameters (a, b), cubic splines between them.

    Parameters
    ----------
    points
        Gives (..., 3) points over (a, b).
    half_mm
        (2,) half lengths of the part of the parameters' plane that is wanted.
    """

    def __init__(self, points: Callable[[Floats, Floats], Floats], half_mm: Floats) -> None:
        self._low = -half_mm
        a, b = np.meshgrid(*(np.arange(-h, h + _GRID_MM, _GRID_MM) for h in half_mm))
        at = points(a, b)
        off = at - np.stack([a, b, np.zeros_like(a)], axis=-1)  # the XY part is small, and so are its errors
        self._splines = [spline_filter(off[..., k], order=3) for k in range(3)]

    def at(self, ab: Floats) -> Floats:
        """Return (N, 3) points over (N, 2) parameters."""
        places = ((ab - self._low) / _GRID_MM).T[::-1]
        off = [map_coordinates(s, places, order=3, mode="nearest", prefilter=False) for s in self._splines]
        return np.asarray(np.stack(off, axis=1) + np.column_stack([ab, np.zeros(len(ab))]))


@dataclass(frozen=True)
class Camera:
    """Pixels, pose and noise.

    Attributes
    ----------
    pixels
        Columns and rows.
    focal
        Focal length, pixels; the principal point is the middle of the image.
    mold_from_scanner
        (4, 4).
    noise_mm
        Standard deviation along a ray that meets a surface at right angles.
    """

    pixels: tuple[int, int]
    focal: float
    mold_from_scanner: Floats
    noise_mm: float

    @classmethod
    def above(cls, rng: np.random.Generator, pixels: tuple[int, int], pitch_mm: float) -> Camera:
        """Return a camera that looks down on the origin from a random place about 1.2 to 2.4 m above it."""
        eye = np.array([*rng.uniform(-100, 100, 2), rng.uniform(1200, 2400)])
        z = -eye / np.linalg.norm(eye)
        turn = np.pi * rng.integers(2) + rng.normal(0, 0.03)  # the whole ply is to be in the image
        x = np.array([np.cos(turn), np.sin(turn), 0.0])
        x -= z * (x @ z)
        x /= np.linalg.norm(x)
        pose = np.eye(4)
        pose[:3, :3], pose[:3, 3] = np.column_stack([x, np.cross(z, x), z]), eye
        return cls(pixels, float(np.linalg.norm(eye)) / pitch_mm, pose, rng.uniform(0.01, 0.03))

    def scan(self, mold: Patch, ply: tuple[Patch, Ply] | None, rng: np.random.Generator) -> Cloud:
        """Return the organised cloud (H, W, 3) of the mold, or of the ply where it lies, in the scanner's frame."""
        wide, high = self.pixels
        u, v = np.meshgrid(np.arange(wide) - (wide - 1) / 2, np.arange(high) - (high - 1) / 2)
        rays = np.stack([u / self.focal, v / self.focal, np.ones_like(u)], axis=-1).reshape(-1, 3)
        turned, eye = rays @ self.mold_from_scanner[:3, :3].T, self.mold_from_scanner[:3, 3]
        _, points = _met(mold, turned, eye)
        if ply is not None:
            ab, on_ply = _met(ply[0], turned, eye)
            covered = inside(ply[1].outline, ab)
            points[covered] = on_ply[covered]
        depth = ((points - eye) / turned)[:, 2]
        image = points.reshape(high, wide, 3)
        normal = np.cross(np.gradient(image, axis=1), np.gradient(image, axis=0)).reshape(-1, 3)
        facing = np.abs((normal * turned).sum(axis=1)) / np.linalg.norm(normal, axis=1) / np.linalg.norm(turned, axis=1)
        depth += rng.normal(0, self.noise_mm, len(depth)) / np.maximum(facing, 0.2)
        cloud: NDArray[np.float32] = (depth[:, None] * rays).reshape(high, wide, 3).astype(np.float32)
        return cloud


def _met(patch: Patch, rays: Floats, eye: Floats) -> tuple[Floats, Floats]:
    """Return the parameters (N, 2) and points (N, 3) at which rays from the eye meet a surface."""
    ab = eye[:2] - rays[:, :2] * (eye[2] / rays[:, 2])[:, None]
    for _ in range(40):
        at = patch.at(ab)
        miss = eye[:2] + rays[:, :2] * ((at[:, 2] - eye[2]) / rays[:, 2])[:, None] - at[:, :2]
        ab = ab + miss
        if np.abs(miss).max() < 1e-7:
            break
    return ab, patch.at(ab)
