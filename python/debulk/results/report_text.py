"""The report as text, for the console."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

from debulk.results.advice import advice, hole_line, level_line
from debulk.results.deciding import worst_first
from debulk.results.edge_friction import edge_friction_line
from debulk.results.half_seen import half_seen_line
from debulk.results.number import number
from debulk.verdict import Verdict

if TYPE_CHECKING:
    from debulk.results.report import PocketReport, ReportData

_TEXTS = ("verdict", "range", "paper", "reason")  # aligned left
_SPARE = ("nodes", "time ms", "Δ mm", "paper", "RMS mm", "peak mm")  # left out first where there is no room
_LEAST_ROOM = 20  # characters in which a column of sentences is folded in its place


def figures(pocket: PocketReport, limit_mm: float | None) -> dict[str, str]:
    """Return a pocket's figures as displayed, by their headings; the ridge is the one that decides.

    `limit_mm` is that of a ridge's height, None if it is not known.
    """
    x, y = pocket.centroid_mm or (None, None)
    ridge = pocket.deciding_ridge
    return {
        "#": str(pocket.id),
        "verdict": pocket.verdict.name,
        "ridge mm": number(ridge.height_mm if ridge else None, 2),
        "range": ridge.spread if ridge else "",
        "margin": number(ridge.margin_mm(limit_mm) if ridge else None, 2),
        "x mm": number(x, 0),
        "y mm": number(y, 0),
        "area cm²": number(pocket.area_mm2 / 100, 2),
        "peak mm": number(pocket.peak_mm, 2),
        "Δ mm": number(pocket.spacing_mm, 2),
        "nodes": "–" if pocket.node_count is None else str(pocket.node_count),
        "RMS mm": number(pocket.rms_mm, 3),
        "paper": pocket.paper_verdict.name if pocket.paper_verdict else "–",
        "reason": pocket.reason,
        "time ms": number(pocket.runtime_ms, 1),
    }


def headline(report: ReportData, width: int | None = None) -> str:
    """Return the verdict and its reason."""
    return fold(f"{report.verdict.name}: {report.reason}", width)


def table(report: ReportData, width: int | None = None) -> str:
    """Return the verdict and a line for each pocket, the worst first; reasons stand below if the width has no room."""
    lines = [f"do: {deed}" for deed in advice(report)]
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
    rows = [figures(pocket, report.limit_mm) for pocket in worst_first(report.pockets)]
    return "\n".join(
        [
            headline(report, width),
            *(fold(line, width) for line in lines),
            *(_table(rows, width) if rows else []),
            *(fold(line, width) for line in after),
        ]
    )


def _table(rows: list[dict[str, str]], width: int | None) -> list[str]:
    headings = tuple(rows[0])
    texts, (reason, *spare) = map(headings.index, _TEXTS), map(headings.index, ("reason", *_SPARE))
    return columns([headings, *(tuple(row.values()) for row in rows)], set(texts), width, reason, spare)


def summary(report: ReportData, width: int | None = None) -> str:
    """Return what fits on a screen: the verdict, what to do, and the places at which to do it, the worst first."""
    deeds = advice(report)
    placed = [deed for deed in deeds if deed.pocket is not None]
    first = deeds.index(placed[0]) if placed else len(deeds)
    rows = [("#", "verdict", "ridge mm", "x mm", "y mm", "do")]
    for deed in placed:
        x, y = deed.place_mm or (None, None)
        pocket = report.pocket(deed.pocket or 0)
        ridge = pocket.deciding_ridge
        told = f"{deed.do}: {deed.amount}" if deed.amount else deed.do
        height = number(ridge.height_mm if ridge else None, 2)
        rows.append((str(pocket.id), pocket.verdict.name, height, number(x, 0), number(y, 0), told))
    ceasing = sum(p.verdict is Verdict.CEASE for p in report.pockets)
    more = [f"{ceasing} pocket{'s' * (ceasing > 1)} CEASE"] if ceasing and report.verdict is not Verdict.CEASE else []
    more += [f"{count} left out"] if (count := len(report.left_out)) else []
    return "\n".join(
        [
            headline(report, width),
            *(fold(f"do: {deed}", width) for deed in deeds[:first]),
            *(columns(rows, {1, 5}, width, 5) if placed else []),
            *(fold(f"do: {deed}", width) for deed in deeds[first + len(placed) :]),
            *(fold(f"warning: {warning}", width) for warning in report.warnings),
            *([f"{', '.join(more)}: --details"] if more else []),
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

    If the rows are wider than `width`, the column `reason` is folded, in its place where it is the last one and has
    room, otherwise below its row; and as many of the columns `spare` as needed are left out, the first ones first.

    Examples
    --------
    >>> columns([("#", "do"), ("7", "smooth the ply, and scan again")], {1}, 25, 1)
    ['#  do', '7  smooth the ply, and', '   scan again']
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    left_out: set[int] = set()

    def cells_of(row: tuple[str, ...]) -> list[str]:
        each = enumerate(zip(row, widths, strict=True))
        return [c.ljust(w) if k in text else c.rjust(w) for k, (c, w) in each if k not in left_out]

    def room() -> int:
        kept = [w for k, w in enumerate(widths) if k not in left_out]
        return sum(kept) + 2 * len(kept) - 2

    last = sum(widths[:-1]) + 2 * len(widths[:-1])
    if width is not None and reason == len(widths) - 1 and width - last >= _LEAST_ROOM:
        lines = []
        for row in rows:
            folded = textwrap.wrap(row[-1], width - last) or [""]
            lines.append("  ".join([*cells_of(row)[:-1], folded[0]]).rstrip())
            lines += [" " * last + more for more in folded[1:]]
        return lines
    if width is not None:
        for k in () if reason is None else (reason, *spare):
            if room() > width:
                left_out.add(k)
    lines = []
    for row_number, row in enumerate(rows):
        lines.append("  ".join(cells_of(row)).rstrip())
        if row_number and reason in left_out and reason is not None and width is not None:
            indent = " " * (widths[0] + 2)
            lines += textwrap.wrap(row[reason], width, initial_indent=indent, subsequent_indent=indent)
    return lines
