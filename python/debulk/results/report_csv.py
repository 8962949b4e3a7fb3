"""The pockets of a report as CSV, and each figure by the name of its column."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from debulk.results.report import PocketReport, ReportData
    from debulk.results.ridge import RidgeGeometry

CSV_COLUMNS = (
    "id", "verdict", "reason", "decided_by", "paper_verdict", "x_mm", "y_mm", "area_mm2", "peak_mm", "volume_mm3",
    "measured_share", "touches_ply_edge", "ridge_mm", "ridge_low_mm", "ridge_high_mm", "ridge_by", "margin_mm",
    "spacing_mm", "node_count", "rms_mm", "rms_low_mm", "rms_high_mm", "net_ridge_mm", "net_ridge_low_mm",
    "net_ridge_high_mm", "ridge_length_mm", "excess_length_mm", "excess_ridge_mm", "excess_ridge_low_mm",
    "excess_ridge_high_mm", "elastic_mm", "ridge_x_mm", "ridge_y_mm", "ridge_spread_mm", "ridge_direction_deg",
    "ridge_mirrored_deg", "ridge_line_mm", "ridge_slope_deg", "energy_mj", "solver", "status", "certified",
    "iterations", "evaluations", "length_error", "penetration_mm", "kkt_error", "runtime_ms",
)  # fmt: skip

# Figures of the decisive ridge; its length is that of its line, `ridge_length_mm` that of the net's longest ridge.
_OF_RIDGE: dict[str, Callable[[RidgeGeometry], float | None]] = {
    "ridge_x_mm": lambda ridge: ridge.middle_mm[0],
    "ridge_y_mm": lambda ridge: ridge.middle_mm[1],
    "ridge_spread_mm": lambda ridge: ridge.place_spread_mm,
    "ridge_direction_deg": lambda ridge: ridge.direction_deg,
    "ridge_mirrored_deg": lambda ridge: ridge.mirrored_deg,
    "ridge_line_mm": lambda ridge: ridge.length_mm,
    "ridge_slope_deg": lambda ridge: ridge.slope_deg,
}


def csv_text(report: ReportData) -> str:
    """Return a line for each pocket, with units in the header and an empty cell for a missing figure."""
    return written(
        CSV_COLUMNS, ([figure(pocket, name, report.limit_mm) for name in CSV_COLUMNS] for pocket in report.pockets)
    )


def written(columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """Return rows as CSV below the names of their columns."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_cell(value) for value in row] for row in rows)
    return text.getvalue()


def figure(pocket: PocketReport, name: str, limit_mm: float | None = None) -> Any:
    """Return a figure by the name of its column; None if the pocket has no such figure.

    The ridge without a prefix is the one that decides; `limit_mm` is that of its height.
    """
    excess, ridge, solve = pocket.excess, pocket.deciding_ridge, pocket.solve
    spans = {
        "rms": pocket.rms_range_mm,
        "net_ridge": pocket.ridge_range_mm,
        "excess_ridge": excess.range_mm if excess else None,
        "ridge": ridge.range_mm if ridge else None,
    }
    for end, ending in enumerate(("_low_mm", "_high_mm")):
        if name.endswith(ending):
            span = spans[name.removesuffix(ending)]
            return None if span is None else span[end]
    match name:
        case "ridge_mm":
            return ridge and ridge.height_mm
        case "ridge_by":
            return ridge and ridge.by
        case "margin_mm":
            return ridge and ridge.margin_mm(limit_mm)
        case "net_ridge_mm":
            return pocket.ridge_height_mm
        case "excess_ridge_mm":
            return excess and excess.height_mm
        case "x_mm" | "y_mm":
            return pocket.centroid_mm and pocket.centroid_mm["xy".index(name[0])]
    if name in _OF_RIDGE:
        return _OF_RIDGE[name](pocket.ridges[0]) if pocket.ridges else None
    if hasattr(pocket, name):
        return getattr(pocket, name)
    return getattr(solve, {"solver": "method"}.get(name, name)) if solve else None


def _cell(value: Any) -> Any:
    """Return a value in the form for CSV."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    # A spreadsheet takes text that starts with one of these characters for a formula.
    if isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r")):
        return "'" + value
    return value
