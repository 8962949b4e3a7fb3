"""Shapes of air under a ply: the gap between its lower side and the mold, and how far each extends."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Box = tuple[float, float, float, float]  # lowest x, lowest y, highest x, highest y


def dome(rho: Floats, power: float) -> Floats:
    """1 at 0, and 0 from 1 on: (1 - rho²)^power, smooth at its foot for a power above 2."""
    return np.clip(1 - rho**2, 0, None) ** power


@dataclass(frozen=True)
class Bump:
    """A gap of some shape round a centre, scaled by `height_mm`; `reach_mm` is half the width and height of its box."""

    kind: str
    centre_mm: tuple[float, float]
    angle: float
    height_mm: float

    @property
    def reach_mm(self) -> tuple[float, float]:
        """Half the size of the box that contains the foot, along mold x and y."""
        u, v = self._half_box()
        c, s = abs(np.cos(self.angle)), abs(np.sin(self.angle))
        return float(c * u + s * v), float(s * u + c * v)

    @property
    def box(self) -> Box:
        """Lowest and highest x and y of the foot."""
        (x, y), (u, v) = self.centre_mm, self.reach_mm
        return x - u, y - v, x + u, y + v

    @property
    def radius_mm(self) -> float:
        """Radius of a circle round the centre that contains the foot."""
        return float(np.hypot(*self._half_box()))

    def gap(self, x: Floats, y: Floats) -> Floats:
        """Height of the air, mm."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        x, y = x - self.centre_mm[0], y - self.centre_mm[1]
        return self.height_mm * self._unit(c * x + s * y, c * y - s * x)

    def scaled(self, height_mm: float) -> Bump:
        """Return the same shape with another height."""
        return replace(self, height_mm=height_mm)

    def _half_box(self) -> tuple[float, float]:
        raise NotImplementedError

    def _unit(self, u: Floats, v: Floats) -> Floats:
        """Gap divided by the height, at positions along the bump's own axes."""
        raise NotImplementedError


@dataclass(frozen=True)
class Gaussians(Bump):
    """A sum of Gaussians, cut off softly at a hundredth of their height: parts (u, v, sigma_u, sigma_v, weight)."""

    parts: tuple[tuple[float, float, float, float, float], ...]

    FLOOR = 0.02

    def _half_box(self) -> tuple[float, float]:
        far = np.sqrt(2 * np.log(sum(p[4] for p in self.parts) / self.FLOOR))
        return (
            max(abs(p[0]) + far * p[2] for p in self.parts),
            max(abs(p[1]) + far * p[3] for p in self.parts),
        )

    def _unit(self, u: Floats, v: Floats) -> Floats:
        total = np.zeros(np.shape(u))
        for u0, v0, su, sv, weight in self.parts:
            total += weight * np.exp(-0.5 * (((u - u0) / su) ** 2 + ((v - v0) / sv) ** 2))
        above = np.clip(total - self.FLOOR, 0, None)
        return above**2 / (above + 4 * self.FLOOR)  # rises from the mold without a kink


@dataclass(frozen=True)
class Lobes(Bump):
    """A bump with a star-shaped foot: radius_mm (1 + sum of waves (order, amplitude, phase) round the centre)."""

    mean_radius_mm: float
    waves: tuple[tuple[int, float, float], ...]
    power: float

    def _half_box(self) -> tuple[float, float]:
        far = self.mean_radius_mm * (1 + sum(abs(w[1]) for w in self.waves))
        return far, far

    def _unit(self, u: Floats, v: Floats) -> Floats:
        angle = np.arctan2(v, u)
        foot = np.ones(np.shape(u))
        for order, amplitude, phase in self.waves:
            foot += amplitude * np.cos(order * angle + phase)
        # Near the centre the direction is undefined, but the foot's radius hardly matters there, because rho is near 0.
        return dome(np.hypot(u, v) / (self.mean_radius_mm * foot), self.power)


@dataclass(frozen=True)
class Wrinkle(Bump):
    """A straight ridge along u, which has no end if `half_length_mm` is infinite."""

    half_width_mm: float
    half_length_mm: float
    power: float

    def _half_box(self) -> tuple[float, float]:
        return min(self.half_length_mm, 3000.0), self.half_width_mm

    def _unit(self, u: Floats, v: Floats) -> Floats:
        across = dome(v / self.half_width_mm, self.power)
        if np.isinf(self.half_length_mm):
            return across
        fade = np.clip((self.half_length_mm - np.abs(u)) / min(3 * self.half_width_mm, self.half_length_mm), 0, 1)
        faded: Floats = across * fade**3 * (10 - 15 * fade + 6 * fade**2)
        return faded


@dataclass(frozen=True)
class Arc(Bump):
    """A ridge along part of a circle: a crescent or, if `half_angle` is pi or more, a ring."""

    circle_mm: float
    half_width_mm: float
    half_angle: float
    swell: float
    power: float

    def _half_box(self) -> tuple[float, float]:
        far = self.circle_mm + self.half_width_mm
        return far, far

    def _unit(self, u: Floats, v: Floats) -> Floats:
        angle = np.arctan2(v, u)
        across = dome((np.hypot(u, v) - self.circle_mm) / self.half_width_mm, self.power)
        if self.half_angle >= np.pi:
            swollen: Floats = across * (1 + self.swell * np.cos(2 * angle)) / (1 + self.swell)
            return swollen
        return across * dome(angle / self.half_angle, self.power)


@dataclass(frozen=True)
class Border(Bump):
    """A loose border, which rises from `width_mm` inside towards the ply's edge (v = 0, inside at v > 0) and fades."""

    width_mm: float
    half_length_mm: float

    def _half_box(self) -> tuple[float, float]:
        return self.half_length_mm, self.width_mm

    def _unit(self, u: Floats, v: Floats) -> Floats:
        rise = np.clip(1 - np.clip(v, 0, None) / self.width_mm, 0, 1)
        return rise**2 * dome(u / self.half_length_mm, 3)


def steepness(bump: Bump) -> float:
    """Largest slope of a bump, from a fine grid along its axes."""
    half = bump._half_box()
    u, v = (np.linspace(-min(h, 400.0), min(h, 400.0), 241) for h in half)
    values = bump.height_mm * bump._unit(*np.meshgrid(u, v, indexing="ij"))
    du, dv = np.gradient(values, u, v)
    return float(np.hypot(du, dv).max()) * 1.1
