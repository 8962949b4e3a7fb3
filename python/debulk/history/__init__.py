"""The history of a cell: every report and comparison in one SQLite file, whose records are chained by their hashes."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from debulk.history.check import Checked
    from debulk.history.rows import LayupRow, OutcomeRow, PocketRow
    from debulk.history.search import Search
    from debulk.history.store import History

__all__ = ["Checked", "History", "LayupRow", "OutcomeRow", "PocketRow", "Search"]

# Loaded when first used: most inspectors have no history, and SQLite takes some milliseconds.
_HOMES = {
    "Checked": "check",
    "History": "store",
    "LayupRow": "rows",
    "OutcomeRow": "rows",
    "PocketRow": "rows",
    "Search": "search",
}


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(importlib.import_module(f"debulk.history.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'debulk.history' has no attribute {name!r}")
