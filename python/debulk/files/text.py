"""XYZ, CSV, TXT, PTS and ASC: one point per line, its numbers in columns. Never organised.

Columns are separated by blanks, tabs, commas, semicolons or bars, and may stand in quotes. Lines of words may come
first, also `sep=;`, as spreadsheets write it, and the number of points, alone on a line. The columns x, y, z are found
by their names if there is a line of names; otherwise they are the first three. ``#`` and ``//`` start comments.

Rules, so that nothing is guessed:

* The decimal sign is a point or a comma in all numbers. A comma can be a decimal sign only where columns are separated
  otherwise, or stand in quotes. Between commas, numbers without any decimal point are refused, since 1,5,2,5,3,5 may be
  three numbers or six; names over as many columns show that it is six.
* A first column without a name that counts 0, 1, 2, ... or 1, 2, 3, ... over all of 20 lines or more, with at least
  three columns after it, is an index. One that rises by whole numbers in any other way is refused, and so are two first
  columns of whole numbers before three of decimals, which look like the row and the column of an image.
"""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from debulk.files.names import find_axes, is_line_of_names, is_line_of_units, unit_fault
from debulk.files.source import MAX_COLUMNS, MAX_HEADER_BYTES, Points, Source
from debulk.files.words import SEPARATORS, is_value, split, without_comment

_LINES_AT_ONCE = 1 << 14
_REMEDY = "export it as lines of x y z with decimal points"
_NAME_THEM = "name the columns in a first line, such as index,x,y,z"
_MATRIX_COLUMNS = 16  # a line of so many numbers without names is a row of an image
_COUNTED, _LOOKED_AT = 20, 20


class _Line(NamedTuple):
    number: int
    offset: int
    text: str
    comment: bool = False


class _Head(NamedTuple):
    first: _Line  # the first line of numbers
    separator: str
    names: _Line | None
    units: _Line | None
    promised: int | None  # number of points that a line promises


def read_text(source: Source, factor: float) -> Points:
    """Read the points of a text file, (N, 3)."""
    begin = 3 if source.file.read(3) == BOM_UTF8 else 0
    head = _head(source, begin)
    columns = len(split(without_comment(head.first.text), head.separator))
    if columns > MAX_COLUMNS or (head.names is None and columns >= _MATRIX_COLUMNS):
        remedy = "debulk.files.load_heights reads a matrix of heights, with its pitch; for points, name x, y and z"
        _fail(source, head.first, f"{columns} columns without the names x, y and z", remedy)
    xyz, all_named = _columns(source, head, columns, factor)
    if head.separator == "," and columns > 3 and not all_named:
        _check_commas(source, head.first)
    points = _read(source, head, columns, xyz, factor)
    if head.names is None and columns > 3:
        kind = _first_columns(source, head, columns, points, factor)
        if kind == "index":
            points = _read(source, head, columns, [1, 2, 3], factor)
    return points


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


def _read(source: Source, head: _Head, columns: int, xyz: list[int], factor: float) -> Points:
    return source.text_points(
        head.first.offset, columns, xyz, factor, count=head.promised, separator=head.separator, comments=True
    )


def _lines(source: Source, begin: int, most: int) -> Iterator[_Line]:
    """Yield the lines that are not empty, of the first `most` bytes after `begin`."""
    number = source.line(begin) - 1
    source.file.seek(begin)
    offset = begin
    while offset < most + begin:
        raw = source.file.readline(MAX_HEADER_BYTES)
        if not raw:
            return
        number += 1
        if b"\0" in raw:
            source.fail(offset + raw.index(b"\0"), "a zero byte in a text file", _REMEDY)
        line = _Line(number, offset, raw.decode("utf-8", errors="replace").rstrip("\r\n "))
        if not raw.endswith(b"\n") and len(raw) == MAX_HEADER_BYTES:
            _fail(source, line, f"a line of more than {MAX_HEADER_BYTES} bytes")
        offset += len(raw)
        line = line._replace(comment=line.text.lstrip().startswith(("#", "//")) and not line.text.startswith("#N/A"))
        if line.text.strip():
            yield line


