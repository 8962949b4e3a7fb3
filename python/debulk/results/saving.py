"""How results are saved and loaded: the ending decides the format, and a file is written whole or not at all."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from typing import TypeVar

from debulk._core import InputError
from debulk.files.replacing import replacing
from debulk.files.source import open_source
from debulk.results import codec

__all__ = ["check_report_path", "load", "save"]

RecordT = TypeVar("RecordT")
_ENDINGS = (".json", ".csv", ".html")


def check_report_path(path: Path) -> None:
    """Refuse a file name whose ending is not that of a report format."""
    if path.suffix.lower() not in _ENDINGS:
        raise InputError(f"{path}: expected a file ending in .json, .csv or .html")


def save(path: str | PathLike[str], texts: Mapping[str, Callable[[], str]]) -> None:
    """Write the text that belongs to the path's ending, which is .json, .csv or .html."""
    path = Path(path)
    check_report_path(path)
    text = texts[path.suffix.lower()]()
    with replacing(path) as temporary:
        # The name of a file may hold bytes that are not UTF-8, which Python keeps as surrogate characters. They
        # can be written as \udce9, which JSON reads back.
        temporary.write_text(text, encoding="utf-8", errors="backslashreplace", newline="\n")


def load(
    kind: type[RecordT],
    path: str | PathLike[str],
    format_name: str,
    check: Callable[[RecordT], None] = lambda record: None,
) -> RecordT:
    """Read a record of this kind from JSON, and check it; an error names the file."""
    path = Path(path)
    with open_source(path) as source:
        data = source.file.read()
    try:
        return codec.loads(kind, data, format_name, check)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
