"""The report as text: the console's table, and CSV."""

from __future__ import annotations

import csv
import io
import textwrap
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from debulk.results.advice import advice, hole_line, level_line
from debulk.results.edge_friction import edge_friction_line
from debulk.results.half_seen import half_seen_line

if TYPE_CHECKING:
    from debulk.results.report import PocketReport, ReportData
    from debulk.results.ridge import RidgeGeometry

HEADINGS = (
    "#", "x mm", "y mm", "area cm²", "peak mm", "Δ mm", "nodes", "by ΔL mm", "elastic mm", "RMS mm", "ridge mm",
    "paper", "verdict", "reason", "time ms",
)  # fmt: skip
_TEXT_COLUMNS = {11, 12, 13}
_SPARE = tuple(HEADINGS.index(name) for name in ("nodes", "time ms", "Δ mm", "paper", "RMS mm", "peak mm"))


class Figures(NamedTuple):
    """A pocket's figures as displayed."""

    id: str
    x_mm: str
    y_mm: str
    area_cm2: str
    peak_mm: str
    spacing_mm: str
    nodes: str
    by_excess_mm: str
    elastic_mm: str
    rms_mm: str
    ridge_mm: str
    paper_verdict: str
    verdict: str
    reason: str
    time_ms: str


def number(value: float | None, digits: int) -> str:
    """Return a figure with the given number of decimals, or a dash if there is none."""
    # Adding zero turns the -0.0 that rounding makes of a tiny negative figure into 0.0.
    return "–" if value is None else f"{round(value, digits) + 0.0:.{digits}f}"


def figures(pocket: PocketReport) -> Figures:
    """Round a pocket's figures for display."""
    x, y = pocket.centroid_mm or (None, None)
    return Figures(
        str(pocket.id),
        number(x, 0),
        number(y, 0),
        number(pocket.area_mm2 / 100, 2),
        number(pocket.peak_mm, 2),
        number(pocket.spacing_mm, 2),
        "–" if pocket.node_count is None else str(pocket.node_count),
        number(pocket.excess.height_mm if pocket.excess else None, 2),
        number(pocket.elastic_mm, 2),
        number(pocket.rms_mm, 3),
        number(pocket.ridge_height_mm, 2),
        pocket.paper_verdict.name if pocket.paper_verdict else "–",
        pocket.verdict.name,
        pocket.reason,
        number(pocket.runtime_ms, 1),
    )


def headline(report: ReportData, width: int | None = None) -> str:
    """Return the verdict and its reason."""
    return fold(f"{report.verdict.name}: {report.reason}", width)


def table(report: ReportData, width: int | None = None) -> str:
    """Return the verdict and a line for each pocket, with the reasons below if the width has no room for them."""
    lines = [f"do: {line}" for line in advice(report)]
    after = [f"pocket {p.id} is judged: {p.promoted}" for p in report.pockets if p.promoted]
    after += [f"pocket {p.id} {half_seen_line(p.half_seen)}" for p in report.pockets if p.half_seen]
    after += [f"pocket {p.id} {edge_friction_line(p.edge_friction)}" for p in report.pockets if p.edge_friction]
    if report.level is not None:
        after.append(f"level: {level_line(report.level)}")
    for hole in report.unseen:
        worst = f", so the layup is {hole.at_best.name} at best" if hole.at_best else ""
        after.append(f"unseen: {hole_line(hole)}{worst}")
    after += [f"warning: {warning}" for warning in report.warnings]
    for entry in report.left_out:
        after.append(f"left out: {entry.what}: {entry.why}" + (f" ({entry.bound})" if entry.bound else ""))
    if report.timings_ms:
        after.append("times: " + ", ".join(f"{stage} {ms:.0f} ms" for stage, ms in report.timings_ms.items()))
    rows = [HEADINGS, *(tuple(figures(pocket)) for pocket in report.pockets)] if report.pockets else []
    return "\n".join(
        [
            headline(report, width),
            *(fold(line, width) for line in lines),
            *(columns(rows, _TEXT_COLUMNS, width, HEADINGS.index("reason"), _SPARE) if rows else []),
            *(fold(line, width) for line in after),
        ]
    )


def fold(line: str, width: int | None) -> str:
    """Fold a line to a width, if one is given; continuation lines are indented, and no word is broken."""
    if width is None:
        return line
    return textwrap.fill(line, width, subsequent_indent="    ", break_on_hyphens=False, break_long_words=False)


def columns(
    rows: Sequence[tuple[str, ...]],
    text: set[int],
    width: int | None = None,
    reason: int | None = None,
    spare: Sequence[int] = (),
) -> list[str]:
    """Lay out rows in columns; those whose numbers are in `text` are aligned left.

    If the rows are wider than `width`, the column `reason` is folded below its row, and as many of the columns `spare`
    as needed are left out, the first ones first.
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    left_out: set[int] = set()

    def room() -> int:
        kept = [w for k, w in enumerate(widths) if k not in left_out]
        return sum(kept) + 2 * len(kept) - 2

    if width is not None:
        for k in () if reason is None else (reason, *spare):
            if room() > width:
                left_out.add(k)
    lines = []
    for number, row in enumerate(rows):
        cells = [
            c.ljust(w) if k in text else c.rjust(w)
            for k, (c, w) in enumerate(zip(row, widths, strict=True))
            if k not in left_out
        ]
        lines.append("  ".join(cells).rstrip())
        if number and reason in left_out and reason is not None and width is not None:
            indent = " " * (widths[0] + 2)
            lines += textwrap.wrap(row[reason], width, initial_indent=indent, subsequent_indent=indent)
    return lines


CSV_COLUMNS = (
    "id", "verdict", "reason", "decided_by", "paper_verdict", "x_mm", "y_mm", "area_mm2", "peak_mm", "volume_mm3",
    "measured_share",
    "touches_ply_edge", "spacing_mm", "node_count", "rms_mm", "rms_low_mm", "rms_high_mm", "ridge_height_mm",
    "ridge_low_mm", "ridge_high_mm", "ridge_length_mm", "excess_length_mm", "excess_ridge_mm", "excess_ridge_low_mm",
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
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(CSV_COLUMNS)
    for pocket in report.pockets:
        writer.writerow([cell(figure(pocket, name)) for name in CSV_COLUMNS])
    return text.getvalue()


def figure(pocket: PocketReport, name: str) -> Any:
    """Return a figure by the name of its column; None if the pocket has no such figure."""
    if name.startswith("excess_ridge"):
        excess = pocket.excess
        if excess is None:
            return None
        return excess.height_mm if name == "excess_ridge_mm" else excess.range_mm[name.endswith("high_mm")]
    if name in ("rms_low_mm", "rms_high_mm", "ridge_low_mm", "ridge_high_mm"):
        span = pocket.rms_range_mm if name.startswith("rms") else pocket.ridge_range_mm
        return None if span is None else span[name.endswith("high_mm")]
    if name in _OF_RIDGE:
        return _OF_RIDGE[name](pocket.ridges[0]) if pocket.ridges else None
    if name in ("x_mm", "y_mm"):
        return None if pocket.centroid_mm is None else pocket.centroid_mm["xy".index(name[0])]
    if hasattr(pocket, name):
        return getattr(pocket, name)
    return getattr(pocket.solve, {"solver": "method"}.get(name, name)) if pocket.solve else None


def cell(value: Any) -> Any:
    """Return a value in the form for CSV."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
        # A spreadsheet takes text that starts with one of these characters for a formula.
    if isinstance(value, str) and value.startswith(("=", "+", "-", "@", "\t", "\r")):
        return "'" + value
    return value
