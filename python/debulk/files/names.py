"""The names and units over the columns of a table: which of them are x, y and z."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple

from debulk.files.words import SEPARATORS, split

_UNIT = r"[\[(]?(mm|m|cm|[µμu]m|in|inch|ft)[\])]?"
_NAME = re.compile(
    r"(?:(?:points?|pos(?:ition)?|coord(?:inate)?s?|vertex)[\s:_.\-]*)?([xyz])(?:[\s_\-]*(?:axis|coord(?:inate)?|pos(?:ition)?))?"
    rf"(?:[\s_]*(?:in\s+)?{_UNIT})?|points?[:_]([012])",
    re.IGNORECASE,
)
_UNITS = re.compile(_UNIT, re.IGNORECASE)


class Axes(NamedTuple):
    """What a line of names says."""

    words: list[str]
    places: list[int] | None  # of x, y, z
    units: list[str]  # those of x, y and z that are named


def find_axes(text: str, separator: str, columns: int, axes: str = "xyz") -> Axes:
    """Read a line of names; its separator may differ from that of the numbers."""
    best = None
    for choice in dict.fromkeys((separator, *SEPARATORS)):
        words = _words(text, choice)
        while len(words) > columns and not words[-1]:
            words.pop()  # some writers end each line of names with a separator
        places = _places(words, axes)
        if places is not None and (best is None or len(words) == columns):
            best = words, places
            if len(words) == columns:
                break
    if best is None:
        return Axes(_words(text, separator), None, [])
    words, places = best
    units = [match[2].lower() for place in places if (match := _NAME.fullmatch(words[place])) and match[2]]
    return Axes(words, places, units)


def is_line_of_names(text: str, axes: str = "xyz") -> bool:
    """Tell whether a line names each axis once."""
    return any(_places(_words(text, separator), axes) is not None for separator in SEPARATORS)


def is_line_of_units(words: list[str]) -> bool:
    """Tell whether a line under the names gives units and nothing else."""
    said = [word for word in words if word]
    return bool(said) and all(_UNITS.fullmatch(word) or not re.search(r"\w", word) for word in said)


def unit_fault(said: Iterable[str], factor: float, option: str = "--unit") -> tuple[str, str] | None:
    """Compare the units that a file names with the one asked for; return what is wrong and a remedy."""
    found = {match[1].lower() for unit in said if (match := _UNITS.fullmatch(unit))}
    if not found - {"m" if factor == 1000.0 else "mm"}:
        return None
    other = found <= {"mm", "m"}
    remedy = f"load it with that unit ({option} {min(found)})" if other else "convert it to mm or m"
    return f"its columns are in {' and '.join(sorted(found))}", remedy


def _words(text: str, separator: str) -> list[str]:
    if separator == " ":
        text = re.sub(r"(?<!\s)\s+(?=[\[(])", "", text)  # x [mm] is one name
    return [word.strip("\"' ") for word in split(text, separator)]


def _places(words: list[str], axes: str) -> list[int] | None:
    matches = [_NAME.fullmatch(word) for word in words]
    names = [(match[1] or "xyz"[int(match[3])]).lower() if match else "" for match in matches]
    return None if any(names.count(axis) != 1 for axis in axes) else [names.index(axis) for axis in axes]