def _head(source: Source, begin: int) -> _Head:
    """Read up to the first line of numbers; what stands before it must be words, or the number of points."""
    names: _Line | None = None
    counting: _Line | None = None  # 0,1,2: names that pandas gives to columns, or a point
    others: list[_Line] = []
    forced, count = "", None
    for line in _lines(source, begin, MAX_HEADER_BYTES):
        text = line.text.strip()
        if text.lower().startswith("sep=") and not (names or others):
            forced = line.text[4:5] or ","
        elif line.comment:
            stripped = line._replace(text=text.lstrip("#/ "))
            if (names is None or names.comment) and not others and is_line_of_names(stripped.text):
                names = stripped  # as "# x y z intensity"
        elif separator := _separator(line.text, forced, names):
            fields = split(without_comment(line.text), separator)
            if names is None and counting is None and _counts(fields):
                counting = line
                continue
            if counting and (counting.text.startswith(separator) or any("." in field for field in fields)):
                axes = {"": "index", "0": "x", "1": "y", "2": "z"}
                counted = [axes.get(field, field) for field in split(counting.text, separator)]
                names = counting._replace(text=separator.join(counted))
            elif counting:
                line = counting
            units = _check_headings(source, others, names, len(fields), separator)
            return _Head(line, separator, names, units, count)
        elif (
            text.isascii() and text.isdigit() and len(text) <= 12 and count is None and (names is None or names.comment)
        ):
            count = int(text)
        elif (names is None or names.comment) and is_line_of_names(text):
            names, others = line, []  # whatever stands above the names is prose
        elif text.strip(";,|\t "):  # spreadsheets write empty lines with their separators
            others.append(line)
    if counting:
        separator = _separator(counting.text, forced, None)
        return _Head(counting, separator, names, None, count)
    faulty = next((line for line in others if _looks_like_numbers(line.text) or names is not None), None)
    if faulty is not None:
        _fail(source, faulty, f"expected at least 3 numbers, got {_shown(faulty.text)}")
    where = "the file" if source.size <= MAX_HEADER_BYTES + begin else f"its first {MAX_HEADER_BYTES} bytes"
    return source.fail(min(source.size, MAX_HEADER_BYTES + begin), f"no points in {where}", _REMEDY)


def _counts(fields: list[str]) -> bool:
    named = fields[1:] if fields[0] == "" else fields
    return len(named) >= 3 and named == [str(k) for k in range(len(named))]


def _separator(text: str, forced: str, names: _Line | None) -> str:
    """Return the separator of a line of numbers, or nothing if it is no such line."""
    text = without_comment(text.lstrip(" "))
    for separator in (forced,) if forced else SEPARATORS:
        words = split(text, separator)
        filled = [word for word in words if word]
        values = sum(map(is_value, filled))
        named = names is not None and len(split(names.text, "\t")) == len(words)
        if separator == "\t" and "" in words[:-1] and len(filled) >= 3 and not named:
            continue  # several tabs in a row may also be there to align the columns
        # A line that starts with what was not seen is one of numbers, too.
        if values >= 3 or (separator != " " and len(words) >= 3 and 0 < values == len(filled)):
            return separator
    return ""


def _check_headings(
    source: Source, others: list[_Line], names: _Line | None, columns: int, separator: str
) -> _Line | None:
    """Refuse lines before the numbers that may be points or names; return the line of units."""
    units = None
    for line in others:
        words = split(without_comment(line.text.strip(";,| ")), separator)
        if names is not None and is_line_of_units(words):
            units = line
        elif names is not None or _looks_like_numbers(line.text):
            _fail(source, line, f"expected at least 3 numbers, got {_shown(line.text)}")
        elif len(words) == columns or (separator != " " and len(words) >= 3):
            _fail(source, line, f"expected columns named x, y and z, got {_shown(line.text)}", "name them")
    return units


def _looks_like_numbers(text: str) -> bool:
    return re.match(r"\W*\d", text) is not None


