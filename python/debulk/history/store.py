"""The history: what is added to it, and how a record is read back."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import sqlite3
import zlib
from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import Any

from debulk._core import InputError
from debulk.arguments import typed
from debulk.comparison import Comparison
from debulk.history import rows
from debulk.history.check import Checked, checked, record_hash
from debulk.history.rows import LayupRow, OutcomeRow, Row
from debulk.history.search import Search, found
from debulk.history.tables import connected
from debulk.report import Report
from debulk.results import codec
from debulk.results.comparison import FORMAT as COMPARISON
from debulk.results.fitting import check_fits
from debulk.results.report import FORMAT as REPORT
from debulk.results.report import MAPS
from debulk.results.trace import now_utc

_OUTCOME = "debulk outcome"
_FAST = 1  # level of compression: a record is stored while a cell waits
_SAYS = ("CEASE", "CREASE")
_A = {"report": "a report", "comparison": "a comparison", "outcome": "an operator's outcome: export the table outcome"}
_SAME = ("time_utc", "scan", "recipe", "part", "ply")  # of one inspection


class History:
    """Every report and comparison of a cell, in one SQLite file that several processes may use at once.

    A record is on the disk when the call that adds it returns; one that was not complete then is not there at all.
    Records are numbered from 1 without a gap, and each holds the hash of the one before: `check` finds those that were
    changed or are missing.

    Parameters
    ----------
    path
        The file; it is made with the first record.
    pictures
        Whether height maps and maps of excess are kept, which take two thirds of a report's bytes. Without them a page
        made of a stored report has no heights on its map; all figures, outlines and nets are there.

    Raises
    ------
    InputError
        If there is no such folder, or the file is something else.

    Examples
    --------
    >>> import tempfile
    >>> from debulk.report import Report, Verdict
    >>> history = History(f"{tempfile.mkdtemp()}/cell.sqlite")
    >>> history.add(Report(verdict=Verdict.INVALID, reason="nothing was checked", pockets=()))
    1
    >>> history.report(1).verdict.name, len(history.find(verdict="CREASE")), history.check().passed
    ('INVALID', 0, True)
    """

    @typed
    def __init__(self, path: str | PathLike[str], pictures: bool = False) -> None:
        self.path = Path(path)
        self.pictures = pictures
        if not self.path.parent.is_dir():
            raise InputError(f"{path}: there is no folder {self.path.parent}")
        if self.path.exists() and (self.path.is_dir() or self.path.stat().st_size):
            with connected(self.path):
                pass

    def __repr__(self) -> str:
        return f"History({str(self.path)!r})"

    @typed
    def add(self, report: Report) -> int:
        """Store a report, settled, and return the number of its record; one that is there already is not stored again.

        Raises
        ------
        InputError
            If the history cannot be written, for example on a full disk or while another process holds it for more
            than two seconds. Nothing of the record is in it then.
        """
        report = report.settle()
        kept = report
        if not self.pictures:
            kept = report.changed(**dict.fromkeys(MAPS))
        text = codec.dumps(kept, REPORT)
        return self._add("report", None, text, lambda number: rows.of_report(number, report))

    @typed
    def add_comparison(self, comparison: Comparison, report: Report) -> int:
        """Store a comparison, and return the number of its record; its report is added first if it is not there yet.

        Raises
        ------
        InputError
            As for `add`.
        """
        of = self.number_of(report) or self.add(report)  # which would settle and write out what is there
        kept = comparison if self.pictures else dataclasses.replace(comparison, height_map=None)
        text = codec.dumps(kept, COMPARISON)
        return self._add("comparison", of, text, lambda number: rows.of_comparison(number, of, comparison))

    @typed
    def add_outcome(self, record: int, pocket: int, measured: str, by: str = "", note: str = "") -> int:
        """Store what somebody saw become of a pocket, and return the number of that record.

        Parameters
        ----------
        record, pocket
            Record of the report, and number of the pocket in it.
        measured
            "CEASE" or "CREASE".
        by, note
            Who says so, and whatever else should be known.

        Raises
        ------
        InputError
            If there is no such pocket, the outcome is another word, or the history cannot be written.
        """
        if measured.upper() not in _SAYS:
            raise InputError(f"measured: expected CEASE or CREASE, got {measured!r}")
        with connected(self.path) as connection:
            query = "SELECT verdict, ridge_mm FROM pocket WHERE record = ? AND id = ?"
            known = connection.execute(query, (record, pocket)).fetchone()
        if known is None:
            self.kind(record)  # says so if there is no such record
            raise InputError(f"pocket: there is no pocket {pocket} in record {record} of {self.path}")
        said = {"format": _OUTCOME, "pocket": pocket, "measured": measured.upper(), "by": by, "note": note}
        predicted, ridge = known
        word = measured.upper()

        def made(number: int) -> list[Row]:
            return [OutcomeRow(number, record, pocket, "operator", predicted, word, ridge, None, None)]

        return self._add("outcome", record, json.dumps(said, ensure_ascii=False), made)

    def keep(self, report: Report) -> Report:
        """Store a report as it was decided, and return it; where that fails, with a warning in place of an error.

        An inspection ends with this: it waits for no net and no minimum that its verdict did not need, and whatever is
        wrong with a history, its verdict is not lost.
        """
        return self.kept(report)[0]

    def kept(self, report: Report) -> tuple[Report, int | None]:
        """Do what `keep` does, and also return the number of the record; None: it is not in the history."""
        try:
            return report, self.add(report.as_decided())
        except Exception as error:  # a verdict that is there must reach the cell
            return report.changed(warnings=(*report.warnings, f"not in the history: {error}")), None

    def keep_comparison(self, comparison: Comparison, report: Report) -> Comparison:
        """Store a comparison as `keep` stores a report."""
        try:
            self.add_comparison(comparison, report)
        except Exception as error:
            return dataclasses.replace(comparison, warnings=(*comparison.warnings, f"not in the history: {error}"))
        return comparison

    def number_of(self, report: Report) -> int | None:
        """Return the record of a report by the time, scan and recipe of its inspection; None if it is not there."""
        if not self.path.is_file():
            return None
        with connected(self.path) as connection:
            return _known(connection, rows.as_tuples(rows.of_report(0, report)))

    @typed
    def kind(self, record: int) -> str:
        """Return what a record is: "report", "comparison" or "outcome".

        Raises
        ------
        InputError
            If there is no such record.
        """
        with connected(self.path) as connection:
            row = connection.execute("SELECT kind FROM record WHERE number = ?", (record,)).fetchone()
        if row is None:
            raise InputError(f"{self.path}: there is no record {record}")
        kind: str = row[0]
        return kind

    @typed
    def report(self, record: int) -> Report:
        """Read the report of a record.

        Raises
        ------
        InputError
            If there is no such record, it is none of a report, or its figures do not fit its verdict.
        """
        return codec.loads(Report, self._body(record, "report"), REPORT, check_fits)

    @typed
    def comparison(self, record: int) -> Comparison:
        """Read the comparison of a record.

        Raises
        ------
        InputError
            If there is no such record, or it is none of a comparison.
        """
        return codec.loads(Comparison, self._body(record, "comparison"), COMPARISON)

    def find(self, search: Search | None = None, **wanted: Any) -> list[LayupRow]:
        """Return the layups that fit a search, the newest first.

        Parameters
        ----------
        search
            What is looked for; None: ``Search(**wanted)``.
        **wanted
            The fields of `Search`, such as ``part="A-17"`` or ``check="level"``.

        Raises
        ------
        InputError
            If the search or the history is wrong.
        """
        with connected(self.path) as connection:
            return found(connection, search or Search(**wanted))

    def check(self, head: str = "") -> Checked:
        """Look for records that were changed or are missing; see `Checked`.

        Parameters
        ----------
        head
            The `head` of an earlier check, noted elsewhere: everything up to there must still be as it was. Without it,
            somebody who forges all hashes after a change, or cuts off the end with the counter, is not found out.

        Raises
        ------
        InputError
            If the history cannot be read.
        """
        with connected(self.path) as connection:
            return checked(connection, head)

    def _add(self, kind: str, of: int | None, text: str, made: Callable[[int], list[Row]]) -> int:
        body = zlib.compress(text.encode("utf-8", "backslashreplace"), _FAST)
        with connected(self.path, write=True) as connection:
            number, previous = _last(connection)
            number += 1
            tables = rows.as_tuples(made(number))
            if there := _known(connection, tables):  # asked while nobody else writes: two that add it would both do so
                return there
            header = (number, kind, of, now_utc(), rows.digest(tables), previous)
            connection.execute("INSERT INTO record VALUES (?, ?, ?, ?, ?, ?, ?)", (*header, record_hash(header, body)))
            connection.execute("INSERT INTO body VALUES (?, ?)", (number, body))
            for name, lines in tables.items():
                places = ", ".join("?" * len(lines[0]))
                connection.executemany(f"INSERT INTO {name} VALUES ({places})", lines)
        return number

    def _body(self, record: int, kind: str) -> bytes:
        if (other := self.kind(record)) != kind:
            raise InputError(f"{self.path}: expected record {record} to be a {kind}, but it is {_A[other]}")
        with connected(self.path) as connection:
            row = connection.execute("SELECT text FROM body WHERE number = ?", (record,)).fetchone()
        try:
            return zlib.decompress(row[0] if row else b"")
        except zlib.error as error:
            raise InputError(f"{self.path}: record {record} was damaged: {error}") from None


def _known(connection: sqlite3.Connection, tables: Mapping[str, Sequence[tuple[Any, ...]]]) -> int | None:
    """Return the record of the same inspection; None if there is none, or it is not known when it was."""
    for line in tables.get("layup", ()):
        row = dict(zip(rows.columns(LayupRow), line, strict=True))
        if row["time_utc"]:
            same = " AND ".join(f"{name} = ?" for name in _SAME)
            values = [row[name] for name in _SAME]
            number: int | None = connection.execute(f"SELECT max(record) FROM layup WHERE {same}", values).fetchone()[0]
            return number
    return None


def _last(connection: sqlite3.Connection) -> tuple[int, str]:
    """Return number and hash of the last record; the number is the largest that was ever given."""
    given = connection.execute("SELECT seq FROM sqlite_sequence WHERE name = 'record'").fetchone()
    last = connection.execute("SELECT number, hash FROM record ORDER BY number DESC LIMIT 1").fetchone()
    number, previous = last or (0, hashlib.sha256(b"").hexdigest())
    return max(number, given[0] if given else 0), previous
