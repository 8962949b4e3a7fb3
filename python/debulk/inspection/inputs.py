"""Checks of what an Inspector is given beside its clouds."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk._core import InputError
from debulk.grid import Grid

Floats = NDArray[np.float64]


def numbers(value: ArrayLike, name: str, shape: tuple[int | None, ...], expected: str) -> Floats:
    """`value` as finite float64 of the shape (None: any length), or an error that names it."""
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name}: expected {expected}, but got {type(value).__name__}") from None
    fits = array.ndim == len(shape) and all(w in (None, n) for w, n in zip(shape, array.shape, strict=True))
    if not fits:
        raise InputError(f"{name}: expected {expected}, but got shape {array.shape}")
    if not np.isfinite(array).all():
        raise InputError(f"{name}: expected {expected}, all finite, but got NaN or infinity")
    return array


def outline(value: ArrayLike | None) -> Floats | None:
    """(M, 2) corners of the ply; a last corner that repeats the first is dropped."""
    if value is None:
        return None
    corners = numbers(value, "ply_outline", (None, 2), "an (M, 2) array of corners in mm")
    if len(corners) > 1 and np.array_equal(corners[0], corners[-1]):
        corners = corners[:-1]
    if len(corners) < 3:
        raise InputError(f"ply_outline: expected at least 3 corners, but got {len(corners)}")
    return corners


def angles(value: ArrayLike | Grid) -> Floats | Grid:
    """Two angles in degrees, or a Grid of them."""
    if isinstance(value, Grid):
        numbers(value.values, "fibre_angles_deg.values", (None, None, 2), "an (ny, nx, 2) array of degrees")
        return value
    return numbers(value, "fibre_angles_deg", (2,), "two angles in degrees, or a Grid of them")


def pose(value: ArrayLike | None) -> Floats | None:
    """(4, 4) motion; that it is rigid is checked where it is used."""
    return None if value is None else numbers(value, "mold_from_scanner", (4, 4), "a (4, 4) matrix")


def camera_parameters(value: tuple[float, float, float] | None) -> Floats | None:
    """(f, cx, cy) in pixels, f positive."""
    if value is None:
        return None
    parameters = numbers(value, "camera", (3,), "(f, cx, cy) in pixels")
    if not parameters[0] > 0:
        raise InputError(f"camera: expected a positive focal length f in pixels, but got {parameters[0]:g}")
    return parameters


def image_mask(value: ArrayLike | None) -> NDArray[np.bool_] | None:
    """(H, W) bool."""
    if value is None:
        return None
    array = np.asarray(value)
    if array.ndim != 2 or array.dtype != np.bool_:
        raise InputError(f"mask: expected an (H, W) array of bool, but got {array.dtype}, shape {array.shape}")
    return array
