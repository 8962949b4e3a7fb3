"""Checks of what an Inspector is given beside its clouds."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import arrays
from debulk._core import InputError

__all__ = ["camera_parameters", "image_mask", "outline", "pose"]

Floats = NDArray[np.float64]


def outline(value: ArrayLike | None) -> Floats | None:
    """(M, 2) corners of the ply; a last corner that repeats the first is dropped."""
    if value is None:
        return None
    corners = arrays.numbers(value, "ply_outline", (None, 2), "an (M, 2) array of corners in mm")
    if len(corners) > 1 and np.array_equal(corners[0], corners[-1]):
        corners = corners[:-1]
    if len(corners) < 3:
        raise InputError(f"ply_outline: expected at least 3 corners, but got {len(corners)}")
    return corners


def pose(value: ArrayLike | None) -> Floats | None:
    """(4, 4) motion; that it is rigid is checked where it is used."""
    return None if value is None else arrays.numbers(value, "mold_from_scanner", (4, 4), "a (4, 4) matrix")


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
    array = np.asarray(value)
    if array.ndim != 2 or array.dtype != np.bool_:
        raise InputError(f"mask: expected an (H, W) array of bool, but got {array.dtype}, shape {array.shape}")
    return array
