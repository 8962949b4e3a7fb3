"""Faults of a scanner: noise of several kinds, highlights, flying pixels, and holes of a given size in mm."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Noise:
    """Standard deviations and amplitudes along the ray, mm; 0 switches a kind off."""

    white_mm: float = 0.03
    correlated_mm: float = 0.0
    correlation_px: float = 8.0
    range_power: float = 0.0
    """Noise grows with this power of depth over the median depth."""
    quantum_mm: float = 0.0
    """Depths are rounded to whole multiples of this."""
    band_mm: float = 0.0
    band_px: float = 20.0
    highlights: int = 0
    flying_share: float = 0.0


KINDS = ("correlated", "range", "quantised", "banding", "highlights", "flying")


def random_noise(rng: np.random.Generator, kinds: tuple[str, ...] | None = None) -> Noise:
    """Return white noise and the given other kinds; if None, each is included with a probability of a third."""
    draw = {kind: bool(rng.random() < 1 / 3) for kind in KINDS}
    if kinds is not None:
        draw = {kind: kind in kinds for kind in KINDS}
    values: dict[str, Any] = {
        "white_mm": rng.uniform(0.01, 0.06),
        "correlated_mm": rng.uniform(0.01, 0.05) * draw["correlated"],
        "correlation_px": rng.uniform(2, 25),
        "range_power": 2.0 * draw["range"],
        "quantum_mm": rng.uniform(0.02, 0.12) * draw["quantised"],
        "band_mm": rng.uniform(0.01, 0.06) * draw["banding"],
        "band_px": rng.uniform(6, 50),
        "highlights": int(rng.integers(1, 4)) * draw["highlights"],
        "flying_share": float(np.exp(rng.uniform(np.log(1e-4), np.log(5e-3)))) * draw["flying"],
    }
    return Noise(**{f.name: values[f.name] for f in fields(Noise)})


def smooth_field(rng: np.random.Generator, shape: tuple[int, int], reach_px: float) -> Floats:
    """Make a random field of unit variance, correlated over about `reach_px`."""
    small = (int(shape[0] / reach_px) + 4, int(shape[1] / reach_px) + 4)
    field = cv2.resize(rng.standard_normal(small), (shape[1], shape[0]), interpolation=cv2.INTER_CUBIC)
    return np.asarray(field / field.std())


def with_noise(rng: np.random.Generator, depth: Floats, noise: Noise) -> tuple[Floats, Bools]:
    """Depths with noise, and which pixels fly or are in a highlight."""
    shape = (depth.shape[0], depth.shape[1])
    error = noise.white_mm * rng.standard_normal(shape)
    if noise.correlated_mm:
        error += noise.correlated_mm * smooth_field(rng, shape, noise.correlation_px)
    if noise.range_power:
        error *= (np.nan_to_num(depth, nan=np.nanmedian(depth)) / np.nanmedian(depth)) ** noise.range_power
    if noise.band_mm:  # phase error of the fringes, which runs over the image and bends with the depth
        phase = np.arange(shape[1])[None, :] / noise.band_px + np.nan_to_num(depth) / 40
        error += noise.band_mm * np.sin(2 * np.pi * phase)
    result, bad = depth + error, np.zeros(shape, dtype=bool)
    for _ in range(noise.highlights):
        v, u = rng.uniform(0.1, 0.9, 2) * shape
        spot = ((np.arange(shape[0])[:, None] - v) / rng.uniform(4, 14)) ** 2 + (
            (np.arange(shape[1])[None, :] - u) / rng.uniform(4, 14)
        ) ** 2 < 1
        bad |= spot
        result[spot] += rng.normal(0, 2.0, int(spot.sum()))
        result[spot & (rng.random(shape) < 0.7)] = np.nan
    if noise.flying_share:
        flies = rng.random(shape) < noise.flying_share
        bad |= flies
        far = np.exp(rng.uniform(0, np.log(60), shape)) * rng.choice([-1, 1], shape)
        result = np.where(flies, result + far, result)
        result = _between_edges(rng, depth, result, bad)
    if noise.quantum_mm:
        result = np.round(result / noise.quantum_mm) * noise.quantum_mm
    return result, bad


def _between_edges(rng: np.random.Generator, depth: Floats, result: Floats, bad: Bools) -> Floats:
    """Move pixels that see two depths at a jump to a depth in between, in three cases of ten."""
    beside = np.roll(depth, 1, axis=1)
    with np.errstate(invalid="ignore"):
        jump = np.abs(beside - depth) > 3.0
    mixed = jump & (rng.random(depth.shape) < 0.3)
    bad |= mixed
    share = rng.random(depth.shape)
    return np.where(mixed, share * depth + (1 - share) * beside, result)


@dataclass(frozen=True)
class Hole:
    """An area where nothing was seen: an ellipse or a bar in mold x and y."""

    centre_mm: tuple[float, float]
    half_mm: tuple[float, float]
    angle: float
    bar: bool

    def covers(self, x: Floats, y: Floats) -> Bools:
        """Whether each position lies in the hole; false for NaN."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        x, y = x - self.centre_mm[0], y - self.centre_mm[1]
        u, v = (c * x + s * y) / self.half_mm[0], (c * y - s * x) / self.half_mm[1]
        with np.errstate(invalid="ignore"):
            covered: Bools = (np.maximum(np.abs(u), np.abs(v)) < 1) if self.bar else (u * u + v * v < 1)
        return covered


def random_hole(rng: np.random.Generator, centre_mm: tuple[float, float], size_mm: float) -> Hole:
    """Make a hole whose larger width is `size_mm`."""
    half = 0.5 * size_mm
    return Hole(centre_mm, (half, half * rng.uniform(0.15, 1)), rng.uniform(0, np.pi), bool(rng.random() < 0.4))
