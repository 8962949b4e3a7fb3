"""The base of every record of the results: typed arrays, which are checked, converted and made read-only."""

from __future__ import annotations

import functools
import types
import typing
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from debulk import __version__
from debulk._core import InputError

# Arrays with their shapes; None allows any length. Record enforces these shapes, and the JSON codec reads them.
Values = Annotated[NDArray[np.float64], (None,)]
PointsXY = Annotated[NDArray[np.float64], (None, 2)]
PointsXYZ = Annotated[NDArray[np.float64], (None, 3)]
Kinds = Annotated[NDArray[np.uint8], (None,)]
Flags = Annotated[NDArray[np.bool_], (None,)]
Numbers = Annotated[NDArray[np.int32], (None,)]
Pairs = Annotated[NDArray[np.int32], (None, 2)]
Quadruples = Annotated[NDArray[np.int32], (None, 4)]


class Record:
    """A part of the results. Arrays are converted to the declared type, checked for shape, and made read-only."""

    def __post_init__(self) -> None:
        _check_arrays(self)


class Versioned(Record):
    """A complete result, which names the version of debulk that made it."""

    version: str

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.version:
            object.__setattr__(self, "version", __version__)


def _check_arrays(record: Any) -> None:
    """Convert a record's arrays to their declared types, check their shapes, and make them read-only."""
    for name, dtype, shape in _arrays(record.__class__):
        value = getattr(record, name)
        if value is None:
            continue
        view = np.asarray(value, dtype=dtype).view()
        fits = view.ndim == len(shape) and all(
            want in (None, have) for want, have in zip(shape, view.shape, strict=True)
        )
        if not fits:
            raise InputError(f"{name}: expected the shape {_shape_text(shape)}, got {view.shape}")
        view.flags.writeable = False
        object.__setattr__(record, name, view)


@functools.cache
def _arrays(kind: Any) -> tuple[tuple[str, np.dtype[Any], tuple[int | None, ...]], ...]:
    """Names, types and shapes of a record's arrays."""
    hints = ((name, without_none(hint)) for name, hint in hints_of(kind).items())
    arrays = ((name, *typing.get_args(hint)) for name, hint in hints if typing.get_origin(hint) is Annotated)
    return tuple((name, dtype_of(elements), shape) for name, elements, shape in arrays)


def _shape_text(shape: tuple[int | None, ...]) -> str:
    return "(" + ", ".join("n" if length is None else str(length) for length in shape) + ")"


@functools.cache
def hints_of(kind: Any) -> dict[str, Any]:
    """Return the types of a record's fields by name."""
    return typing.get_type_hints(kind, include_extras=True)


def without_none(hint: Any) -> Any:
    """Strip `| None`."""
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        return next(part for part in typing.get_args(hint) if part is not type(None))
    return hint


def dtype_of(hint: Any) -> np.dtype[Any]:
    """Read the element type out of NDArray[...]."""
    dtype: np.dtype[Any] = np.dtype(typing.get_args(typing.get_args(hint)[1])[0])
    return dtype
