"""What the page of a history shows, read from its tables: counts and figures, and no report."""

from __future__ import annotations

import sqlite3
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk.grid import Grid
from debulk.history.search import Search

__all__ = ["FIGURES", "Overview", "overview"]

FIGURES = {
    "noise_mm": "noise of the height map, mm",
    "level_mm": "level: ply between the pockets less its thickness, mm",
    "offset_mm": "registration: offset, mm",
    "tilt_deg": "registration: tilt, degrees",
    "bow_mm": "registration: bow, mm",
    "total_ms": "time of an inspection, ms",
}
_CELLS = 60  # of the map, along its longer side


@dataclass(frozen=True, eq=False)
class Overview:
    """The figures of the page; all lists of layups are in the order of their records.

    Attributes
    ----------
    times
        Time of each inspection, ISO 8601, empty if not known.
    verdicts
        Name of each layup's verdict.
    pockets
        For each verdict's name, (N,) number of a layup's pockets of that verdict.
    figures
        (N,) by the names in `FIGURES`; NaN where a layup has none.
    causes
        Number of layups by the check and its verdict.
    outcomes
        Number of pockets by predicted and measured verdict: of each pocket, the last that was measured or said.
    places
        For "all" and "CREASE", the number of such pockets per cell, on a grid in mold XY; empty without any pocket.
    versions, recipes
        Versions of debulk, and hashes of recipes, with the number of layups.
    """

    times: list[str]
    verdicts: list[str]
    pockets: dict[str, NDArray[np.int64]]
    figures: dict[str, NDArray[np.float64]]
    causes: dict[tuple[str, str], int]
    outcomes: dict[tuple[str, str], int]
    places: dict[str, Grid]
    versions: dict[str, int]
    recipes: dict[str, int]


def overview(connection: sqlite3.Connection, search: Search) -> Overview:
    """Read the figures of the layups that fit a search."""
    where, values = search.where()
    # A temporary table of the wanted records is joined faster than a condition is repeated.
    connection.execute("PRAGMA temp_store = MEMORY")
    connection.execute("CREATE TEMP TABLE wanted (record INTEGER PRIMARY KEY)")
    newest = f"SELECT record FROM layup WHERE {where} ORDER BY record DESC LIMIT ?"
    connection.execute(f"INSERT INTO wanted {newest}", (*values, search.limit))
    names = ", ".join(FIGURES)
    layups = connection.execute(
        f"SELECT record, time_utc, verdict, version, recipe, {names} FROM layup JOIN wanted USING (record) "
        "ORDER BY record"
    ).fetchall()
    columns = list(zip(*layups, strict=True)) or [()] * (5 + len(FIGURES))
    records = np.array(columns[0], dtype=np.int64)
    rows = connection.execute("SELECT record, verdict, x_mm, y_mm FROM pocket JOIN wanted USING (record)").fetchall()
    owners, kinds, x, y = (np.array(column) for column in zip(*rows, strict=True)) if rows else [np.array([])] * 4
    pockets = {
        str(kind): np.bincount(np.searchsorted(records, owners[kinds == kind].astype(np.int64)), minlength=len(records))
        for kind in np.unique(kinds)
    }
    return Overview(
        list(columns[1]),
        list(columns[2]),
        pockets,
        {name: np.array(column, dtype=np.float64) for name, column in zip(FIGURES, columns[5:], strict=True)},
        _counts(connection, "SELECT name, verdict, count(*) FROM cause JOIN wanted USING (record) GROUP BY 1, 2"),
        _counts(connection, _OUTCOMES),
        _places(x.astype(np.float64), y.astype(np.float64), kinds),
        _tally(columns[3]),
        _tally(columns[4]),
    )


# Of several outcomes of one pocket the last counts; SQLite takes the other columns from the row of the maximum.
_OUTCOMES = """SELECT predicted, measured, count(*) FROM
  (SELECT predicted, measured, max(outcome.record) FROM outcome JOIN wanted ON wanted.record = outcome.report
   GROUP BY report, pocket) GROUP BY 1, 2"""


def _counts(connection: sqlite3.Connection, query: str) -> dict[tuple[str, str], int]:
    return {(first, second): count for first, second, count in connection.execute(query)}


def _tally(names: tuple[str, ...]) -> dict[str, int]:
    found: dict[str, int] = {}
    for name in names:
        found[name] = found.get(name, 0) + 1
    return found


def _places(x: NDArray[np.float64], y: NDArray[np.float64], kinds: NDArray[np.str_]) -> dict[str, Grid]:
    """Count the centroids of all pockets, and of those that crease, in square cells."""
    known = np.isfinite(x) & np.isfinite(y)
    if not known.any():
        return {}
    x, y, kinds = x[known], y[known], kinds[known]
    low = np.array([x.min(), y.min()])
    extent = max(float(np.ptp(x)), float(np.ptp(y)), 100.0)
    cell = extent / _CELLS
    columns, rows = ((c - start) // cell for c, start in ((x, low[0]), (y, low[1])))
    shape = int(rows.max()) + 1, int(columns.max()) + 1
    flat = (rows * shape[1] + columns).astype(np.int64)

    def counted(chosen: NDArray[np.bool_]) -> Grid:
        counts = np.bincount(flat[chosen], minlength=shape[0] * shape[1]).reshape(shape)
        return Grid(counts.astype(np.float64), low + 0.5 * cell, cell)

    return {"all": counted(np.ones(len(flat), dtype=bool)), "CREASE": counted(kinds == "CREASE")}
