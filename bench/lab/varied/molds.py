"""Molds as smooth height functions, including a part that ends at a cliff above a table."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.varied.polygons import inside

Floats = NDArray[np.float64]
Term = Callable[[Floats, Floats], Floats]


@dataclass(frozen=True)
class Mold:
    """A sum of smooth terms; if the part has an outline, a flat table lies outside it."""

    kind: str
    terms: tuple[Term, ...]
    part_outline: Floats | None = None
    table_mm: float = 0.0

    def smooth_height(self, x: Floats, y: Floats) -> Floats:
        """Height of the part's surface, continued smoothly beyond its outline, mm."""
        total = self.terms[0](x, y)
        for term in self.terms[1:]:
            total = total + term(x, y)
        return total

    def height(self, x: Floats, y: Floats) -> Floats:
        """Height that the scanner sees without a ply, mm."""
        if self.part_outline is None:
            return self.smooth_height(x, y)
        return np.where(inside(self.part_outline, x, y), self.smooth_height(x, y), self.table_mm)


def _turned(angle: float) -> tuple[float, float]:
    return float(np.cos(angle)), float(np.sin(angle))


@dataclass(frozen=True)
class Quadric:
    """Two principal curvatures, 1/mm: of opposite sign for a saddle, both negative for a dome."""

    angle: float
    curvatures: tuple[float, float]

    def __call__(self, x: Floats, y: Floats) -> Floats:
        """Height, mm."""
        c, s = _turned(self.angle)
        return 0.5 * self.curvatures[0] * (c * x + s * y) ** 2 + 0.5 * self.curvatures[1] * (c * y - s * x) ** 2


@dataclass(frozen=True)
class Flank:
    """Flat up to `begin_mm` along the direction, then falling with `slope`; the bend is a hyperbola."""

    angle: float
    begin_mm: float
    slope: float
    bend_mm: float

    def __call__(self, x: Floats, y: Floats) -> Floats:
        """Height, mm."""
        c, s = _turned(self.angle)
        along = c * x + s * y - self.begin_mm
        return -0.5 * self.slope * (along + np.sqrt(along**2 + self.bend_mm**2))


@dataclass(frozen=True)
class Step:
    """A rise of `rise_mm` over about twice `width_mm`; its steepest slope is rise / (2 width)."""

    angle: float
    place_mm: float
    rise_mm: float
    width_mm: float

    def __call__(self, x: Floats, y: Floats) -> Floats:
        """Height, mm."""
        c, s = _turned(self.angle)
        along = (c * x + s * y - self.place_mm) / self.width_mm
        return 0.5 * self.rise_mm * along / np.sqrt(1 + along**2)


@dataclass(frozen=True)
class Ribs:
    """Straight ribs (positive) and grooves (negative), each a smooth profile of finite width."""

    angle: float
    places_mm: tuple[float, ...]
    half_widths_mm: tuple[float, ...]
    heights_mm: tuple[float, ...]

    def __call__(self, x: Floats, y: Floats) -> Floats:
        """Height, mm."""
        c, s = _turned(self.angle)
        along = c * x + s * y
        total = np.zeros_like(along)
        for place, half, height in zip(self.places_mm, self.half_widths_mm, self.heights_mm, strict=True):
            rise = np.clip(1 - ((along - place) / half) ** 2, 0, None)
            total += height * (rise * rise * rise)  # `rise**3` takes ten times as long
        return total


@dataclass(frozen=True)
class Waves:
    """Long waves in two directions."""

    angle: float
    lengths_mm: tuple[float, float]
    phases: tuple[float, float]
    amplitude_mm: float

    def __call__(self, x: Floats, y: Floats) -> Floats:
        """Height, mm."""
        c, s = _turned(self.angle)
        u, v = 2 * np.pi / self.lengths_mm[0], 2 * np.pi / self.lengths_mm[1]
        return (
            self.amplitude_mm
            * np.sin(u * (c * x + s * y) + self.phases[0])
            * np.cos(v * (c * y - s * x) + self.phases[1])
        )


