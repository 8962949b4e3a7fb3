"""Molds: planes, cylinders, saddles, spars and steps, as heights over XY."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["MOLDS", "Height", "normals"]

Floats = NDArray[np.float64]
Height = Callable[[Floats, Floats], Floats]
_STEP_MM = 1e-3  # of central differences


def normals(height: Height, x: Floats, y: Floats) -> Floats:
    """Return the (..., 3) upward unit normals of a surface at these places."""
    dx, dy = (
        (height(x + a, y + b) - height(x - a, y - b)) / (2 * _STEP_MM) for a, b in ((_STEP_MM, 0.0), (0.0, _STEP_MM))
    )
    out = np.stack([-dx, -dy, np.ones_like(dx)], axis=-1)
    return np.asarray(out / np.linalg.norm(out, axis=-1, keepdims=True))


def _turned(rng: np.random.Generator, section: Callable[[Floats, Floats], Floats]) -> Height:
    """Return a surface turned about z at random, and leaning a little."""
    turn, (sx, sy) = rng.uniform(0, np.pi), rng.normal(0, 0.02, 2)
    c, s = np.cos(turn), np.sin(turn)
    return lambda x, y: section(c * x + s * y, c * y - s * x) + sx * x + sy * y


def _flat(rng: np.random.Generator) -> Height:
    return _turned(rng, lambda u, v: 0.0 * u)


def _cylinder(rng: np.random.Generator) -> Height:
    radius, way = np.exp(rng.uniform(np.log(170), np.log(700))), rng.choice((-1.0, 1.0))
    return _turned(rng, lambda u, v: np.asarray(way * (np.sqrt(np.maximum(radius**2 - u**2, 1.0)) - radius)))


def _saddle(rng: np.random.Generator) -> Height:
    radius = np.exp(rng.uniform(np.log(180), np.log(700)))
    return _turned(rng, lambda u, v: (u**2 - v**2) / (2 * radius))


def _spar(rng: np.random.Generator) -> Height:
    """Return a round crest, straight flanks of up to 61 degrees, and fillets down to a table."""
    crest, fillet, flank = rng.uniform(15, 45), rng.uniform(20, 35), rng.uniform(5, 15)
    slope = np.radians(rng.uniform(30, 61))
    c, s = np.cos(slope), np.sin(slope)
    u1, z1 = crest * s, crest * (c - 1)
    u2, z2 = u1 + flank * c, z1 - flank * s
    u3, z3 = u2 + fillet * s, z2 - fillet * (1 - c)

    def section(u: Floats, v: Floats) -> Floats:
        a = np.abs(u)
        on_crest = np.sqrt(np.maximum(crest**2 - np.minimum(a, u1) ** 2, 0)) - crest
        on_fillet = z3 + fillet - np.sqrt(np.maximum(fillet**2 - np.clip(u3 - a, 0, fillet) ** 2, 0))
        flank = z1 - (a - u1) * s / c
        return np.asarray(np.select([a < u1, a < u2, a < u3], [on_crest, flank, on_fillet], z3))

    return _turned(rng, section)


def _step(rng: np.random.Generator) -> Height:
    """Return the rounded edge of plies below: 0.3 to 2 mm high, 8 to 20 times as wide."""
    high = rng.uniform(0.3, 2.0)
    wide, at = max(4.0, high * rng.uniform(8, 20)), rng.uniform(-25, 25)

    def section(u: Floats, v: Floats) -> Floats:
        p = np.clip((u - at) / wide + 0.5, 0, 1)
        return high * p**3 * (10 - 15 * p + 6 * p * p)

    return _turned(rng, section)


MOLDS: dict[str, Callable[[np.random.Generator], Height]] = {
    "flat": _flat,
    "cylinder": _cylinder,
    "saddle": _saddle,
    "spar": _spar,
    "step": _step,
}
