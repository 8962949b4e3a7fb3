"""The mold: a plate with gentle double curvature on a flat table, z(x, y) as a polynomial."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats

HALF_X_MM = 600.0
HALF_Y_MM = 450.0
TABLE_Z_MM = -110.0
# Bounds of the mold's height, from the coefficients below; rays and projections start from them.
LOWEST_MM = -60.0
HIGHEST_MM = 1.0

# z in mm over U = x / 600 and V = y / 450. The radii of curvature are about 6.5 m along x and 5 m along y, with a
# slight twist and a slight asymmetry. So it is a part of low curvature, with all slopes below 0.15.
_UU, _VV, _UV, _UUU, _UUV, _UUVV = -27.0, -21.0, 4.0, 3.0, -3.0, 3.0


def height(x: Floats, y: Floats) -> Floats:
    """Height of the (unbounded) mold surface above the crest, mm."""
    u = x * (1 / HALF_X_MM)
    v = y * (1 / HALF_Y_MM)
    return np.asarray(u * (u * (_UU + _UUU * u + v * (_UUV + _UUVV * v)) + _UV * v) + _VV * v * v)


def height_and_slopes(x: Floats, y: Floats) -> tuple[Floats, Floats, Floats]:
    """Height of the (unbounded) mold surface in mm, and its slopes dz/dx and dz/dy."""
    u = x * (1 / HALF_X_MM)
    v = y * (1 / HALF_Y_MM)
    along = v * (_UUV + _UUVV * v)
    z = u * (u * (_UU + _UUU * u + along) + _UV * v) + _VV * v * v
    z_u = u * (2 * _UU + 3 * _UUU * u + 2 * along) + _UV * v
    z_v = u * (u * (_UUV + 2 * _UUVV * v) + _UV) + 2 * _VV * v
    return z, z_u * (1 / HALF_X_MM), z_v * (1 / HALF_Y_MM)


def inside(x: Floats, y: Floats) -> NDArray[np.bool_]:
    """Whether a point lies on the mold, as seen along z."""
    return np.asarray((np.abs(x) <= HALF_X_MM) & (np.abs(y) <= HALF_Y_MM))


def rim() -> NDArray[Any]:
    """(200, 3) points along the mold's upper edge, counter-clockwise from the corner (-x, -y), mm."""
    s = np.linspace(-1.0, 1.0, 50, endpoint=False)
    one = np.ones_like(s)
    x = HALF_X_MM * np.concatenate([s, one, -s, -one])
    y = HALF_Y_MM * np.concatenate([-one, s, one, -s])
    return np.stack([x, y, height(x, y)], axis=1)
