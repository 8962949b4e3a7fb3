"""The chain of the records' hashes: which records were changed, and which are missing."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from debulk._core import InputError
from debulk.history import rows


@dataclass(frozen=True)
class Checked:
    """The outcome of a check."""

    records: int
    """Number of records that are there."""
    problems: tuple[str, ...]
    """What was changed or is missing, a sentence each; empty if nothing."""
    head: str
    """Number and hash of the last record, "17:3f…": note it elsewhere, and give it to a later check."""

    @property
    def passed(self) -> bool:
        """Whether nothing was changed and nothing is missing."""
        return not self.problems

    def __str__(self) -> str:
        first = f"{self.records} records, {'none changed or missing' if self.passed else 'not as they were stored'}"
        return "\n".join([first, *self.problems, f"head: {self.head}"])


def record_hash(header: Sequence[Any], body: bytes) -> str:
    """Return the SHA-256 of a record: number, kind, of, time, digest of its rows, hash of the record before; body."""
    text = json.dumps(list(header), ensure_ascii=False, separators=(",", ":"))
    return hashlib.sha256(text.encode() + b"\n" + body).hexdigest()


def checked(connection: sqlite3.Connection, head: str = "") -> Checked:
    """Check every record by itself, by its rows, and by the hash that the next one holds of it."""
    problems, count, last, previous = [], 0, 0, hashlib.sha256(b"").hexdigest()
    noted_number, noted_hash = _noted(head)
    seen_note = noted_number == 0
    ordered = "SELECT * FROM {} WHERE typeof(record) = 'integer' ORDER BY record, rowid"
    tables = {name: _Lines(connection.execute(ordered.format(name))) for name in rows.TABLES}
    for number, kind, of, stored, figures, before, own, body in connection.execute(
        "SELECT number, kind, of, stored_utc, figures, previous, hash, text FROM record LEFT JOIN body USING (number) "
        "ORDER BY number"
    ):
        if number != last + 1:
            problems.append(_missing(last + 1, number - 1))
        elif before != previous:
            problems.append(f"record {number} does not follow record {last} as it is now: one of them was replaced")
        header = (number, kind, of, stored, figures, before)
        if not _gives(own, record_hash, header, body):
            problems.append(f"record {number} was changed")
        lines = {name: table.of(number) for name, table in tables.items()}
        if not _gives(figures, rows.digest, lines):
            problems.append(f"the figures of record {number} by which it is searched were changed")
        if number == noted_number:
            seen_note = True
            if own != noted_hash:
                problems.append(f"record {number} is not the one that was noted, or one before it was changed")
        count, last, previous = count + 1, number, own
    given = connection.execute("SELECT CAST(seq AS INTEGER) FROM sqlite_sequence WHERE name = 'record'").fetchone()
    most = max(given[0] if given else 0, 0 if seen_note else noted_number)
    if most > last:
        problems.append(_missing(last + 1, most))
    return Checked(count, tuple(problems), f"{last}:{previous}")


def _gives(stored: Any, digest: Callable[..., str], *values: Any) -> bool:
    """Return whether a digest is the stored one; it has none where values are of other types than were stored."""
    try:
        return bool(digest(*values) == stored)
    except (TypeError, ValueError):
        return False


def _noted(head: str) -> tuple[int, str]:
    number, _, value = head.partition(":")
    if not head:
        return 0, ""
    if not (number.isascii() and number.isdecimal() and len(value) == 64):
        raise InputError(f"head: expected number and hash as an earlier check gave them, got {head!r}")
    return int(number), value


def _missing(first: int, last: int) -> str:
    return f"record {first} is missing" if first == last else f"records {first} to {last} are missing"


class _Lines:
    """The rows of a table in the order of their records, handed out record by record."""

    def __init__(self, cursor: Iterator[tuple[Any, ...]]) -> None:
        self._cursor = cursor
        self._next = next(cursor, None)

    def of(self, record: int) -> list[tuple[Any, ...]]:
        """Return the rows of a record; those of records that are not there are passed over."""
        found = []
        while self._next is not None and self._next[0] <= record:
            if self._next[0] == record:
                found.append(self._next)
            self._next = next(self._cursor, None)
        return found
