"""XYZ, CSV and TXT: one point per line, its numbers separated by blanks, commas or semicolons. Never organised.

A line of names may come first; the columns x, y, z are then found by name. Otherwise they are the first three. ``#``
and ``//`` start comments. Numbers have a decimal point.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from debulk.files.source import MAX_COLUMNS, MAX_HEADER_BYTES, Points, Source

_SEPARATORS = (";", ",", " ")
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*([eE][+-]?\d+)?|\.\d+([eE][+-]?\d+)?|nan|inf|infinity)", re.IGNORECASE)
_NAME = re.compile(r"(?:points?[:_])?([xyz012])(?:[\s_]*[\[(]?(mm|m)[\])]?)?", re.IGNORECASE)
_LINES_AT_ONCE = 1 << 14
_REMEDY = "export it as lines of x y z with decimal points"


class _Line(NamedTuple):
    number: int
    offset: int
    text: str
    comment: bool = False


def read_text(source: Source, factor: float) -> Points:
    """Read the points of a text file, (N, 3)."""
    begin = 3 if source.file.read(3) == b"\xef\xbb\xbf" else 0
    header, first = _head(source, begin)
    separator = _separator(first.text)
    if separator is None:
        comma = " (decimal commas?)" if re.search(r"\d,\d", first.text) else ""
        _fail(source, first, f"expected at least 3 numbers, got {_shown(first.text)}{comma}")
    words = _split(first.text, separator)
    if len(words) > MAX_COLUMNS:
        _fail(source, first, f"{len(words)} columns, expected at most {MAX_COLUMNS}")
    xyz = _columns(source, header, separator, len(words), factor)
    return source.text_points(first.offset, len(words), xyz, factor, separator=separator, comments=True)


def write_text(path: Path, points: NDArray[np.float32], extension: str) -> None:
    """Write lines of x y z: separated by commas under a line of names in a .csv, otherwise by blanks."""
    separator = "," if extension == ".csv" else " "
    line = separator.join(["%.9g"] * 3) + "\n"  # nine digits restore a float32 to the last bit
    with path.open("w", encoding="ascii") as file:
        if extension == ".csv":
            file.write("x,y,z\n")
        for first in range(0, len(points), _LINES_AT_ONCE):
            part = points[first : first + _LINES_AT_ONCE].ravel().tolist()
            file.write(line * (len(part) // 3) % tuple(part))


def _head(source: Source, begin: int) -> tuple[_Line | None, _Line]:
    """Return the line of names, if there is one, and the first line of numbers."""
    source.file.seek(begin)
    offset, header, plain = begin, None, False
    number = 0
    while offset < MAX_HEADER_BYTES + begin:
        raw = source.file.readline(MAX_HEADER_BYTES)
        if not raw:
            break
        number += 1
        if b"\0" in raw:
            source.fail(offset + raw.index(b"\0"), "a zero byte in a text file", _REMEDY)
        line = _Line(number, offset, raw.decode("utf-8", errors="replace").strip())
        if not raw.endswith(b"\n") and len(raw) == MAX_HEADER_BYTES:
            _fail(source, line, f"a line of more than {MAX_HEADER_BYTES} bytes")
        offset += len(raw)
        comment = line.text.startswith(("#", "//"))
        if comment:
            names = line._replace(text=line.text.lstrip("#/ "), comment=True)
            if not plain and _is_header(names.text):
                header = names  # as "# x y z intensity"
        elif line.text:
            if _separator(line.text) is not None or plain:
                return header, line
            if _looks_like_numbers(line.text):
                return None, line  # the fault in it should be reported, not skipped
            header, plain = line, True
    where = "the file" if offset == source.size else f"its first {MAX_HEADER_BYTES} bytes"
    return source.fail(offset, f"no points in {where}", _REMEDY)


def _separator(text: str) -> str | None:
    """Return the separator of a line whose first three or more columns are numbers or may be left out."""
    text = re.split("#|//", text)[0].strip()
    for separator in _SEPARATORS:
        words = _split(text, separator)
        if len(words) >= 3 and sum(_NUMBER.fullmatch(word) is not None for word in words) >= 3:
            return separator
    return None


def _split(text: str, separator: str) -> list[str]:
    text = re.split("#|//", text)[0].strip()
    return text.split() if separator == " " else [word.strip() for word in text.split(separator)]


def _looks_like_numbers(text: str) -> bool:
    return re.match(r"[+-]?\.?\d", text) is not None


def _named(words: list[str]) -> list[str]:
    """Return x, y, z or an empty name for each column."""
    names = [_NAME.fullmatch(word.strip("\"' ")) for word in words]
    return [(name[1].lower().translate(str.maketrans("012", "xyz")) if name else "") for name in names]


def _is_header(text: str) -> bool:
    return any(all(_named(_split(text, s)).count(axis) == 1 for axis in "xyz") for s in _SEPARATORS)


def _columns(source: Source, header: _Line | None, separator: str, count: int, factor: float) -> list[int]:
    if header is None:
        return [0, 1, 2]
    words = _split(header.text, separator)
    names = _named(words)
    if header.comment and len(words) > count:  # prose that happens to contain these letters
        return [0, 1, 2]
    if len(words) != count and not header.comment:
        _fail(source, header, f"{len(words)} names over {count} columns")
    if any(names.count(axis) != 1 for axis in "xyz"):
        _fail(source, header, f"expected columns named x, y and z, got {_shown(header.text)}", "name them")
    places = [names.index(axis) for axis in "xyz"]
    units = [match[2] for place in places if (match := _NAME.fullmatch(words[place].strip("\"' ")))]
    said = {unit.lower() for unit in units if unit}
    if said and said != {"m" if factor == 1000.0 else "mm"}:
        named = " and ".join(sorted(said))
        _fail(source, header, f"its columns are in {named}", f"load it with that unit (--unit {min(said)})")
    return places


def _shown(text: str) -> str:
    return repr(text[:60])


def _fail(source: Source, line: _Line, problem: str, remedy: str = _REMEDY) -> NoReturn:
    source.fail(line.offset, f"line {line.number}: {problem}", remedy)
