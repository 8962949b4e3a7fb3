"""Checks of what users pass as arrays: each gives the form that the core takes, or an error that names the argument."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk._core import InputError

__all__ = ["corners", "numbers", "pair", "points_xy", "positive", "whole"]

Floats = NDArray[np.float64]


def numbers(value: ArrayLike, name: str, shape: tuple[int | None, ...], expected: str, *, nan: bool = False) -> Floats:
    """Return numbers as float64 of a shape, finite, or with NaN where that is allowed.

    Parameters
    ----------
    value
        What the user passed.
    name
        Of the argument, for the error.
    shape
        None: any length.
    expected
        The shape and meaning in words, for the error.
    nan
        Whether a value may be NaN.

    Raises
    ------
    InputError
        No numbers, another shape, a value that is not finite.

    Examples
    --------
    >>> numbers([1, 2, 3], "xy", (2,), "two coordinates in mm")
    Traceback (most recent call last):
    ...
    debulk._core.InputError: xy: expected two coordinates in mm, but got shape (3,)
    """
    try:
        array: NDArray[Any] = np.asarray(value)
    except ValueError:  # lists of different lengths
        raise InputError(f"{name}: expected {expected}, but got {type(value).__name__}") from None
    if array.dtype.kind not in "fiu":
        raise InputError(f"{name}: expected {expected}, but got {_shown(value, array)}")
    fits = array.ndim == len(shape) and all(w in (None, n) for w, n in zip(shape, array.shape, strict=True))
    if not fits:
        raise InputError(f"{name}: expected {expected}, but got shape {array.shape}")
    floats = array.astype(np.float64, copy=False)
    if nan and np.isinf(floats).any():
        raise InputError(f"{name}: expected {expected}, none infinite, but got infinity")
    if not nan and not np.isfinite(floats).all():
        raise InputError(f"{name}: expected {expected}, all finite, but got NaN or infinity")
    return floats


def pair(value: ArrayLike, name: str) -> Floats:
    """Return (2,) finite numbers, such as a place in the XY plane."""
    return numbers(value, name, (2,), "two numbers")


def corners(value: ArrayLike, name: str) -> Floats:
    """Return (N, 2) finite corners of a polygon."""
    return numbers(value, name, (None, 2), "an (N, 2) array of corners in mm")


def points_xy(value: ArrayLike, name: str) -> tuple[Floats, bool]:
    """Return (M, 2) points, NaN allowed, and whether one alone, (2,), was passed."""
    one = np.ndim(value) == 1
    shape: tuple[int | None, ...] = (2,) if one else (None, 2)
    points = numbers(value, name, shape, "an (M, 2) array of points or one (2,)", nan=True)
    return np.atleast_2d(points), one


def positive(value: float, name: str) -> float:
    """Return a positive finite length."""
    number = float(numbers(value, name, (), "a positive length in mm"))
    if not number > 0:
        raise InputError(f"{name}: expected a positive length in mm, but got {value!r}")
    return number


def whole(value: float, name: str) -> int:
    """Return a whole number."""
    number = float(numbers(value, name, (), "a whole number"))
    if int(number) != number:
        raise InputError(f"{name}: expected a whole number, but got {value!r}")
    return int(number)


def _shown(value: Any, array: NDArray[Any]) -> str:
    return type(value).__name__ if array.dtype.kind in "OUS" else str(array.dtype)
