"""Small tables of numbers in text, such as a pose's or an outline's."""

from __future__ import annotations

import math
import re
from codecs import BOM_UTF16_BE, BOM_UTF16_LE
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError
from debulk.files.source import open_source
from debulk.files.words import SEPARATORS, is_comma_number, is_number, split

_MAX_TEXT_BYTES = 1 << 24
_ENDLESS = re.compile(r"[+-]?(nan|inf|infinity)", re.IGNORECASE)
_LIKE_DIGITS = set("OoIl")  # a word of these alone is more likely a number with a slip than a name


class Table(NamedTuple):
    """A table of finite numbers and the lines of words above it."""

    numbers: NDArray[np.float64]
    headings: list[tuple[int, str]]  # line numbers and texts
    hint: str  # what may be wrong if the number of columns is another than expected
    blanks: list[int]  # rows above which an empty line stands, the first one left out


def read_small_text(path: Path) -> str:
    """Read a text file whose size is bounded."""
    with open_source(path) as source:
        if source.size > _MAX_TEXT_BYTES:
            raise InputError(f"{path}: expected a small text file, got {source.size} bytes")
        data = source.file.read(_MAX_TEXT_BYTES)
    if data.startswith((BOM_UTF16_LE, BOM_UTF16_BE)):
        raise InputError(f"{path}: the file holds UTF-16 text; save it as UTF-8 text")
    return data.decode("utf-8-sig", errors="replace")


def read_table(path: Path, text: str, *, headings: bool) -> Table:
    """Read lines of numbers, all with decimal points or all with decimal commas.

    Only lines of words, above the numbers and where `headings` allows them, are passed over.
    """
    rows: list[list[float]] = []
    above: list[tuple[int, str]] = []
    blanks: list[int] = []
    signs = ""
    for number, line in enumerate(text.splitlines(), start=1):
        kept = line.split("#")[0].strip()
        if not kept:
            if rows and not line.strip():
                blanks.append(len(rows))
            continue
        words = _numbers(kept)
        if words is None:
            if headings and not rows and _only_words(kept):
                above.append((number, kept))
                continue
            raise InputError(f"{path}: line {number}: expected numbers, got {line.strip()[:60]!r}")
        joined = " ".join(words)
        signs += "".join(sign for sign in ".," if sign in joined and sign not in signs)
        if len(signs) > 1:
            problem = f"expected decimal points or decimal commas in all numbers, got {line.strip()[:60]!r}"
            raise InputError(f"{path}: line {number}: {problem}")
        row = [float(word.replace(",", ".")) for word in words]
        if not all(map(math.isfinite, row)) or (rows and len(row) != len(rows[0])):
            problem = f"expected finite numbers, as many as above, got {line.strip()[:60]!r}"
            raise InputError(f"{path}: line {number}: {problem}")
        rows.append(row)
    if not rows:
        raise InputError(f"{path}: expected a table of numbers, got none")
    hint = " (decimal commas between commas?)" if "." not in signs and len(rows[0]) % 2 == 0 and "," in text else ""
    return Table(np.array(rows, dtype=np.float64), above, hint, blanks)


def _numbers(text: str) -> list[str] | None:
    """Split a line by the first separator that leaves numbers only."""
    for separator in SEPARATORS:
        words = split(text, separator)
        if separator != " " and not words[-1]:
            words.pop()  # a line may end with its separator
        fits = all(is_number(w) or _ENDLESS.fullmatch(w) or (separator != "," and is_comma_number(w)) for w in words)
        if fits and (len(words) >= 2 or (words and separator == " ")):
            return words
    return None


def _only_words(text: str) -> bool:
    """Tell whether a line consists of names, and holds nothing that may be a number with a slip."""
    words = re.findall(r"[^\W_]+", text)
    return bool(words) and not any(re.search(r"\d", word) or set(word) <= _LIKE_DIGITS for word in words)
