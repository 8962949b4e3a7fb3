"""Outlines of plies, and wrong ones for them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["WRONG", "of_ply", "wrong"]

Floats = NDArray[np.float64]
WRONG = ("none", "short", "long", "shifted", "mirrored", "twice", "with a hole", "another ply's")


def of_ply(rng: np.random.Generator, wide_mm: float, high_mm: float) -> Floats:
    """Return the corners of a ply: a rectangle, one with a corner cut off, or a trapezium; counter-clockwise."""
    w, h = wide_mm / 2, high_mm / 2
    out = np.array([[-w, -h], [w, -h], [w, h], [-w, h]])
    kind = rng.integers(3)
    if kind == 1:
        a, b = rng.uniform(0.2, 0.45, 2) * (wide_mm, high_mm)
        out = np.array([[-w, -h], [w, -h], [w, h - b], [w - a, h], [-w, h]])
    if kind == 2:
        out[2, 0] -= rng.uniform(0.1, 0.3) * wide_mm
        out[3, 0] += rng.uniform(0.0, 0.15) * wide_mm
    return np.asarray(out)


def wrong(kind: str, ply: Floats, rng: np.random.Generator) -> Floats | None:
    """Return an outline that is wrong in this way for a ply."""
    w, h = np.ptp(ply, axis=0)
    low, high = ply.min(axis=0), ply.max(axis=0)
    far = float(np.exp(rng.uniform(np.log(8), np.log(50))))
    if kind == "none":
        return None
    if kind in ("short", "long"):
        out, side, to_high = ply.copy(), rng.integers(2), bool(rng.integers(2))
        at = (high if to_high else low)[side]
        if kind == "short":
            cut = at - far if to_high else at + far
            out[:, side] = np.minimum(out[:, side], cut) if to_high else np.maximum(out[:, side], cut)
        else:
            out[:, side] += far * (1 if to_high else -1) * (np.abs(out[:, side] - at) < 0.4 * (w, h)[side])
        return np.asarray(out)
    if kind == "shifted":
        way = rng.uniform(0, 2 * np.pi)
        return np.asarray(ply + far * np.array([np.cos(way), np.sin(way)]))
    if kind == "mirrored":
        axis = rng.integers(2)
        return np.asarray(np.array([-1.0, 1.0] if axis else [1.0, -1.0]) * ply)[::-1]
    if kind == "twice":
        return np.concatenate([ply, ply[:1], ply[::-1]] if rng.random() < 0.5 else [ply, ply])
    if kind == "with a hole":
        radius, middle = rng.uniform(8, 30), rng.uniform(-0.15, 0.15, 2) * (w, h)
        bottom = float(low[1])
        turn = np.linspace(1.5 * np.pi - 0.01, -0.5 * np.pi + 0.01, 50)
        hole = middle + radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        slit = hole[[0, -1], 0]
        return np.concatenate([ply[:1], [(slit[0], bottom)], hole, [(slit[1], bottom)], ply[1:]])
    return of_ply(rng, *rng.uniform(0.5, 1.1, 2) * (w, h))
