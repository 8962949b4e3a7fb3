"""What may be looked for in a history."""

from __future__ import annotations

import math
import re
import sqlite3
from dataclasses import dataclass
from typing import Any

from debulk._core import InputError
from debulk.history.rows import LayupRow, columns
from debulk.results.check_texts import CHECK_TEXTS
from debulk.verdict import Verdict

# Times are compared as text, so others than the start of a record's, 2026-11-27T02:59:44+00:00, would find nothing.
_TIME = re.compile(r"\d{4}(-\d\d(-\d\d(T\d\d(:\d\d(:\d\d(\.\d+)?(Z|\+00:00)?)?)?)?)?)?")


@dataclass(frozen=True, kw_only=True)
class Search:
    """Which layups are wanted; what is None does not matter."""

    part: str | None = None
    ply: str | None = None
    """`part`, `ply`: ``context["part"]`` and ``context["ply"]`` of the inspection, as text."""
    verdict: str | None = None
    """Name of the layup's verdict, such as "CREASE"."""
    check: str | None = None
    """Name of the check whose finding kept the layup from CEASE, such as "pockets", "level" or "holes"."""
    near_mm: tuple[float, float] | None = None
    within_mm: float = 50.0
    """`near_mm`, `within_mm`: mold XY; a pocket's centroid must be within that many mm of it."""
    since: str | None = None
    until: str | None = None
    """`since`, `until`: first and last time of the inspection, ISO 8601, also shortened: "2026-03" includes nothing
    after its start as `until`."""
    limit: int = 1_000_000
    """Most layups that are returned."""

    def __post_init__(self) -> None:
        names = [verdict.name for verdict in Verdict]
        if self.verdict is not None and self.verdict.upper() not in names:
            raise InputError(f"verdict: expected one of {', '.join(names)}, got {self.verdict!r}")
        if not self.within_mm > 0:
            raise InputError(f"within_mm: expected a positive number, got {self.within_mm!r}")
        if self.near_mm is not None and not all(map(math.isfinite, self.near_mm)):
            raise InputError(f"near_mm: expected two finite numbers, got {self.near_mm!r}")
        for name, time in (("since", self.since), ("until", self.until)):
            if time is not None and not _TIME.fullmatch(time):
                raise InputError(f"{name}: expected a time in UTC like 2026-03-01 or 2026-03-01T06:30, got {time!r}")
        if self.limit < 1:
            raise InputError(f"limit: expected at least 1, got {self.limit!r}")

    def where(self, connection: sqlite3.Connection) -> tuple[str, list[Any]]:
        """Return the condition on the table `layup`, and its values; a check that nobody knows is an `InputError`."""
        if self.check is not None and self.check not in (known := [text.name for text in CHECK_TEXTS]):
            there = "SELECT 1 FROM cause WHERE name = ? LIMIT 1"  # of an earlier debulk
            if connection.execute(there, (self.check,)).fetchone() is None:
                raise InputError(f"check: expected the name of a check: {', '.join(known)}, got {self.check!r}")
        conditions, values = list[str](), list[Any]()
        verdict = None if self.verdict is None else self.verdict.upper()
        for condition, value in (
            ("part = ?", self.part),
            ("ply = ?", self.ply),
            ("verdict = ?", verdict),
            ("time_utc >= ?", self.since),
            ("time_utc <= ?", self.until),
            ("record IN (SELECT record FROM cause WHERE name = ?)", self.check),
        ):
            if value is not None:
                conditions.append(condition)
                values.append(value)
        if self.near_mm is not None:
            (x, y), r = self.near_mm, self.within_mm
            conditions.append(
                "record IN (SELECT record FROM pocket WHERE x_mm BETWEEN ? AND ? "
                "AND (x_mm - ?) * (x_mm - ?) + (y_mm - ?) * (y_mm - ?) <= ?)"
            )
            values += [x - r, x + r, x, x, y, y, r * r]
        return " AND ".join(conditions) or "1", values


def found(connection: sqlite3.Connection, search: Search) -> list[LayupRow]:
    """Return the layups that fit, the newest first."""
    where, values = search.where(connection)
    names = ", ".join(columns(LayupRow))
    query = f"SELECT {names} FROM layup WHERE {where} ORDER BY record DESC LIMIT ?"
    return [LayupRow(*row) for row in connection.execute(query, (*values, search.limit))]
