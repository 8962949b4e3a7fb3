"""The light of the projector, and how carbon fibre, mold and table reflect it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats
from debulk.scenes import mold
from debulk.scenes.fringe_rig import View
from debulk.scenes.raycast import Target

GAMMA = 1.25  # gamma that remains in a projector with a linear table
BLUR_PIXELS = 0.7  # of the projector's lens, standard deviation
DARK = 0.004  # light of a black projector pixel relative to a white one
AMBIENT = 0.02
_OVERSAMPLED = 8

_DIFFUSE = 0.022  # reflectance of the fibre; a white wall is 1
_GLOSS = 0.45  # reflectance in the middle of a highlight
_GLOSS_POWER = 140.0  # the greater it is, the narrower the highlights
_WEAVE_MM = 30.0  # two tows


def light_lines(patterns: NDArray[np.uint8]) -> Floats:
    """(n, L) light over the projector's width in L samples, with gamma, pixels and blur; white is 1."""
    shown = patterns[:, patterns.shape[1] // 2].astype(np.float64) / 255.0
    fine = np.repeat(DARK + (1 - DARK) * shown**GAMMA, _OVERSAMPLED, axis=1)
    reach = int(5 * BLUR_PIXELS * _OVERSAMPLED)
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / (BLUR_PIXELS * _OVERSAMPLED)) ** 2)
    kernel /= kernel.sum()
    padded = np.pad(fine, ((0, 0), (reach, reach)), mode="edge")
    return np.stack([np.convolve(line, kernel, mode="valid") for line in padded])


@dataclass(frozen=True, eq=False)
class Texture:
    """Smooth random variation over mold XY, with mean 0 and deviation 1, made of waves of 7 to 25 mm."""

    waves: Floats  # (K, 3) wave vector per mm, phase

    @classmethod
    def drawn(cls, rng: np.random.Generator, count: int = 16) -> Texture:
        """Draw a random texture."""
        direction, length = rng.uniform(0, 2 * np.pi, count), rng.uniform(7.0, 25.0, count)
        k = 2 * np.pi / length
        return cls(np.column_stack([k * np.cos(direction), k * np.sin(direction), rng.uniform(0, 2 * np.pi, count)]))

    def at(self, x: Floats, y: Floats) -> Floats:
        """Values at these points."""
        total = np.zeros(x.shape)
        for kx, ky, phase in self.waves:
            total += np.cos(kx * x + ky * y + phase)
        return np.asarray(total * np.sqrt(2.0 / len(self.waves)))


def reflectance(
    points: Floats,
    on_ply: NDArray[np.bool_],
    target: Target,
    camera: View,
    projector: View,
    textures: tuple[Texture, Texture],
) -> Floats:
    """Share of the projector's light that (H, W, 3) points reflect towards a camera.

    The ply is woven, with fibres alternately along x and y. A fibre shines where the half-way direction between
    projector and camera is perpendicular to it. So highlights are bands, which are at different places for each camera
    and shift with the ply's slope.
    """
    x, y = points[..., 0], points[..., 1]
    _, zx, zy = mold.height_and_slopes(x, y)
    for bell in target.bells:
        near = np.hypot(x - bell.centre_mm[0], y - bell.centre_mm[1]) < bell.radii_mm[0]
        near &= on_ply
        if near.any():
            _, bx, by, rho = bell.rise_and_slopes(x[near], y[near])
            zx[near] += np.where(rho < 1, bx, 0.0)
            zy[near] += np.where(rho < 1, by, 0.0)
    stain, tilt = (texture.at(x, y) for texture in textures)
    to_light, to_camera = (_unit(view.centre - points) for view in (projector, camera))
    half = _unit(to_light + to_camera)
    normal = _unit(np.stack([-zx, -zy, np.ones_like(zx)], axis=-1))
    facing = np.maximum((normal * to_light).sum(axis=-1), 0.0)
    weave = 0.5 + 0.3 * np.sin(2 * np.pi * x / _WEAVE_MM) * np.sin(2 * np.pi * y / _WEAVE_MM)
    gloss = np.zeros_like(x)
    for share, along in (
        (weave, (np.ones_like(zx), np.zeros_like(zx), zx)),
        (1 - weave, (np.zeros_like(zx), np.ones_like(zx), zy)),
    ):
        fibre = _unit(np.stack([along[0], along[1], along[2] + 0.02 * tilt], axis=-1))
        off = (fibre * half).sum(axis=-1)
        gloss += share * np.maximum(1.0 - off * off, 0.0) ** (0.5 * _GLOSS_POWER)
    carbon = _DIFFUSE * (1 + 0.25 * stain) * facing + _GLOSS * gloss**1.5 * facing
    bare = np.where(mold.inside(x, y), 0.30, 0.18) * (1 + 0.08 * stain) * facing
    return np.asarray(np.maximum(np.where(on_ply, carbon, bare), 0.0))  # a stain has no lower bound


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.linalg.norm(v, axis=-1, keepdims=True))
