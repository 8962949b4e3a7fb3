"""Named matrices in files of OpenCV, Zivid and JSON, read by hand: nothing in such a file is ever executed."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError

Matrix = NDArray[np.float64]

_MOST_NUMBERS = 4096
_XML = re.compile(
    r"<(?P<name>\w+)\s+type_id\s*=\s*\"opencv-matrix\"\s*>\s*<rows>\s*(?P<rows>\d{1,4})\s*</rows>\s*"
    r"<cols>\s*(?P<cols>\d{1,4})\s*</cols>\s*<dt>[^<]{0,20}</dt>\s*<data>(?P<data>[^<]*)</data>"
)
_YAML = re.compile(
    r"^(?P<name>[^\s:#][^:#\n]*):[ \t]*!!opencv-matrix[ \t]*\n\s*rows:[ \t]*(?P<rows>\d{1,4})[ \t]*\n\s*"
    r"cols:[ \t]*(?P<cols>\d{1,4})[ \t]*\n\s*dt:[^\n]{0,20}\n\s*data:\s*\[(?P<data>[^\]]*)\]",
    re.MULTILINE,
)
_KEY = re.compile(r"(?P<indent>[ \t]*)(?P<name>[^\s:#\[\]{}-][^:#\[\]{}\n]*):[ \t]*(?P<rest>.*)")


def named_matrices(path: Path, text: str) -> dict[str, Matrix] | None:
    """Return the matrices of a JSON, YAML or XML file by their names; None if the text is none of these."""
    start = text.lstrip()[:200]
    suffix = path.suffix.lower()
    if start.startswith(("<?xml", "<opencv_storage")) or suffix == ".xml":
        return _of_opencv(path, _XML.finditer(text))
    if start.startswith("{") or suffix == ".json" or (start.startswith("[") and "," in text):
        return _of_json(path, text)
    if start.startswith(("%YAML", "---", "__version__")) or suffix in (".yml", ".yaml"):
        return _of_opencv(path, _YAML.finditer(text)) | _of_yaml(path, text)
    return None


def _of_opencv(path: Path, found: Iterator[re.Match[str]]) -> dict[str, Matrix]:
    matrices: dict[str, Matrix] = {}
    for match in found:
        name = match["name"].strip()
        words = match["data"].replace(",", " ").split()
        rows, columns = int(match["rows"]), int(match["cols"])
        if len(words) != rows * columns:
            raise InputError(f"{path}: {name[:40]}: expected {rows} x {columns} numbers, got {len(words)}")
        if len(words) <= _MOST_NUMBERS:  # an image is no pose
            _add(path, matrices, name, np.reshape(_floats(path, name, words), (rows, columns)))
    return matrices


def _of_yaml(path: Path, text: str) -> dict[str, Matrix]:
    """Read lists of numbers from YAML, in brackets (also over several lines) or with a dash before each row."""
    matrices: dict[str, Matrix] = {}
    parents: list[tuple[int, str]] = []
    lines = text.splitlines()
    skipped: int | None = None
    at = 0
    while at < len(lines):
        match = _KEY.fullmatch(lines[at])
        at += 1
        if match is None:
            continue
        indent = len(match["indent"].expandtabs())
        parents = [parent for parent in parents if parent[0] < indent] + [(indent, match["name"].strip())]
        first = match["rest"].split("#")[0].strip()
        if first.startswith("!!"):
            skipped = indent  # what is below an opencv-matrix was read before
            continue
        if skipped is not None and indent > skipped:
            continue
        skipped = None
        parts, size = [first], len(first)
        depth = first.count("[") - first.count("]")
        while at < len(lines) and size < 40 * _MOST_NUMBERS:
            line = lines[at].split("#")[0].strip()
            if not (depth > 0 or line.startswith("-") or (not line and depth == 0)) and (
                first or not line.startswith("[")
            ):
                break
            if depth == 0 and not first and line.startswith("["):
                first = line
            parts.append(line)
            size += len(line) + 1
            depth += line.count("[") - line.count("]")
            at += 1
        name = ".".join(parent[1] for parent in parents)[-80:]
        listed = _in_brackets(parts)
        if listed.startswith("["):
            try:
                value = json.loads(re.sub(r"(?<![\d.])\.(?=\d)", "0.", re.sub(r"(?<=\d)\.(?!\d)", ".0", listed)))
            except (ValueError, RecursionError):
                continue  # a list of something else
            _add_listed(path, matrices, name, value)
    return matrices


def _in_brackets(parts: list[str]) -> str:
    """Write a list whose rows or numbers stand behind dashes in brackets, as JSON does."""
    behind = [part for part in parts if part]
    if not behind or not behind[0].startswith("-"):
        return " ".join(behind)
    items = [re.sub(r"^-\s+", "", part) for part in behind]
    if not items[0].startswith("-"):
        return f"[{', '.join(items)}]"
    rows = re.sub(r"^-\s+", "", ", ".join(items))  # as "- - 1.0", and below it "  - 2.0"
    return f"[[{re.sub(r', -[ ]+', '], [', rows)}]]"


def _of_json(path: Path, text: str) -> dict[str, Matrix] | None:
    try:
        value = json.loads(text)
    except RecursionError:
        raise InputError(f"{path}: expected a matrix, got lists inside lists inside lists without end") from None
    except ValueError as error:
        if text.lstrip().startswith("[") and path.suffix.lower() != ".json":
            return None  # as MATLAB and NumPy print a matrix
        raise InputError(f"{path}: not readable JSON: {str(error)[:80]}") from None
    matrices: dict[str, Matrix] = {}
    left: list[tuple[str, Any]] = [("", value)]
    while left:
        name, value = left.pop(0)
        if isinstance(value, dict) and value.get("type_id") == "opencv-matrix":
            said = value.get("rows"), value.get("cols")
            if all(type(number) is int and 0 < number <= _MOST_NUMBERS for number in said):
                _add_listed(path, matrices, name, value.get("data"), said)
        elif isinstance(value, dict):
            left += [(f"{name}.{key}".lstrip(".")[-80:], item) for key, item in value.items()]
        elif isinstance(value, list) and _depth(value) == 3:
            left += [(f"{name}[{k}]", item) for k, item in enumerate(value[:_MOST_NUMBERS])]
        elif isinstance(value, list):
            _add_listed(path, matrices, name, value)
    return matrices


def _depth(value: Any) -> int:
    depth = 0
    while isinstance(value, list) and value and depth < 4:
        value, depth = value[0], depth + 1
    return depth


def _add_listed(path: Path, matrices: dict[str, Matrix], name: str, value: Any, said: Any = None) -> None:
    rows = value if isinstance(value, list) else []
    flat = [item for row in rows for item in (row if isinstance(row, list) else [row])]
    if not flat or len(flat) > _MOST_NUMBERS or not all(type(item) in (int, float) for item in flat):
        return
    lengths = {len(row) if isinstance(row, list) else 0 for row in rows}
    if len(lengths) != 1:
        raise InputError(f"{path}: {name or 'the matrix'}: its lines have different lengths")
    shape = (len(rows), lengths.pop()) if isinstance(rows[0], list) else (1, len(rows))
    if said is not None and said[0] * said[1] != len(flat):
        raise InputError(f"{path}: {name[:40]}: expected {said[0]} x {said[1]} numbers, got {len(flat)}")
    _add(path, matrices, name, np.reshape(_floats(path, name, flat), said or shape))


def _add(path: Path, matrices: dict[str, Matrix], name: str, matrix: Matrix) -> None:
    if name in matrices:
        raise InputError(f"{path}: expected one matrix called {name[:40]!r}, got several")
    matrices[name] = matrix


def _floats(path: Path, name: str, words: list[Any]) -> Matrix:
    try:
        numbers = np.array([float(word) for word in words], dtype=np.float64)
    except (ValueError, OverflowError):
        numbers = np.array([np.nan])
    if not np.isfinite(numbers).all():
        raise InputError(f"{path}: {name[:40] or 'the matrix'}: expected finite numbers")
    return numbers
