"""The unit of the numbers in a file, and whether the object that they describe has the size of a ply."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from debulk._core import InputError

Unit = Literal["mm", "m"]
_MM_PER_UNIT = {"mm": 1.0, "m": 1000.0}
_LEAST_SIZE_MM = 10.0  # a cloud in metres, read as mm, is smaller
_MOST_SIZE_MM = 1e5  # a cloud in mm, read as metres, is larger


def factor(unit: str) -> float:
    """Return the number of millimetres in a unit."""
    if not isinstance(unit, str) or unit not in _MM_PER_UNIT:
        raise InputError(f'unit: expected "mm" or "m", got {unit!r}')
    return _MM_PER_UNIT[unit]


def check_size(path: Path, size_mm: float, what: str, unit: Unit) -> None:
    """Compare the largest extent with what can be scanned, since a wrong unit is a factor of 1000."""
    other: Unit = "m" if unit == "mm" else "mm"
    small, large = size_mm < _LEAST_SIZE_MM, size_mm > _MOST_SIZE_MM
    if not (small or large):
        return
    remedy = "check the unit of the export"
    if small == (unit == "mm"):
        option = "--unit" if what == "cloud" else "--frame-unit"
        remedy = f'if its numbers are in {other}, give unit="{other}" ({option} {other})'
    across, limit = size_mm / _MM_PER_UNIT[unit], "small" if small else "large"
    raise InputError(f"{path}: the {what} is {across:g} {unit} across, too {limit} for a scanned ply; {remedy}")
