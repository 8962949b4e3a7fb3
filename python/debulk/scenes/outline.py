"""The ply's outline, a slightly irregular rounded rectangle, and exact areas of ellipses clipped by it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from debulk import pocket
from debulk.arrays import Floats

HALF_X_MM = 565.0
HALF_Y_MM = 415.0
CORNER_MM = 60.0
WAVE_MM = 3.0  # the outline stays within this distance of the rounded rectangle
_STEP_MM = 4.0


def rounded_rectangle_distance(x: Floats, y: Floats) -> Floats:
    """Signed distance to the regular rounded rectangle, negative inside, mm."""
    qx = np.abs(x) - (HALF_X_MM - CORNER_MM)
    qy = np.abs(y) - (HALF_Y_MM - CORNER_MM)
    outside = np.hypot(np.maximum(qx, 0.0), np.maximum(qy, 0.0))
    return np.asarray(outside + np.minimum(np.maximum(qx, qy), 0.0) - CORNER_MM)


def irregular_outline(rng: np.random.Generator) -> Floats:
    """(M, 2) outline in mold XY, counter-clockwise, with the last point joined to the first, mm."""
    sx, sy, arc = 2 * (HALF_X_MM - CORNER_MM), 2 * (HALF_Y_MM - CORNER_MM), 0.5 * np.pi * CORNER_MM
    lengths = np.array([sy, arc, sx, arc, sy, arc, sx, arc])
    ends = np.cumsum(lengths)
    total = float(ends[-1])
    s = np.arange(0.0, total, total / round(total / _STEP_MM))
    piece = np.minimum(np.searchsorted(ends, s, side="right"), 7)
    along = s - (ends - lengths)[piece]
    # Side or corner number q starts at the right; each next one is turned to the left by a quarter.
    q, bent = piece // 2, piece % 2 == 1
    turn = 0.5 * np.pi * q + np.where(bent, along / CORNER_MM, 0.0)
    corner_x = np.array([1, -1, -1, 1])[q] * sx / 2
    corner_y = np.array([1, 1, -1, -1])[q] * sy / 2
    back = np.where(bent, 0.0, lengths[piece] - along)  # remaining distance along the side to the start of the corner
    normal = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    tangent = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
    wave = np.zeros_like(s)
    weights = rng.uniform(0.3, 1.0, 6)
    for k, weight in zip(range(2, 8), weights / weights.sum(), strict=True):
        wave += weight * np.sin(2 * np.pi * (k * s / total + rng.uniform()))
    offset = (CORNER_MM + WAVE_MM * wave)[:, None]
    return np.asarray(np.stack([corner_x, corner_y], axis=1) + offset * normal - back[:, None] * tangent)


class StarPolygon:
    """A polygon of which every point is visible from the origin, with a fast, exact inside test."""

    def __init__(self, vertices: Floats) -> None:
        angles = np.arctan2(vertices[:, 1], vertices[:, 0])
        first = int(np.argmin(angles))
        self.vertices = np.roll(vertices, -first, axis=0)
        self._angles = np.roll(angles, -first)
        if np.any(np.diff(self._angles) <= 0):
            raise AssertionError("the outline is not star-shaped about the origin")

    def inside(self, x: Floats, y: Floats) -> NDArray[np.bool_]:
        """Whether points lie inside; clear cases by the rounded rectangle, the others by the edge of their sector."""
        x, y = np.asarray(x, dtype=np.float64), np.asarray(y, dtype=np.float64)
        sure = WAVE_MM + 1.0
        ax, ay = np.abs(x), np.abs(y)
        cut = HALF_X_MM + HALF_Y_MM - (2.0 - np.sqrt(2.0)) * CORNER_MM - 2.0 * sure
        result = np.asarray((ax < HALF_X_MM - sure) & (ay < HALF_Y_MM - sure) & (ax + ay < cut))
        near = np.flatnonzero(((ax < HALF_X_MM + sure) & (ay < HALF_Y_MM + sure)) & ~result)
        if near.size:
            px, py = x.reshape(-1)[near], y.reshape(-1)[near]
            a = np.searchsorted(self._angles, np.arctan2(py, px), side="right") - 1
            ends = self.vertices[(a + 1) % len(self.vertices)]
            starts = self.vertices[a]
            side = (ends[:, 0] - starts[:, 0]) * (py - starts[:, 1]) - (ends[:, 1] - starts[:, 1]) * (px - starts[:, 0])
            result.reshape(-1)[near] = side >= 0
        return result


def _edge_spans(a: Floats, b: Floats, radius: float) -> tuple[Floats, Floats]:
    """Parts of the edges a→b inside the circle round the origin: parameters from, to in [0, 1]; equal if none."""
    d = b - a
    dd = np.einsum("ij,ij->i", d, d)
    ad = np.einsum("ij,ij->i", a, d)
    root = ad * ad - dd * (np.einsum("ij,ij->i", a, a) - radius * radius)
    half = np.sqrt(np.maximum(root, 0.0))
    return np.clip((-ad - half) / dd, 0.0, 1.0), np.clip((-ad + half) / dd, 0.0, 1.0)


def _angle(p: Floats, q: Floats) -> Floats:
    return np.asarray(np.arctan2(p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0], np.einsum("ij,ij->i", p, q)))


def disc_area_inside(vertices: Floats, radius: float) -> float:
    """Exact area common to a counter-clockwise polygon and the disc of this radius round the origin.

    Each edge forms a triangle with the origin; the part of it in the disc is a sector, a triangle and a sector.
    """
    a, b = vertices, np.roll(vertices, -1, axis=0)
    t0, t1 = _edge_spans(a, b, radius)
    p, q = a + t0[:, None] * (b - a), a + t1[:, None] * (b - a)
    sectors = radius * radius * (_angle(a, p) + _angle(q, b))
    return float(0.5 * np.sum(sectors + p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]))


def disc_outline_inside(vertices: Floats, radius: float, points: int) -> Floats:
    """Trace the boundary of that common area, counter-clockwise; the area must be star-shaped about the origin."""
    angles = 2 * np.pi * np.arange(points) / points
    circle = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    a, b = vertices, np.roll(vertices, -1, axis=0)
    t0, t1 = _edge_spans(a, b, radius)
    if not np.any(t1 > t0):
        return circle
    enters, leaves = (t1 > t0) & (t0 > 0), (t1 > t0) & (t1 < 1)
    kept = np.concatenate(
        [
            circle[pocket.inside(vertices, circle)],
            a[np.hypot(a[:, 0], a[:, 1]) < radius],
            (a + t0[:, None] * (b - a))[enters],
            (a + t1[:, None] * (b - a))[leaves],
        ]
    )
    return kept[np.argsort(np.arctan2(kept[:, 1], kept[:, 0]), kind="stable")]
