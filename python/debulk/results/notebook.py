"""Reports as notebooks show them: small self-contained pieces of HTML, for light and dark themes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING

from debulk.results.advice import advice
from debulk.results.deciding import worst_first
from debulk.results.looks import VERDICT_COLOURS, VERDICT_SIGNS
from debulk.results.number import number
from debulk.results.report_text import figures
from debulk.verdict import Verdict

if TYPE_CHECKING:
    from debulk.results.comparison import ComparisonData
    from debulk.results.report import PocketReport, ReportData

_SHOWN = ("#", "verdict", "ridge mm", "range", "margin", "x mm", "y mm", "area cm²", "peak mm", "reason")


def report_html(report: ReportData) -> str:
    """Return the verdict, what to do, and a row for each pocket."""
    pockets = worst_first(report.pockets)
    rows = [[figures(pocket, report.limit_mm)[name] for name in _SHOWN] for pocket in pockets]
    deeds = "".join(f"<div>do: {escape(str(deed))}</div>" for deed in advice(report))
    table = _table(_SHOWN, rows, [pocket.verdict for pocket in pockets]) if rows else ""
    return f"<div>{_headline(report.verdict, report.reason)}{deeds}{table}</div>"


def pocket_html(pocket: PocketReport) -> str:
    """Return the verdict of a pocket, and its figures."""
    shown = figures(pocket, None)
    del shown["reason"], shown["margin"]  # the limit stands in the report
    headline = _headline(pocket.verdict, f"pocket {pocket.id}: {pocket.reason}")
    return f"<div>{headline}{_table(shown, [list(shown.values())], [pocket.verdict])}</div>"


def comparison_html(comparison: ComparisonData) -> str:
    """Return the outcome, the hit rate, and a row for each pocket."""
    names = ("#", "RMS mm", "measured RMS mm", "ridge mm", "measured peak mm", "predicted", "verdict", "reason")
    rows = [
        [
            str(p.id),
            number(p.predicted_rms_mm, 3),
            number(p.measured_rms_mm, 3),
            number(p.predicted_ridge_mm, 2),
            number(p.measured_peak_mm, 2),
            p.predicted.name,
            p.measured.name,
            p.reason,
        ]
        for p in comparison.pockets
    ]
    table = _table(names, rows, [p.measured for p in comparison.pockets]) if rows else ""
    headline, rate = escape(comparison.headline), escape(str(comparison.agreement))
    return f"<div><div><b>{headline}</b></div><div>{rate}</div>{table}</div>"


def _headline(verdict: Verdict, reason: str) -> str:
    return f"<div>{_coloured(verdict, verdict.name)} {escape(reason)}</div>"


def _coloured(verdict: Verdict, text: str) -> str:
    """Return the text in bold after the verdict's sign in its colour, because coloured letters are hard to read."""
    return f'<b><span style="color:{VERDICT_COLOURS[verdict]}">{VERDICT_SIGNS[verdict]}</span>&nbsp;{escape(text)}</b>'


def _table(names: Iterable[str], rows: Sequence[Sequence[str]], verdicts: Sequence[Verdict]) -> str:
    """Return a table with figures aligned right and the column "verdict" in its colour."""
    names = list(names)
    lines = ["".join(f"<th>{escape(name)}</th>" for name in names)]
    for row, verdict in zip(rows, verdicts, strict=True):
        lines.append("".join(_cell(name, value, verdict) for name, value in zip(names, row, strict=True)))
    return "<table>" + "".join(f"<tr>{line}</tr>" for line in lines) + "</table>"


def _cell(name: str, value: str, verdict: Verdict) -> str:
    if name == "verdict":
        return f"<td>{_coloured(verdict, value)}</td>"
    side = "left" if name in ("reason", "range") else "right"
    return f'<td style="text-align:{side}">{escape(value)}</td>'
