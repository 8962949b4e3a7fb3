"""How an inspector gets its history."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING

from debulk._core import InputError
from debulk.arguments import of_type

if TYPE_CHECKING:
    from debulk.history.store import History


def history_of(given: History | str | PathLike[str] | None) -> History | None:
    """Return the history itself, or the one in the named file; without any, nothing of SQLite is imported."""
    if given is None:
        return None
    from debulk.history.store import History

    if isinstance(given, History):
        return given
    if not isinstance(given, (str, PathLike)):
        raise InputError(f"history: expected a debulk.history.History or the name of a file, but got {of_type(given)}")
    return History(given)