def _quadric(rng: np.random.Generator, signs: tuple[int, int]) -> Quadric:
    radii = np.exp(rng.uniform(np.log(900), np.log(4000), 2))
    return Quadric(rng.uniform(0, np.pi), (signs[0] / radii[0], signs[1] / radii[1]))


def _saddle(rng: np.random.Generator) -> tuple[Term, ...]:
    return (_quadric(rng, (1, -1)),)


def _dome(rng: np.random.Generator) -> tuple[Term, ...]:
    return (_quadric(rng, (-1, -1)),)


def _flanks(rng: np.random.Generator) -> tuple[Term, ...]:
    angle, slope = rng.uniform(0, 2 * np.pi), np.tan(np.deg2rad(rng.uniform(20, 45)))
    first = Flank(angle, rng.uniform(60, 220), slope, rng.uniform(30, 100))
    if rng.random() < 0.5:
        return (first,)
    return (first, Flank(angle + np.pi, rng.uniform(60, 220), rng.uniform(0.3, 1) * slope, rng.uniform(30, 100)))


def _step(rng: np.random.Generator) -> tuple[Term, ...]:
    rise, steepest = rng.uniform(8, 35), np.tan(np.deg2rad(rng.uniform(45, 62)))
    step = Step(rng.uniform(0, 2 * np.pi), rng.uniform(-150, 150), rise, rise / (2 * steepest))
    return (_quadric(rng, (-1, -1)), step)


def _ribs(rng: np.random.Generator) -> tuple[Term, ...]:
    count = int(rng.integers(1, 5))
    places = np.cumsum(rng.uniform(90, 200, count)) - 250
    halves = rng.uniform(10, 40, count)
    heights = rng.choice([-1, 1], count) * halves * rng.uniform(0.1, 0.45, count)
    ribs = Ribs(rng.uniform(0, np.pi), tuple(places.tolist()), tuple(halves.tolist()), tuple(heights.tolist()))
    return (_quadric(rng, (-1, -1)), ribs)


def _waves(rng: np.random.Generator) -> tuple[Term, ...]:
    lengths = rng.uniform(350, 900, 2)
    phases = rng.uniform(0, 2 * np.pi, 2)
    return (
        Waves(
            rng.uniform(0, np.pi),
            (float(lengths[0]), float(lengths[1])),
            (float(phases[0]), float(phases[1])),
            float(rng.uniform(0.02, 0.05) * lengths.min()),
        ),
    )


def _cliff(rng: np.random.Generator) -> tuple[Term, ...]:
    return _waves(rng) if rng.random() < 0.5 else _saddle(rng)


KINDS: dict[str, Callable[[np.random.Generator], tuple[Term, ...]]] = {
    "saddle": _saddle,
    "dome": _dome,
    "flanks": _flanks,
    "step": _step,
    "ribs": _ribs,
    "waves": _waves,
    "cliff": _cliff,
}
"""Functions that make the terms of each kind; "cliff" is a part smaller than the image, above a table."""


def make_mold(rng: np.random.Generator, kind: str, ply_outline: Floats) -> Mold:
    """Make a mold of a kind; a cliff runs 5 to 40 mm outside the ply's outline."""
    terms = KINDS[kind](rng)
    if kind != "cliff":
        return Mold(kind, terms)
    centre = ply_outline.mean(axis=0)
    away = ply_outline - centre
    radius = np.linalg.norm(away, axis=1, keepdims=True)
    part = centre + away * (1 + rng.uniform(8, 50) / radius)
    smooth = Mold(kind, terms)
    lowest = float(smooth.smooth_height(part[:, 0], part[:, 1]).min())
    return Mold(kind, terms, part, lowest - float(rng.uniform(25, 140)))
