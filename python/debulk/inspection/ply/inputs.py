"""Checks of the arguments of an Inspector other than its clouds."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import arrays, rings
from debulk._core import InputError
from debulk.arguments import of_type
from debulk.arrays import Floats
from debulk.recipe import Recipe

Kept = TypeVar("Kept", bound=np.generic)


def kept(array: NDArray[Kept]) -> NDArray[Kept]:
    """Return a read-only copy, so that neither the array's owner nor the reader of a report can change it."""
    own = array.copy()
    own.flags.writeable = False
    return own


def check_sheet(recipe: Recipe) -> None:
    """Refuse a ply that is no sheet: the vacuum would fold it more sharply than it is thick.

    Its natural length (E t³ / 12 P)^(1/3) is then less than its thickness. Prepreg at room temperature has tens to
    hundreds of MPa.
    """
    young_mpa, pressure_mpa = recipe.material.young_mpa, recipe.loads.pressure_mpa
    if young_mpa < 12 * pressure_mpa:
        raise InputError(
            f"material.young_mpa, loads.pressure_mpa: a ply of {young_mpa:g} MPa under {pressure_mpa:g} MPa would fold "
            "more sharply than it is thick; both are in MPa, not GPa or bar"
        )


def outline(value: ArrayLike | None) -> Floats | None:
    """Return the (M, 2) corners of the ply; see `rings`."""
    return None if value is None else kept(rings.outline(value, "ply_outline"))


def pose(value: ArrayLike | None) -> Floats | None:
    """Return the (4, 4) rigid motion."""
    return None if value is None else kept(arrays.rigid(value, "mold_from_scanner"))


def camera_parameters(value: tuple[float, float, float] | None) -> Floats | None:
    """Return (f, cx, cy) in pixels, with a positive f."""
    return None if value is None else kept(arrays.camera(value))


def image_mask(value: ArrayLike | None) -> NDArray[np.bool_] | None:
    """Return the (H, W) mask, bool."""
    if value is None:
        return None
    if isinstance(value, np.ma.MaskedArray):
        raise InputError("mask: expected a plain (H, W) array of bool, but got a masked array")
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        raise InputError("mask: expected an (H, W) array of bool, but got rows of different lengths") from None
    if array.ndim != 2 or array.dtype != np.bool_:
        got = f"{array.dtype}, shape {array.shape}" if array.ndim else of_type(value)
        raise InputError(f"mask: expected an (H, W) array of bool, but got {got}")
    return kept(array)
