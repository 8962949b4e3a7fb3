"""A table of a history as CSV, as Parquet (the extra "parquet"; pyarrow is imported only here), or as AQDEF."""

from __future__ import annotations

import sqlite3
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any

from debulk._core import InputError
from debulk.arguments import typed
from debulk.files.replacing import replacing
from debulk.history import aqdef
from debulk.history.rows import TABLES, LayupRow, columns
from debulk.history.search import Search
from debulk.history.store import History
from debulk.history.tables import connected
from debulk.results.extras import imported
from debulk.results.report_csv import written

_ARROW = {"int": "int64", "str": "string", "float": "float64", "float | None": "float64"}
_OWNER = {"outcome": "report"}  # the column that names a row's layup; in the other tables it is "record"


@typed
def export(history: History, path: str | PathLike[str], table: str = "layup", search: Search | None = None) -> int:
    """Write a table of a history, and return its number of rows.

    Parameters
    ----------
    history
        The history.
    path
        Name of the file, which ends in .csv, .parquet, or .dfq for the layups of one part in AQDEF: the highest ridge
        that may stand, with the newest recipe's limit, the pockets, coverage, noise, level, tilt and bow.
    table
        "layup", "pocket", "cause", "chain" or "outcome"; their columns are the fields of `LayupRow`, `PocketRow`,
        `CauseRow`, `ChainRow` and `OutcomeRow`.
    search
        Which layups are wanted; None: all. The rows are in the order of their records.

    Raises
    ------
    InputError
        If table or ending is another one, the file cannot be written, pyarrow is missing for a .parquet, or a .dfq is
        asked for another table than "layup", or for several parts.

    Examples
    --------
    >>> import tempfile
    >>> from debulk.report import Report, Verdict
    >>> folder = tempfile.mkdtemp()
    >>> history = History(f"{folder}/cell.sqlite")
    >>> number = history.add(Report(verdict=Verdict.CEASE, reason="nothing raised", pockets=()))
    >>> export(history, f"{folder}/layups.csv")
    1
    """
    path = Path(path)
    if table not in TABLES:
        raise InputError(f"table: expected one of {', '.join(TABLES)}, got {table!r}")
    if path.suffix.lower() == ".dfq":
        return _dfq(history, path, table, search or Search())
    write = {".csv": _csv, ".parquet": _parquet}.get(path.suffix.lower())
    if write is None:
        raise InputError(f"{path}: expected a file ending in .csv, .parquet or .dfq")
    with connected(history.path) as connection:
        rows = _rows(connection, table, search or Search())
    with replacing(path) as temporary:
        write(temporary, table, rows)
    return len(rows)


def _rows(connection: sqlite3.Connection, table: str, search: Search) -> list[tuple[Any, ...]]:
    where, values = search.where(connection)
    names, owner = ", ".join(columns(TABLES[table])), _OWNER.get(table, "record")
    wanted = f"SELECT record FROM layup WHERE {where} ORDER BY record DESC LIMIT ?"
    query = f"SELECT {names} FROM {table} WHERE {owner} IN ({wanted}) ORDER BY record, rowid"
    return connection.execute(query, (*values, search.limit)).fetchall()


def _dfq(history: History, path: Path, table: str, search: Search) -> int:
    if table != "layup":
        raise InputError(f"{path}: expected the table layup for a .dfq, got {table}")
    with connected(history.path) as connection:
        rows = [LayupRow(*row) for row in _rows(connection, table, search)]
        ridges = dict(connection.execute("SELECT record, max(high_mm) FROM pocket GROUP BY record"))
    recipe = history.report(rows[-1].record).recipe if rows else {}
    with replacing(path) as temporary:
        layups = [aqdef.Layup(row, ridges.get(row.record)) for row in rows]
        aqdef.write(temporary, layups, recipe.get("verdict", {}).get("max_ridge_mm"))
    return len(rows)


def _csv(path: Path, table: str, rows: Sequence[tuple[Any, ...]]) -> None:
    path.write_bytes(written(columns(TABLES[table]), rows).encode())


def _parquet(path: Path, table: str, rows: Sequence[tuple[Any, ...]]) -> None:
    arrow, parquet = (imported(name, "parquet", "export") for name in ("pyarrow", "pyarrow.parquet"))
    kind = TABLES[table]
    lines = list(zip(*rows, strict=True)) or [()] * len(columns(kind))
    fields = kind.__dataclass_fields__.values()
    arrays = [arrow.array(line, type=_ARROW[str(field.type)]) for field, line in zip(fields, lines, strict=True)]
    parquet.write_table(arrow.table(arrays, names=columns(kind)), path)
