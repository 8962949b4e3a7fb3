"""Scenes of a stranger's make: a flat mold in the scanner's own XY, and bumps whose excess has a formula."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Surface = Callable[[Floats, Floats], Floats]

THICKNESS_MM = 0.3


def flat(x: Floats, y: Floats) -> Floats:
    """Height of the mold."""
    return np.zeros(np.broadcast(x, y).shape)


def bump(radius_mm: float, high_mm: float) -> Surface:
    """Height h (1 - (r/R)²)³ of a round bump about the origin."""
    return lambda x, y: high_mm * np.maximum(0.0, 1 - (x * x + y * y) / radius_mm**2) ** 3


def ridge_mm(standing: Surface, reach_mm: float) -> float:
    """Ridge of half the excess of the fibre through the origin, and 0.43 thicknesses: docs/model.md, section 7."""
    x = np.linspace(-reach_mm, reach_mm, 20001)
    step = np.hypot(np.diff(x), np.diff(standing(x, np.zeros_like(x))))
    return float(0.5 * (step.sum() - 2 * reach_mm) + 0.43 * THICKNESS_MM)


def outline(wide_mm: float, long_mm: float) -> Floats:
    """Rectangle about the origin."""
    return 0.5 * np.array([(-wide_mm, -long_mm), (wide_mm, -long_mm), (wide_mm, long_mm), (-wide_mm, long_mm)])


def cloud(surface: Surface, size_mm: tuple[float, float], pitch_mm: float, seed: int, noise_mm: float = 0.03) -> Floats:
    """Points straight below a grid, rows from high y to low."""
    half = 0.5 * np.asarray(size_mm)
    x, y = np.meshgrid(np.arange(-half[0], half[0], pitch_mm), np.arange(half[1], -half[1], -pitch_mm))
    z = surface(x, y) + noise_mm * np.random.default_rng(seed).standard_normal(x.shape)
    return np.stack([x, y, z], axis=-1)


def laid(mold: Surface, standing: Surface, ply_mm: tuple[float, float]) -> Surface:
    """Lay a ply with what stands on it over a mold."""

    def top(x: Floats, y: Floats) -> Floats:
        on = (np.abs(x) < 0.5 * ply_mm[0]) & (np.abs(y) < 0.5 * ply_mm[1])
        return np.where(on, mold(x, y) + THICKNESS_MM + standing(x, y), mold(x, y))

    return top
