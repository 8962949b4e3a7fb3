"""How results are saved and loaded: the ending decides the format, and a file is written whole or not at all."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path
from typing import TypeVar

from debulk._core import InputError
from debulk.files.replacing import check_ending, write_text
from debulk.files.source import open_source
from debulk.results import codec

RecordT = TypeVar("RecordT")
ENDINGS = (".json", ".csv", ".html")


def save(path: str | PathLike[str], texts: Mapping[str, Callable[[], str]]) -> None:
    """Write the text that belongs to the path's ending, which is .json, .csv or .html."""
    path = Path(path)
    check_ending(path, *ENDINGS)
    write_text(path, texts[path.suffix.lower()]())


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
