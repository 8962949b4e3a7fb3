"""The tables of a history, and how its file is opened."""

from __future__ import annotations

import dataclasses
import sqlite3
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from debulk._core import InputError
from debulk.history.rows import TABLES, Row

_APPLICATION = 0x6462_6C6B  # "dblk", in the file's header: this file is a history
_LAYOUT = 2  # of the tables
_PATIENCE_S = 2.0  # for which a writer waits for another one
_PAUSE_S = 0.01
_TYPES = {"int": "INTEGER NOT NULL", "str": "TEXT NOT NULL", "float": "REAL NOT NULL", "float | None": "REAL"}

# `of` is the report that a comparison or an operator's word is about. `figures` is the digest of the record's rows in
# the other tables, `previous` the hash of the record before it, and `hash` is over all of them and the body.
_RECORD = """CREATE TABLE record (
  number INTEGER PRIMARY KEY AUTOINCREMENT,
  kind TEXT NOT NULL,
  of INTEGER REFERENCES record (number),
  stored_utc TEXT NOT NULL,
  figures TEXT NOT NULL,
  previous TEXT NOT NULL,
  hash TEXT NOT NULL
);
CREATE TABLE body (number INTEGER PRIMARY KEY REFERENCES record (number), text BLOB NOT NULL);"""
_INDEXES = (
    "layup (part, ply)",
    "layup (time_utc)",
    "layup (verdict)",
    "pocket (record)",
    "pocket (x_mm, y_mm, verdict, record)",  # holds all that the map of the page needs
    "cause (name)",
    "cause (record)",
    "outcome (report, pocket)",
    "outcome (record)",
    "chain (record)",
)


def counting_outcomes(wanted: str = "1") -> str:
    """Return a query of the one outcome that counts of each pocket, of reports that fit a condition.

    Of the last that a comparison measured and the last that somebody said, it is the later one that is CEASE or CREASE;
    if neither is, the later one. SQLite takes the columns from the row of the maximum.
    """
    columns = "report, pocket, predicted, measured, peak_mm"
    last = f"SELECT {columns}, max(record) AS record FROM outcome WHERE {wanted} GROUP BY report, pocket, source"
    later = "max(record + (measured IN ('CEASE', 'CREASE')) * (1 << 62))"
    return f"SELECT {columns}, {later} FROM ({last}) GROUP BY report, pocket"


@contextmanager
def connected(path: Path, *, write: bool = False) -> Iterator[sqlite3.Connection]:
    """Open a history for one piece of work, which is committed as a whole at the end, or not at all.

    A connection lives only that long: it belongs to one thread and would not outlive a fork. Any fault of SQLite is an
    `InputError`.
    """
    connection = None
    try:
        if not write and not path.is_file():
            raise InputError(f"{path}: there is no such history")
        connection = _opened(path, write)
        _check(connection, path, write)
        connection.execute("BEGIN IMMEDIATE" if write else "BEGIN")
        yield connection
        connection.execute("COMMIT")
    except (sqlite3.Error, UnicodeDecodeError) as error:  # SQLite quotes the names in a damaged file
        raise InputError(f"{path}: the history cannot be {'written' if write else 'read'}: {error}") from None
    finally:
        if connection is not None:
            connection.close()  # rolls back what was not committed


def _opened(path: Path, write: bool) -> sqlite3.Connection:
    """Open the file; where its folder takes no file, for a reader, as it stands.

    SQLite's readers share a small file in the folder, which a full disk or a read-only one does not take. Without that
    file nobody writes there either, and all records are in the history itself unless a journal was left.
    """
    connection = sqlite3.connect(path, timeout=_PATIENCE_S, isolation_level=None)
    try:
        connection.execute("PRAGMA schema_version")
    except sqlite3.OperationalError as error:
        connection.close()
        journal = path.with_name(f"{path.name}-wal")
        folder_refuses = error.sqlite_errorcode & 0xFF in (sqlite3.SQLITE_CANTOPEN, sqlite3.SQLITE_IOERR)
        if write or not folder_refuses or (journal.exists() and journal.stat().st_size):
            raise
        connection = sqlite3.connect(f"{path.absolute().as_uri()}?immutable=1", uri=True, isolation_level=None)
    return connection


def _check(connection: sqlite3.Connection, path: Path, write: bool) -> None:
    application = _whose(connection, write)
    if application is None and write:
        _make(connection)
        return
    if application != _APPLICATION:
        raise InputError(f"{path}: not a history of debulk")
    layout = connection.execute("PRAGMA user_version").fetchone()[0]
    if layout > _LAYOUT:
        raise InputError(f"{path}: expected a history of layout {_LAYOUT}, got {layout}; install a newer debulk")
    connection.execute("PRAGMA synchronous = FULL")
    if layout < _LAYOUT:
        _from_first(connection, write)


def _whose(connection: sqlite3.Connection, write: bool) -> int | None:
    """Return the number of the program whose file it is; None: nothing is in it.

    An empty file is one that somebody is just making: a reader waits for it.
    """
    last = time.monotonic() + _PATIENCE_S
    while True:
        # In this order: who makes the history between the two questions has made it, with its number, as a whole.
        tables = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
        application: int = connection.execute("PRAGMA application_id").fetchone()[0]
        if tables or application:
            return application
        if write or time.monotonic() > last:
            return None
        time.sleep(_PAUSE_S)


def _from_first(connection: sqlite3.Connection, write: bool) -> None:
    """Bring a history of 0.2.0, which has no table `chain`, to this layout; for a reader beside the file."""
    if not write:
        connection.execute(_table("chain", TABLES["chain"]).replace("CREATE TABLE", "CREATE TEMP TABLE"))
        return
    connection.execute("BEGIN IMMEDIATE")
    if connection.execute("PRAGMA user_version").fetchone()[0] < _LAYOUT:  # nobody else was faster
        connection.execute(_table("chain", TABLES["chain"]))
        _index(connection, "chain (record)")
        connection.execute(f"PRAGMA user_version = {_LAYOUT}")
    connection.execute("COMMIT")


def _make(connection: sqlite3.Connection) -> None:
    # Readers and a writer do not wait for each other, and a commit is on the disk before it returns.
    _with_log(connection)
    connection.execute("PRAGMA synchronous = FULL")
    connection.execute("BEGIN IMMEDIATE")
    if not connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]:  # nobody else was faster
        for statement in (*_RECORD.split(";\n"), *map(_table, TABLES, TABLES.values())):
            connection.execute(statement)
        for index in _INDEXES:
            _index(connection, index)
        connection.execute(f"PRAGMA user_version = {_LAYOUT}")
        connection.execute(f"PRAGMA application_id = {_APPLICATION}")
    connection.execute("COMMIT")


def _with_log(connection: sqlite3.Connection) -> None:
    """Write changes to a log first; SQLite does not wait by itself for another one that asks for the same."""
    last = time.monotonic() + _PATIENCE_S
    while True:
        try:
            connection.execute("PRAGMA journal_mode = WAL")
            return
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode & 0xFF != sqlite3.SQLITE_BUSY or time.monotonic() > last:
                raise
            time.sleep(_PAUSE_S)


def _index(connection: sqlite3.Connection, index: str) -> None:
    connection.execute(f"CREATE INDEX by_{''.join(c if c.isalnum() else '_' for c in index)} ON {index}")


def _table(name: str, kind: type[Row]) -> str:
    columns = ", ".join(f"{entry.name} {_TYPES[str(entry.type)]}" for entry in dataclasses.fields(kind))
    return f"CREATE TABLE {name} ({columns})"
