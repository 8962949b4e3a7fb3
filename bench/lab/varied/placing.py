"""Random pockets: their shapes, their heights for a wanted excess length, and their places on the ply."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lab.varied.bumps import Arc, Border, Bump, Gaussians, Lobes, Wrinkle
from lab.varied.polygons import distance

Floats = NDArray[np.float64]
Group = list[Bump]  # bumps that belong together, round the centre of the first


def _size(rng: np.random.Generator) -> float:
    """Half width of a foot, mm; some 22 mm are needed to exceed all tolerances with little excess."""
    return float(np.exp(rng.uniform(np.log(24), np.log(100))))


def _turn(rng: np.random.Generator) -> float:
    return float(rng.uniform(0, 2 * np.pi))


def _gaussians(rng: np.random.Generator) -> Group:
    size = _size(rng) / 3
    parts = [(0.0, 0.0, size, size * rng.uniform(0.6, 1.4), 1.0)]
    for _ in range(int(rng.integers(0, 4))):
        u, v = rng.normal(0, 1.2 * size, 2)
        su, sv = size * rng.uniform(0.5, 1.3, 2)
        parts.append((float(u), float(v), float(su), float(sv), float(rng.uniform(0.3, 1))))
    return [Gaussians("gaussians", (0.0, 0.0), _turn(rng), 1.0, tuple(parts))]


def _wrinkle(rng: np.random.Generator) -> Group:
    half = float(rng.uniform(14, 36))
    return [Wrinkle("wrinkle", (0.0, 0.0), _turn(rng), 1.0, half, half * rng.uniform(3, 7), float(rng.uniform(2.2, 4)))]


def _lobes(rng: np.random.Generator) -> Group:
    waves = tuple((k, float(rng.uniform(0, 0.35) / k**0.5), _turn(rng)) for k in range(2, int(rng.integers(4, 7))))
    return [Lobes("lobes", (0.0, 0.0), _turn(rng), 1.0, _size(rng), waves, float(rng.uniform(2.2, 3.5)))]


def _crescent(rng: np.random.Generator) -> Group:
    half = float(rng.uniform(20, 40))
    return [
        Arc(
            "crescent",
            (0.0, 0.0),
            _turn(rng),
            1.0,
            half * float(rng.uniform(1.3, 2.5)),
            half,
            float(np.deg2rad(rng.uniform(70, 150))),
            0.0,
            float(rng.uniform(2.2, 3.5)),
        )
    ]


def _ring(rng: np.random.Generator) -> Group:
    half = float(rng.uniform(18, 32))
    circle, swell = half * float(rng.uniform(1.2, 2.4)), float(rng.uniform(0, 0.3))
    return [Arc("ring", (0.0, 0.0), _turn(rng), 1.0, circle, half, float(np.pi), swell, float(rng.uniform(2.2, 3.5)))]


def _superposed(rng: np.random.Generator) -> Group:
    size = max(_size(rng), 45.0)
    broad = Lobes("superposed", (0.0, 0.0), 0.0, 1.0, size, (), float(rng.uniform(2.2, 3.5)))
    half = size * float(rng.uniform(0.2, 0.4))
    u, v = rng.uniform(-0.3, 0.3, 2) * size
    narrow = Wrinkle("superposed", (float(u), float(v)), _turn(rng), float(rng.uniform(0.3, 0.8)), half, 3 * half, 3.0)
    return [broad, narrow]


def _merging(rng: np.random.Generator) -> Group:
    size, turn = min(_size(rng), 70.0), _turn(rng)
    apart = size * float(rng.uniform(0.95, 1.5))
    one = Lobes("merging", (0.0, 0.0), 0.0, 1.0, size, (), 3.0)
    place = (apart * float(np.cos(turn)), apart * float(np.sin(turn)))
    return [one, replace(one, centre_mm=place, mean_radius_mm=size * float(rng.uniform(0.7, 1)))]


def _small(rng: np.random.Generator) -> Group:
    """Draw a bump below AreaTol (200 mm²) at the cut, but steep."""
    return [Lobes("small", (0.0, 0.0), 0.0, 1.0, float(rng.uniform(8, 14)), (), 3.0)]


def _thin(rng: np.random.Generator) -> Group:
    """Draw a fold that was there when the ply was laid, 4 to 12 mm wide."""
    half = float(rng.uniform(2, 6))
    return [Wrinkle("thin", (0.0, 0.0), _turn(rng), 1.0, half, float(rng.uniform(30, 100)), 2.5)]


def _edge_to_edge(rng: np.random.Generator) -> Group:
    return [Wrinkle("edge to edge", (0.0, 0.0), _turn(rng), 1.0, float(rng.uniform(20, 45)), float("inf"), 3.0)]


SHAPES: dict[str, Callable[[np.random.Generator], Group]] = {
    "gaussians": _gaussians,
    "wrinkle": _wrinkle,
    "lobes": _lobes,
    "crescent": _crescent,
    "ring": _ring,
    "superposed": _superposed,
    "merging": _merging,
    "edge": _lobes,
    "corner": _gaussians,
    "edge to edge": _edge_to_edge,
    "small": _small,
    "thin": _thin,
}
"""Functions that make each kind of pocket; "edge" and "corner" are cut by the ply's outline."""

