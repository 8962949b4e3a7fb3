"""What the page of a history shows, read from its tables: counts and figures, and no report."""

from __future__ import annotations

import sqlite3
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk.grid import Grid
from debulk.history.search import Search
from debulk.history.tables import counting_outcomes

FIGURES = {
    "noise_mm": "noise of the height map, mm",
    "level_mm": "level: ply between the pockets less its thickness, mm",
    "offset_mm": "registration: offset, mm",
    "tilt_deg": "registration: tilt, degrees",
    "bow_mm": "registration: bow, mm",
    "total_ms": "time of an inspection, ms",
}
_CELLS = 60  # of the map at most, along its longer side
_FINE_MM, _FAR_MM = 20.0, 1e6
_OFFSET = round(_FAR_MM / _FINE_MM)
_KNOWN = ("time_utc", "verdict", "version", "recipe")
_COUNTS = {"pockets": "", "creasing": "CREASE", "undecided": "UNDECIDED", "unjudged": "INVALID"}


@dataclass(frozen=True, eq=False)
class Overview:
    """The figures of the page; all lists of layups are in the order of their records."""

    times: list[str]
    """Time of each inspection, ISO 8601, empty if not known."""
    verdicts: list[str]
    """Name of each layup's verdict."""
    pockets: dict[str, NDArray[np.int64]]
    """For each verdict's name, (N,) number of a layup's pockets of that verdict."""
    figures: dict[str, NDArray[np.float64]]
    """(N,) by the names in `FIGURES`; NaN where a layup has none."""
    chain: dict[str, NDArray[np.float64]]
    """(N,) figures of the scans' signatures by their titles, of layups whose chain was given."""
    causes: dict[tuple[str, str], int]
    """Number of layups by the check and its verdict."""
    outcomes: dict[tuple[str, str], int]
    """Number of pockets by predicted and measured verdict: of each pocket the one that counts, as for
    `debulk.learning.calibrate`."""
    places: dict[str, Grid]
    """For "all" and "CREASE", the number of such pockets per cell, on a grid in mold XY; empty without any pocket."""
    versions: Mapping[str, int]
    recipes: Mapping[str, int]
    """`versions`, `recipes`: versions of debulk, and hashes of recipes, with the number of layups."""


def overview(connection: sqlite3.Connection, search: Search) -> Overview:
    """Read the figures of the layups that fit a search."""
    connection.execute("PRAGMA temp_store = MEMORY")
    connection.execute("CREATE TEMP TABLE wanted (record INTEGER PRIMARY KEY)")
    where, values = search.where(connection)
    newest = f"SELECT record FROM layup WHERE {where} ORDER BY record DESC LIMIT ?"
    connection.execute(f"INSERT INTO wanted {newest}", (*values, search.limit))
    every = connection.execute("SELECT count(*) FROM layup").fetchone()
    all_wanted = connection.execute("SELECT count(*) FROM wanted").fetchone() == every
    names = ", ".join(("record", *_KNOWN, *_COUNTS, *FIGURES))
    rows = connection.execute(f"SELECT {names} FROM layup JOIN wanted USING (record) ORDER BY record").fetchall()
    read = dict(zip(("record", *_KNOWN, *_COUNTS, *FIGURES), zip(*rows, strict=True), strict=True)) if rows else {}
    counts = {name: np.array(read.get(name, ()), dtype=np.int64) for name in _COUNTS}
    judged = {verdict: counts[name] for name, verdict in _COUNTS.items() if verdict}
    judged["CEASE"] = counts["pockets"] - sum(judged.values())

    def of(column: str) -> str:
        return "1" if all_wanted else f"{column} IN (SELECT record FROM wanted)"

    return Overview(
        list(read.get("time_utc", ())),
        list(read.get("verdict", ())),
        {verdict: number for verdict, number in judged.items() if number.any()},
        {name: np.array(read.get(name, ()), dtype=np.float64) for name in FIGURES},
        _chain(connection, read.get("record", ())),
        _pairs(connection, f"SELECT name, verdict, count(*) FROM cause WHERE {of('record')} GROUP BY 1, 2"),
        _pairs(
            connection,
            f"SELECT predicted, measured, count(*) FROM ({counting_outcomes(of('report'))}) GROUP BY 1, 2",
        ),
        _places(connection, of("record")),
        Counter(read.get("version", ())),
        Counter(read.get("recipe", ())),
    )


def _chain(connection: sqlite3.Connection, records: Sequence[int]) -> dict[str, NDArray[np.float64]]:
    """Return the figures of the signatures in the order of the records, with the limits that the last one had."""
    place = {record: k for k, record in enumerate(records)}
    found: dict[tuple[str, str], NDArray[np.float64]] = {}
    spans: dict[tuple[str, str], str] = {}
    for record, says, unit, *figures in connection.execute("SELECT * FROM chain ORDER BY record, rowid"):
        if record in place:
            measured, *limits = (np.nan if figure is None else figure for figure in figures)
            found.setdefault((says, unit), np.full(len(records), np.nan))[place[record]] = measured
            ends = zip(("from", "to"), limits, strict=True)
            spans[says, unit] = " ".join(f"{word} {limit:.3g}" for word, limit in ends if np.isfinite(limit))
    return {
        f"chain: {says}{', ' * bool(unit)}{unit}{f' (qualified {span})' * bool(span)}": found[says, unit]
        for (says, unit), span in spans.items()
    }


def _pairs(connection: sqlite3.Connection, query: str) -> dict[tuple[str, str], int]:
    return {(first, second): count for first, second, count in connection.execute(query)}


def _places(connection: sqlite3.Connection, wanted: str) -> dict[str, Grid]:
    """Count the centroids of all pockets, and of those that crease, in square cells."""
    # Counted in fine cells first, for which one pass is enough, and which only widths of many metres would join.
    x, y = (f"CAST({axis}_mm / {_FINE_MM:g} + {_OFFSET} AS INTEGER)" for axis in "xy")
    rows = connection.execute(
        f"SELECT {x} * {2 * _OFFSET} + {y}, count(*), sum(verdict = 'CREASE') FROM pocket "
        f"WHERE abs(x_mm) < {_FAR_MM:g} AND abs(y_mm) < {_FAR_MM:g} AND {wanted} GROUP BY 1"
    ).fetchall()
    if not rows:
        return {}
    cells, every, creasing = np.array(rows, dtype=np.int64).T
    columns, lines = np.divmod(cells, 2 * _OFFSET)
    low = columns.min(), lines.min()
    coarser = max(1, -(-max(int(np.ptp(columns)) + 1, int(np.ptp(lines)) + 1) // _CELLS))
    i, j = (columns - low[0]) // coarser, (lines - low[1]) // coarser
    spacing = coarser * _FINE_MM
    origin = (np.array(low) - _OFFSET) * _FINE_MM + 0.5 * spacing

    def counted(numbers: NDArray[np.int64]) -> Grid:
        counts = np.zeros((int(j.max()) + 1, int(i.max()) + 1))
        np.add.at(counts, (j, i), numbers)
        return Grid(counts, origin, spacing)

    return {"all": counted(every), "CREASE": counted(creasing)}
