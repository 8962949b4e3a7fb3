"""Checks of the plain arguments of public functions by their annotations: an error names the argument and its type."""

from __future__ import annotations

import dataclasses
import functools
import inspect
import numbers
import operator
import sys
from collections.abc import Callable, Mapping
from os import PathLike
from typing import Any, ParamSpec, TypeVar

from debulk._core import InputError

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")

# For each annotation: what is expected, in words, and whether a value fits.
_FILE = (str, PathLike)
_KINDS: dict[str, tuple[str, Callable[[Any], bool]]] = {
    "float": ("a number", lambda value: _fits_float(value) or _plain(value, "fiu")),
    "int": ("a whole number", lambda value: isinstance(value, numbers.Integral) or _plain(value, "iu")),
    "str": ("text", lambda value: isinstance(value, str)),
    "str | PathLike[str]": ("the name of a file", lambda value: isinstance(value, _FILE) and value != ""),
    "Progress": ("a function of the stage and the share that is done", callable),
}
# Our classes by name, since a class that is not imported yet cannot have been passed; and how to get an instance.
_CLASSES = {
    "Chain": ("debulk.Chain", "debulk.Chain.load() reads one"),
    "History": ("debulk.history.History", "debulk.history.History() opens one"),
    "Outcomes": ("debulk.learning.Outcomes", "debulk.learning.Outcomes() makes one"),
    "Recipe": ("debulk.Recipe", "debulk.Recipe.load() reads one"),
    "Report": ("debulk.Report", "debulk.Report.load() reads one"),
    "Calibration": ("debulk.scanner.Calibration", "debulk.scanner.Calibration.load() reads one"),
    "Layup": ("debulk.scenes.Layup", "debulk.scenes.layup() makes one"),
    "Sheet": ("debulk.sheet.Sheet", "debulk.sheet.Sheet() makes one"),
}
_TEXTS = ("Literal[", "Paths")  # the function itself checks which words are allowed


def typed(function: Callable[Parameters, Result]) -> Callable[Parameters, Result]:
    """Check the arguments of a function that are annotated as numbers, text, files or classes of ours.

    Other arguments are not checked here: arrays are checked where they are used. Keywords that the function does not
    know raise a `TypeError`, as usual.
    """
    wanted = _wanted(function.__annotations__)
    order = list(inspect.signature(function).parameters)

    @functools.wraps(function)
    def call(*args: Parameters.args, **kwargs: Parameters.kwargs) -> Result:
        _check(dict(zip(order, args, strict=False)), wanted)
        _check(kwargs, wanted)
        return function(*args, **kwargs)

    return call


def check_fields(record: Any) -> None:
    """Check the fields of a dataclass in the same way."""
    kind: Any = type(record)
    wanted = _wanted_of(kind)
    _check({name: getattr(record, name) for name in wanted}, wanted)


@functools.cache
def _wanted_of(record: Any) -> dict[str, tuple[str, bool]]:
    return _wanted({field.name: field.type for field in dataclasses.fields(record)})


def of_type(value: Any) -> str:
    """Describe the value that was passed instead: text, a number or None as written, otherwise its type."""
    if value is None or isinstance(value, (str, int, float, PathLike)):
        text = repr(str(value) if isinstance(value, PathLike) else value)
        return text if len(text) <= 60 else f"{text[:57]}..."
    name = type(value).__name__.replace("ndarray", "array")
    return f"{'an' if name[:1].lower() in 'aeiou' else 'a'} {name}"


def _wanted(annotations: Mapping[str, Any]) -> dict[str, tuple[str, bool]]:
    """Return the kind of every checked argument, and whether it may be None."""
    found = {}
    for name, annotation in annotations.items():
        kind = str(annotation).removesuffix(" | None")
        may_be_none = kind != str(annotation)
        kind = "str" if kind.startswith(_TEXTS) else kind
        if name != "return" and (kind in _KINDS or kind in _CLASSES):
            found[name] = kind, may_be_none
    return found


def _check(values: Mapping[str, Any], wanted: Mapping[str, tuple[str, bool]]) -> None:
    for name, (kind, may_be_none) in wanted.items():
        if name not in values or (may_be_none and values[name] is None):
            continue
        value = values[name]
        if kind in _KINDS:
            expected, fits = _KINDS[kind]
            right = fits(value)
        else:
            these = (kind, "SimpleNamespace")  # experiments may pass a namespace in place of the class
            expected, right = f"a {_CLASSES[kind][0]}", any(base.__name__ in these for base in type(value).__mro__)
        if not right:
            remedy = f"; {_CLASSES[kind][1]}" if kind in _CLASSES else ""
            or_none = " or None" if may_be_none else ""
            raise InputError(f"{name}: expected {expected}{or_none}, but got {of_type(value)}{remedy}")


def whole(name: str, value: Any, low: int, high: int) -> int:
    """Return a whole number in a range."""
    try:
        number = operator.index(value)
    except TypeError:
        number = low - 1
    if isinstance(value, bool) or not low <= number <= high:
        raise InputError(f"{name}: expected a whole number of {low} to {high}, but got {value!r}")
    return number


def _fits_float(value: Any) -> bool:
    """Tell whether a value is a number and, if it is an int, not beyond the largest float."""
    return isinstance(value, numbers.Real) and (not isinstance(value, int) or abs(value) <= sys.float_info.max)


def _plain(value: Any, kinds: str) -> bool:
    """Tell whether a value is a zero-dimensional array of numbers."""
    return getattr(value, "ndim", None) == 0 and value.dtype.kind in kinds