USUAL = ("gaussians", "wrinkle", "lobes", "crescent", "ring", "superposed", "merging", "edge", "corner")
"""Kinds from which pockets are drawn unless a special kind is requested."""


def with_excess(group: Group, wanted_mm: float, angles_deg: tuple[float, float], low_mm: float) -> Group:
    """Scale a group to a largest excess of about `wanted_mm` on a flat mold, and a height of `low_mm` to 16 mm."""
    reach = max(np.hypot(*b.centre_mm) + min(b.radius_mm, 300.0) for b in group)
    lines, step = np.linspace(-reach, reach, 61), 2 * reach / 600
    along = np.arange(-reach, reach, step)
    base = []
    for angle in angles_deg:
        c, s = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
        x, y = c * along[None, :] - s * lines[:, None], s * along[None, :] + c * lines[:, None]
        base.append(np.asarray(sum(b.gap(x, y) for b in group)))
    top = max(float(g.max()) for g in base)
    factor = 5.0 / top
    for _ in range(4):
        now = max(float((np.hypot(step, np.diff(factor * g, axis=1)) - step).sum(axis=1).max()) for g in base)
        factor *= np.sqrt(wanted_mm / max(now, 1e-9))
    factor = float(np.clip(factor, low_mm / top, 16.0 / top))
    return [b.scaled(factor * b.height_mm) for b in group]


def place(rng: np.random.Generator, kind: str, group: Group, outline: Floats, taken: list[Bump]) -> Group | None:
    """Move a group to a free place of its kind; return None if none was found."""
    reach = max(np.hypot(*b.centre_mm) + b.radius_mm for b in group)
    low, high = outline.min(axis=0), outline.max(axis=0)
    for _ in range(150):
        x, y = rng.uniform(low, high)
        if kind == "corner":
            x, y = outline[rng.integers(len(outline))] + rng.uniform(-0.35, 0.35, 2) * min(reach, 60)
        elif kind == "edge to edge":
            x, y = outline.mean(axis=0) + rng.uniform(-80, 80, 2)
        if kind == "edge":
            k = int(rng.integers(len(outline)))
            a, b = outline[k], outline[(k + 1) % len(outline)]
            x, y = a + (b - a) * rng.uniform(0.15, 0.85) + rng.uniform(-0.4, 0.4, 2) * reach
        inner = kind not in ("corner", "edge", "edge to edge")
        if inner and float(distance(outline, np.array(x), np.array(y))) < reach + rng.choice([5.0, 45.0]):
            continue
        moved = [replace(b, centre_mm=(b.centre_mm[0] + float(x), b.centre_mm[1] + float(y))) for b in group]
        if all(_apart(m, t) for m in moved for t in taken):
            return moved
    return None


def _apart(a: Bump, b: Bump) -> bool:
    """Whether two feet are certainly at least 6 mm apart."""
    for one, other in ((a, b), (b, a)):
        if isinstance(one, Wrinkle) and np.isinf(one.half_length_mm):
            c, s = np.cos(one.angle), np.sin(one.angle)
            x, y = np.subtract(other.centre_mm, one.centre_mm)
            return bool(abs(c * y - s * x) > one.half_width_mm + other.radius_mm + 6)
    return bool(np.hypot(*np.subtract(a.centre_mm, b.centre_mm)) > a.radius_mm + b.radius_mm + 6)


def random_border(rng: np.random.Generator, outline: Floats) -> Border:
    """Draw a loose border of the ply: 0.3 to 3 mm high, 60 to 260 mm wide."""
    k = int(rng.integers(len(outline)))
    a, b = outline[k], outline[(k + 1) % len(outline)]
    along = b - a
    middle = a + along * rng.uniform(0.2, 0.8)
    return Border(
        "border",
        (float(middle[0]), float(middle[1])),
        float(np.arctan2(along[1], along[0])),
        float(np.exp(rng.uniform(np.log(0.3), np.log(3)))),
        float(rng.uniform(60, 260)),
        float(rng.uniform(80, 400)),
    )
