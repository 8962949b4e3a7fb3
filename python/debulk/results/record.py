"""The base of every record of the results: typed arrays, which are checked, converted and made read-only."""

from __future__ import annotations

import functools
import types
import typing
from typing import Annotated, Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from debulk import __version__
from debulk._core import InputError


class Stored:
    """How a record stores an array: its element type and its shape, in which None allows any length.

    It stands beside the array's annotation and repeats its element type: what an annotation like NDArray[...] is made
    of differs between releases of NumPy.
    """

    def __init__(self, dtype: DTypeLike, *shape: int | None) -> None:
        self.dtype: np.dtype[Any] = np.dtype(dtype)
        self.shape = shape


def fits(shape: tuple[int, ...], stored: tuple[int | None, ...]) -> bool:
    """Whether an array of this shape may be stored as one of that shape, in which None allows any length."""
    return len(shape) == len(stored) and all(length in (None, n) for length, n in zip(stored, shape, strict=True))


# Record enforces these types and shapes, and the JSON codec reads them.
Values = Annotated[NDArray[np.float64], Stored(np.float64, None)]
PointsXY = Annotated[NDArray[np.float64], Stored(np.float64, None, 2)]
PointsXYZ = Annotated[NDArray[np.float64], Stored(np.float64, None, 3)]
Kinds = Annotated[NDArray[np.uint8], Stored(np.uint8, None)]
Flags = Annotated[NDArray[np.bool_], Stored(np.bool_, None)]
Numbers = Annotated[NDArray[np.int32], Stored(np.int32, None)]
Pairs = Annotated[NDArray[np.int32], Stored(np.int32, None, 2)]
Quadruples = Annotated[NDArray[np.int32], Stored(np.int32, None, 4)]


class Record:
    """A part of the results. Arrays are converted to the declared type, checked for shape, and made read-only."""

    def __post_init__(self) -> None:
        kind: Any = self.__class__
        for name, stored in _arrays(kind):
            value = getattr(self, name)
            if value is None:
                continue
            values = np.asarray(value, dtype=stored.dtype)
            if not isinstance(values.base, np.ndarray | None):  # the core owns it: a whole net would stay alive
                values = values.copy()
            view = values.view()
            if not fits(view.shape, stored.shape):
                shape = ", ".join("n" if length is None else str(length) for length in stored.shape)
                raise InputError(f"{name}: expected the shape ({shape}), got {view.shape}")
            view.flags.writeable = False
            object.__setattr__(self, name, view)


class Versioned(Record):
    """A complete result, which names the version of debulk that made it."""

    version: str

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.version:
            object.__setattr__(self, "version", __version__)


@functools.cache
def _arrays(kind: Any) -> tuple[tuple[str, Stored], ...]:
    """Names, types and shapes of a record's arrays."""
    found = ((name, stored_as(without_none(hint))) for name, hint in hints_of(kind).items())
    return tuple((name, stored) for name, stored in found if stored is not None)


@functools.cache
def hints_of(kind: Any) -> dict[str, Any]:
    """Return the types of a record's fields by name."""
    return typing.get_type_hints(kind, include_extras=True)


def without_none(hint: Any) -> Any:
    """Strip `| None`."""
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        return next(part for part in typing.get_args(hint) if part is not type(None))
    return hint


def stored_as(hint: Any) -> Stored | None:
    """Return how the hinted array is stored; None if the hint is not that of an array."""
    return next((part for part in getattr(hint, "__metadata__", ()) if isinstance(part, Stored)), None)
