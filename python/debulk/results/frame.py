"""A report as a pandas table (the extra "pandas"); pandas is imported only here."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from debulk.results.extras import imported
from debulk.results.report_csv import CSV_COLUMNS, figure
from debulk.verdict import Verdict

if TYPE_CHECKING:
    import pandas

    from debulk.results.report import PocketReport, ReportData

_WORDS = {
    "verdict", "reason", "decided_by", "paper_verdict", "ridge_by", "solver", "status", "touches_ply_edge", "certified",
}  # fmt: skip


def to_dataframe(report: ReportData) -> pandas.DataFrame:
    """Return a row for each pocket, with its number as the index and the columns of the .csv."""
    pandas = imported("pandas", "pandas", "to_dataframe")
    rows = [{name: _value(pocket, name, report.limit_mm) for name in CSV_COLUMNS} for pocket in report.pockets]
    return pandas.DataFrame(rows, columns=list(CSV_COLUMNS)).set_index("id")


def _value(pocket: PocketReport, name: str, limit_mm: float | None) -> Any:
    """Return a figure (NaN if a pocket has none) or a word (None if it has none)."""
    value = figure(pocket, name, limit_mm)
    if isinstance(value, Verdict):
        return value.name
    return math.nan if value is None and name not in _WORDS else value
