"""Bar charts of the pockets' figures, as the pages show them."""

from __future__ import annotations

from typing import NamedTuple

from debulk.page.render import LOOKS
from debulk.results.number import number
from debulk.verdict import Verdict


class Bar(NamedTuple):
    """One line of a bar chart; positions are in percent of the chart's width."""

    label: str
    text: str
    percent: float
    verdict: str = ""
    sign: str = ""
    low: float | None = None
    high: float | None = None
    measured: float | None = None


class Chart(NamedTuple):
    """A bar chart with an optional limit."""

    title: str
    bars: list[Bar]
    limit_percent: float | None = None
    limit_text: str = ""
    note: str = ""
    wide: bool = False


class Row(NamedTuple):
    """The values behind one bar of a chart of pockets, mm."""

    id: int
    verdict: Verdict
    value: float | None
    span: tuple[float, float] | None = None
    measured: float | None = None


def bar_chart(
    title: str, rows: list[Row], limit: float | None, digits: int, note: str = "", floor: float = 0.0
) -> Chart:
    """Chart the pockets' figures from the `floor`, where bars start, to the largest figure or past the limit."""
    tops = [top for row in rows for top in (row.value, row.measured, row.span and row.span[1]) if top is not None]
    full = max([*tops, floor + 1.15 * (limit - floor) if limit else 0.0])
    full = full if full > floor else floor + 1.0

    def at(value: float) -> float:
        return max(0.0, 100 * (value - floor) / (full - floor))

    def bar(row: Row) -> Bar:
        low, high = (at(s) for s in row.span) if row.span and row.span[1] > row.span[0] else (None, None)
        percent = 0.0 if row.value is None else at(row.value)
        measured = None if row.measured is None else at(row.measured)
        text, sign = number(row.value, digits), LOOKS[row.verdict].sign
        if row.measured is not None:
            text += f" ◆ {number(row.measured, digits)}"
        return Bar(str(row.id), text, percent, row.verdict.value, sign, low, high, measured)

    bars, limit_at = [bar(row) for row in rows], at(limit) if limit else None
    wide = any(row.measured is not None for row in rows)
    return Chart(title, bars, limit_at, f"limit {limit:.2f} mm" if limit else "", note, wide)
