"""The ply: its gap off the mold, its two sides, and the excess of its fibres."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.third.molds import Height, normals

__all__ = ["Bell", "Ply", "Truth", "inside", "truth"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
LAID_MM = 0.02  # a ply that is lower lies on the mold
DRAWN_MM, HELD_MM = 17.0, 25.0  # of laid ply: what one fold draws from at least, what holds a fibre for certain
_GRID_MM = 0.5  # between the lines, and between the points of a line


@dataclass(frozen=True)
class Bell:
    """A pocket: middle, half lengths of its axes, direction of the first, height, and the exponent of its flanks."""

    x: float
    y: float
    a: float
    b: float
    turn: float
    high: float
    power: float

    def gap(self, x: Floats, y: Floats) -> Floats:
        """Return the distance from the mold, along the mold's normal at these places."""
        c, s = np.cos(self.turn), np.sin(self.turn)
        u, v = (c * (x - self.x) + s * (y - self.y)) / self.a, (c * (y - self.y) - s * (x - self.x)) / self.b
        return np.asarray(self.high * np.maximum(0.0, 1 - (u * u + v * v) ** self.power) ** 2)


@dataclass(frozen=True)
class Ply:
    """A ply of a thickness, within an outline (M, 2), off a mold by the gaps of its bells."""

    mold: Height
    thickness_mm: float
    outline: Floats
    bells: tuple[Bell, ...]

    def lower(self, a: Floats, b: Floats) -> Floats:
        """Return (..., 3) points of the lower side off the mold's points over (a, b)."""
        gap = np.sum([bell.gap(a, b) for bell in self.bells], axis=0) if self.bells else np.zeros_like(a)
        return np.stack([a, b, self.mold(a, b)], axis=-1) + gap[..., None] * normals(self.mold, a, b)

    def upper(self, a: Floats, b: Floats) -> Floats:
        """Return (..., 3) points of the upper side, one thickness off the lower side along that side's normal."""
        h = 1e-2
        along_a = self.lower(a + h, b) - self.lower(a - h, b)
        along_b = self.lower(a, b + h) - self.lower(a, b - h)
        normal = np.cross(along_a, along_b)
        normal /= np.linalg.norm(normal, axis=-1, keepdims=True)
        return np.asarray(self.lower(a, b) + self.thickness_mm * normal)

    def lower_height(self, x: Floats, y: Floats) -> Floats:
        """Return the height of the lower side at these XY."""
        a, b = x.copy(), y.copy()
        for _ in range(25):
            at = self.lower(a, b)
            a, b = a + x - at[..., 0], b + y - at[..., 1]
        return np.asarray(self.lower(a, b)[..., 2])


@dataclass(frozen=True)
class Truth:
    """The highest ridges that the excess makes, mm: of fibres held at both ends, and of all."""

    held_mm: float
    any_mm: float


def inside(outline: Floats, xy: Floats) -> Bools:
    """Return which of the (N, 2) places lie within an outline, by the number of its sides to the right of each."""
    x, y = xy.T
    out = np.zeros(len(xy), dtype=bool)
    for (x0, y0), (x1, y1) in zip(outline, np.roll(outline, -1, axis=0), strict=True):
        if y0 != y1:
            out ^= ((y0 > y) != (y1 > y)) & (x < x0 + (x1 - x0) * (y - y0) / (y1 - y0))
    return out


def truth(ply: Ply, fibre_deg: float, grid_mm: float = _GRID_MM) -> Truth:
    """Return the ridges of the fibres at this angle and across it."""
    if not ply.bells:
        return Truth(0.0, 0.0)
    c, s = np.cos(np.radians(fibre_deg)), np.sin(np.radians(fibre_deg))
    turn = np.array([[c, s], [-s, c]])
    middles = np.array([(bell.x, bell.y) for bell in ply.bells]) @ turn.T
    reach = np.array([max(bell.a, bell.b) + bell.high + 3 for bell in ply.bells])[:, None]
    low, high = (middles - reach).min(axis=0), (middles + reach).max(axis=0)
    u, v = np.meshgrid(*(np.arange(a, b, grid_mm) for a, b in zip(low, high, strict=True)))
    x, y = c * u - s * v, s * u + c * v
    on = inside(ply.outline, np.stack([x, y], axis=-1).reshape(-1, 2)).reshape(x.shape)
    z, mold = ply.lower_height(x, y), ply.mold(x, y)
    off = (z - mold > LAID_MM) & on
    best = np.zeros(2)
    for way, family in (((c, s), lambda table: table), ((-s, c), np.transpose)):
        rows = [family(table) for table in (z, mold, off, on, x, y)]
        for k in np.flatnonzero(rows[2].any(axis=1)):
            best = np.maximum(best, _of_line([table[k] for table in rows], np.array(way), grid_mm, ply.outline))
    ridges = np.where(best > 0, best / 2 + (2 - np.pi / 2) * ply.thickness_mm, 0.0)
    return Truth(float(ridges[0]), float(ridges[1]))


def _of_line(line: list[Floats], way: Floats, grid_mm: float, outline: Floats) -> Floats:
    """Return the largest excess of a line's runs: of those held at both ends, and of all."""
    z, mold, off, on, x, y = line
    excess = np.hypot(grid_mm, np.diff(z)) - np.hypot(grid_mm, np.diff(mold))
    marked = np.flatnonzero(off.astype(bool))
    breaks = np.flatnonzero(np.diff(marked) * grid_mm > DRAWN_MM)
    best = np.zeros(2)
    for run in np.split(marked, breaks + 1):
        first, last = max(run[0] - 1, 0), min(run[-1] + 1, len(z) - 1)
        of = float((excess * (on[1:].astype(bool) & on[:-1].astype(bool)))[first:last].sum())
        steps = np.arange(0, HELD_MM, 1.0)[:, None] * way
        ends = np.concatenate([np.array([x[first], y[first]]) - steps, np.array([x[last], y[last]]) + steps])
        held = bool(inside(outline, ends).all())
        best = np.maximum(best, [of if held else 0.0, of])
    return best
