"""A pinhole camera that views height functions: where each pixel's ray first meets the surface."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Height = Callable[[Floats, Floats], Floats]
_COARSE = 4
_BLOCK = 32  # rows of an image whose heights are asked for at once


@dataclass(frozen=True)
class Camera:
    """A pinhole in the mold's frame: x_mold = rotation x_camera + centre; the camera's z is its viewing direction."""

    size: tuple[int, int]  # width, height
    focal: float
    middle: tuple[float, float]
    rotation: Floats
    centre: Floats

    @property
    def mold_from_scanner(self) -> Floats:
        """(4, 4) motion."""
        motion = np.eye(4)
        motion[:3, :3], motion[:3, 3] = self.rotation, self.centre
        return motion

    def directions(self, every: int = 1) -> tuple[Floats, Floats, Floats]:
        """Mold components of each pixel's ray per mm of depth; `every` gives those of the centres of larger blocks."""
        width, height = (-(-n // every) for n in self.size)
        shift = 0.5 * (every - 1)
        u = ((np.arange(width) * every + shift) - self.middle[0]) / self.focal
        v = ((np.arange(height) * every + shift) - self.middle[1]) / self.focal
        r = self.rotation
        return tuple(r[k, 0] * u[None, :] + r[k, 1] * v[:, None] + r[k, 2] for k in range(3))

    def project(self, points: Floats) -> Floats:
        """Convert mold points (..., 3) to pixels (..., 2)."""
        away = points - self.centre
        local = [sum(self.rotation[k, i] * away[..., k] for k in range(3)) for i in range(3)]
        u = self.focal * local[0] / local[2] + self.middle[0]
        v = self.focal * local[1] / local[2] + self.middle[1]
        return np.stack([u, v], axis=-1)


def first_hit(
    camera: Camera, height: Height, height_in_image: Height, low_mm: float, high_mm: float, steepness: float
) -> Floats:
    """Depth at which each ray first meets z = height(x, y), which lies between `low_mm` and `high_mm` in the view.

    `steepness` bounds the slope. Coarse rays are followed from above, in steps too small to enter any surface of that
    slope. The image between them is found by secants, except where the surface may hide parts of itself.
    """
    dx, dy, dz = camera.directions(_COARSE)
    lateral = np.hypot(dx, dy)
    start = (high_mm - camera.centre[2]) / dz
    end = (low_mm - camera.centre[2]) / dz
    coarse = _walk(camera.centre, (dx, dy, dz), height, start, end, steepness)
    hides = steepness * float((lateral / -dz).max()) > 0.9
    full = camera.directions()
    guess = cv2.resize(coarse, None, fx=_COARSE, fy=_COARSE, interpolation=cv2.INTER_LINEAR)
    guess = guess[: camera.size[1], : camera.size[0]]
    depth, good = _secants(camera.centre, full, height_in_image, np.asarray(guess, dtype=np.float64))
    if hides:  # where the coarse depths bend sharply, there may be an earlier hit
        bend = np.abs(cv2.Laplacian(coarse, cv2.CV_64F, ksize=1))
        sharp = cv2.dilate((bend > 1.0).astype(np.uint8), np.ones((5, 5), np.uint8))
        sharp = cv2.resize(sharp, None, fx=_COARSE, fy=_COARSE, interpolation=cv2.INTER_NEAREST)
        good &= sharp[: camera.size[1], : camera.size[0]] == 0
    rest = ~good
    if rest.any():
        rays = tuple(d[rest] for d in full)
        begin = cv2.erode(coarse, np.ones((3, 3), np.uint8)) - 12.0  # nearer than any neighbouring hit
        begin = np.maximum(begin, start)
        begin = cv2.resize(begin, None, fx=_COARSE, fy=_COARSE, interpolation=cv2.INTER_NEAREST)
        begin = begin[: camera.size[1], : camera.size[0]][rest]
        depth[rest] = _walk(camera.centre, rays, height, begin, (low_mm - camera.centre[2]) / rays[2], steepness)
    return depth


def _walk(
    centre: Floats, rays: tuple[Floats, ...], height: Height, start: Floats, end: Floats, steepness: float
) -> Floats:
    """Follow rays from above in steps that stay above the surface, to within 1e-6 mm of it."""
    dx, dy, dz = (np.ravel(d) for d in rays)
    depth, last = np.ravel(start).copy(), np.ravel(end)
    rate = -dz + steepness * np.hypot(dx, dy)
    active = np.arange(depth.size)
    for _ in range(400):
        t = depth[active]
        above = centre[2] + t * dz[active] - height(centre[0] + t * dx[active], centre[1] + t * dy[active])
        depth[active] = np.minimum(t + above / rate[active], last[active])
        active = active[(above > 1e-6) & (depth[active] < last[active])]
        if active.size == 0:
            break
    return depth.reshape(np.shape(start))


def _secants(
    centre: Floats, rays: tuple[Floats, ...], height: Height, guess: Floats
) -> tuple[Floats, NDArray[np.bool_]]:
    """Roots near a guess, and where they were found to within 1e-5 mm."""
    dx, dy, dz = rays

    def above(t: Floats) -> Floats:
        free = np.empty_like(t)
        for first in range(0, len(t), _BLOCK):  # what a few rows need stays in the cache
            part = slice(first, first + _BLOCK)
            x, y = centre[0] + t[part] * dx[part], centre[1] + t[part] * dy[part]
            free[part] = centre[2] + t[part] * dz[part] - height(x, y)
        return free

    old, old_above = guess, above(guess)
    new = old + old_above / -dz
    new_above = above(new)
    for _ in range(4):
        if float(np.abs(new_above).max()) < 1e-5:
            break
        change = new_above - old_above
        step = np.where(np.abs(change) > 1e-12, -new_above * (new - old) / np.where(change == 0, 1, change), 0.0)
        old, old_above = new, new_above
        new = old + np.clip(step, -20, 20)
        new_above = above(new)
    return new, np.abs(new_above) < 1e-5


def random_camera(rng: np.random.Generator, size: tuple[int, int], outline_mm: Floats, crest_mm: float) -> Camera:
    """Draw a camera 1.2 to 3.2 m above the mold, tilted by up to 14 degrees, that sees the outline with a margin."""
    away = outline_mm - outline_mm.mean(axis=0)
    main = np.linalg.svd(away)[2][0]
    yaw = np.arctan2(main[1], main[0]) + rng.choice([0.0, np.pi]) + rng.uniform(-0.4, 0.4)
    tilt, towards = np.deg2rad(rng.uniform(0, 14)), rng.uniform(0, 2 * np.pi)
    view = np.array([np.sin(tilt) * np.cos(towards), np.sin(tilt) * np.sin(towards), -np.cos(tilt)])
    right = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    right -= right @ view * view
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(view, right), view], axis=1)
    middle = np.array([*outline_mm.mean(axis=0), crest_mm])
    centre = middle - view * rng.uniform(1200, 3200)
    margin = 1 + rng.uniform(0.04, 0.15)
    around = np.column_stack([outline_mm.mean(axis=0) + margin * away, np.full(len(away), crest_mm)])
    unit = Camera(size, 1.0, (0.0, 0.0), rotation, centre)
    seen = unit.project(around)
    low, high = seen.min(axis=0), seen.max(axis=0)
    focal = float(0.97 * min((size[0] - 1) / (high[0] - low[0]), (size[1] - 1) / (high[1] - low[1])))
    place = 0.5 * np.array(size) - 0.5 - focal * 0.5 * (low + high)
    return Camera(size, focal, (float(place[0]), float(place[1])), rotation, centre)
