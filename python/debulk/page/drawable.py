"""Checks that a page can be drawn from a report: one that was edited by hand may contain infinite values."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError
from debulk.grid import Grid

_FARTHEST = 1e9  # mm


def check_drawable(record: Any) -> None:
    """Refuse a record with a place or a height that is infinite, unknown, or farther off than any part."""
    for name, values in _arrays(record, ""):
        beyond = values[~(np.abs(values) <= _FARTHEST)]
        if beyond.size:
            raise InputError(
                f"{name}: expected numbers up to {_FARTHEST:g} to draw a page of, but got {beyond.flat[0]:g}; no "
                "inspection makes such a report: inspect the scan again"
            )


def _arrays(value: Any, name: str) -> Iterator[tuple[str, NDArray[np.floating[Any]]]]:
    if isinstance(value, Grid):
        yield f"{name}.values", value.values[~np.isnan(value.values)]  # NaN means that nothing is known there
        yield f"{name}.origin_mm, spacing_mm", np.array([*value.origin_mm, value.spacing_mm])
    elif isinstance(value, np.ndarray) and value.dtype.kind == "f":
        yield name, value
    elif isinstance(value, tuple):
        for k, one in enumerate(value):
            yield from _arrays(one, f"{name}[{k}]")
    elif dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from _arrays(getattr(value, field.name), f"{name}.{field.name}".lstrip("."))
