"""Checks of what an Inspector is given beside its clouds."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import arrays
from debulk._core import InputError

__all__ = ["camera_parameters", "image_mask", "outline", "pose"]

Floats = NDArray[np.float64]


def outline(value: ArrayLike | None) -> Floats | None:
    """(M, 2) corners of the ply, its own copy; a last corner that repeats the first is dropped."""
    return None if value is None else arrays.outline(value, "ply_outline")


def pose(value: ArrayLike | None) -> Floats | None:
    """(4, 4) rigid motion, a copy."""
    return None if value is None else arrays.rigid(value, "mold_from_scanner")


def camera_parameters(value: tuple[float, float, float] | None) -> Floats | None:
    """(f, cx, cy) in pixels, f positive."""
    if value is None:
        return None
    parameters = arrays.numbers(value, "camera", (3,), "(f, cx, cy) in pixels")
    if not parameters[0] > 0:
        raise InputError(f"camera: expected a positive focal length f in pixels, but got {parameters[0]:g}")
    return parameters


def image_mask(value: ArrayLike | None) -> NDArray[np.bool_] | None:
    """(H, W) bool."""
    if value is None:
        return None
    if isinstance(value, np.ma.MaskedArray):
        raise InputError("mask: expected a plain (H, W) array of bool, but got a masked array")
    array = np.asarray(value)
    if array.ndim != 2 or array.dtype != np.bool_:
        raise InputError(f"mask: expected an (H, W) array of bool, but got {array.dtype}, shape {array.shape}")
    return array