def _columns(source: Source, head: _Head, columns: int, factor: float) -> tuple[list[int], bool]:
    """Return the places of x, y, z, and whether a line names all columns."""
    if head.names is None:
        return [0, 1, 2], False
    names = find_axes(head.names.text, head.separator, columns)
    if head.names.comment and len(names.words) > columns:  # prose that happens to contain these letters
        return [0, 1, 2], False
    if len(names.words) != columns and not head.names.comment:
        hint = " (decimal commas?)" if head.separator == "," and columns > len(names.words) else ""
        _fail(source, head.names, f"{len(names.words)} names over {columns} columns{hint}")
    if names.places is None:
        _fail(source, head.names, f"expected columns named x, y and z, got {_shown(head.names.text)}", "name them")
    said = set(names.units)
    if head.units is not None:
        words = split(head.units.text, head.separator)
        said |= {words[place] for place in names.places if place < len(words)}
    if fault := unit_fault(said, factor):
        _fail(source, head.units or head.names, *fault)
    return names.places, len(names.words) == columns


def _check_commas(source: Source, first: _Line) -> None:
    """Refuse a file in which commas may be decimal signs as well as separators, since no number has a point.

    Anything but a digit beside each comma of a line shows that the comma separates.
    """
    apart = re.compile(r"(?<!\d),|,(?!\d)")
    for line in _lines(source, first.offset, source.size):
        text = without_comment(line.text)
        if re.match(r"(?:[^,]*,){0,2}[^,]*\.", text) or re.search(r'"[^",]*\d,\d[^",]*"', text):
            return  # also where decimal commas stand in quotes
        if len(apart.findall(text)) == text.count(",") or sum(map(bool, text.split(","))) <= 3:
            return  # three words cannot be three numbers with decimal commas
    _fail(
        source,
        first,
        f"no number has a decimal point, so the commas may be decimal commas: {_shown(first.text)}",
        "export it with decimal points or with semicolons between the columns, or name all columns in a first line",
    )


def _first_columns(source: Source, head: _Head, columns: int, points: Points, factor: float) -> str:
    """Tell whether the first column is an index; refuse columns before x that only look like one."""
    first = points.values[:, 0]
    count = len(first)
    for start in (0, 1):
        counted = (np.arange(start, start + min(count, _LOOKED_AT)) * factor).astype(np.float32)
        if count >= _COUNTED and np.array_equal(first[:_LOOKED_AT], counted):
            counted = (np.arange(start, start + count) * factor).astype(np.float32)
            if np.array_equal(first, counted):
                return "index"
    rises = count >= 3 and (np.diff(first[:_LOOKED_AT]) > 0).all() and _whole(first[:_LOOKED_AT], factor)
    if rises and (np.diff(first) >= 0).all() and _whole(first, factor):  # a float32 of many digits may repeat itself
        _fail(source, head.first, "is the first column an index, or x?", _NAME_THEM)
    if columns >= 5 and _image_places(source, head) and _whole(points.values[:, :2].ravel(), factor):
        problem = "are the first two columns the row and the column of an image, or x and y?"
        _fail(source, head.first, problem, "name the columns in a first line, such as row,column,x,y,z")
    return "x"


def _whole(values: NDArray[np.float32], factor: float) -> bool:
    return bool(np.array_equal(values, (np.rint(values / factor) * factor).astype(np.float32)))


def _image_places(source: Source, head: _Head) -> bool:
    """Tell whether the first lines have whole numbers in two columns and decimals in the next three."""
    looked_at = 0
    for line in _lines(source, head.first.offset, MAX_HEADER_BYTES):
        words = split(without_comment(line.text), head.separator)
        if line.comment or not all(map(is_value, words[2:5])):
            continue
        if not all(word.isdigit() for word in words[:2]) or not all(re.search(r"[.,]", word) for word in words[2:5]):
            return False
        looked_at += 1
        if looked_at == _LOOKED_AT:
            break
    return looked_at > 1


def _shown(text: str) -> str:
    return repr(text.strip()[:60])


def _fail(source: Source, line: _Line, problem: str, remedy: str = _REMEDY) -> NoReturn:
    source.fail(line.offset, f"line {line.number}: {problem}", remedy)
