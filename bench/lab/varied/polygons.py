"""Plane polygons: inside or outside, distance from the edge, and random outlines of plies."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
_FEW = 30  # corners up to which it is faster not to sort the points


def inside(polygon: Floats, x: Floats, y: Floats) -> NDArray[np.bool_]:
    """Even-odd rule, for arrays of any shape."""
    result = np.zeros(np.shape(x), dtype=bool)
    if result.size == 0:
        return result
    if len(polygon) > _FEW:
        return _inside_of_many(polygon, np.ravel(x), np.ravel(y)).reshape(result.shape)
    low, left = (np.fmin.reduce(v, axis=None) for v in (y, x))  # NaN lies outside
    high = np.fmax.reduce(y, axis=None)
    for (x0, y0), (x1, y1) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        met = min(y0, y1) <= high and max(y0, y1) > low and max(x0, x1) >= left  # by a ray to the right
        if met and y0 != y1:
            result ^= ((y0 > y) != (y1 > y)) & (x < x0 + (y - y0) * ((x1 - x0) / (y1 - y0)))
    return result


def _inside_of_many(polygon: Floats, x: Floats, y: Floats) -> NDArray[np.bool_]:
    """Return the same for many corners: of points in the order of their y a side meets one stretch."""
    order = np.argsort(y)
    x, y, odd = x[order], y[order], np.zeros(len(y), dtype=bool)
    for (x0, y0), (x1, y1) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        met = slice(*np.searchsorted(y, [min(y0, y1), max(y0, y1)]))
        if y0 != y1:
            odd[met] ^= x[met] < x0 + (y[met] - y0) * ((x1 - x0) / (y1 - y0))
    result = np.empty_like(odd)
    result[order] = odd
    return result


def distance(polygon: Floats, x: Floats, y: Floats) -> Floats:
    """Signed distance to the outline, mm: positive inside."""
    nearest = np.full(np.shape(x), np.inf)
    for (x0, y0), (x1, y1) in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        length2 = max((x1 - x0) ** 2 + (y1 - y0) ** 2, 1e-300)
        along = np.clip(((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / length2, 0, 1)
        nearest = np.minimum(nearest, (x - x0 - along * (x1 - x0)) ** 2 + (y - y0 - along * (y1 - y0)) ** 2)
    signed: Floats = np.where(inside(polygon, x, y), 1.0, -1.0) * np.sqrt(nearest)
    return signed


def random_ply(rng: np.random.Generator) -> Floats:
    """Corners of a ply, counter-clockwise: a rotated rectangle, trapezoid, hexagon or L."""
    width, depth = rng.uniform(480, 950), rng.uniform(360, 700)
    a, b = width / 2, depth / 2
    kind = rng.choice(["rectangle", "trapezoid", "cut", "ell"])
    if kind == "rectangle":
        corners = [(-a, -b), (a, -b), (a, b), (-a, b)]
    elif kind == "trapezoid":
        left, right = rng.uniform(0.55, 1, 2)
        corners = [(-a, -b), (a, -b), (right * a, b), (-left * a, b)]
    elif kind == "cut":
        c = rng.uniform(0.1, 0.35) * depth
        corners = [(-a + c, -b), (a, -b), (a, b - c), (a - c, b), (-a, b), (-a, -b + c)]
    else:
        u, v = rng.uniform(0.1, 0.5) * a, rng.uniform(0.1, 0.5) * b
        corners = [(-a, -b), (a, -b), (a, v), (u, v), (u, b), (-a, b)]
    turn = rng.uniform(0, 2 * np.pi)
    c, s = np.cos(turn), np.sin(turn)
    turned: Floats = np.array(corners) @ np.array([[c, s], [-s, c]]) + rng.uniform(-60, 60, 2)
    return turned
