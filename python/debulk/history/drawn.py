"""The drawings of a history's page as SVG; their markup contains nothing from a report but numbers and dates."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk.grid import Grid
from debulk.history.control import BY_CHANCE, RULES, Control
from debulk.page.map_marks import ticks
from debulk.page.scales import nice
from debulk.verdict import Verdict

_WIDTH, _HEIGHT = 720.0, 190.0
_LEFT, _RIGHT, _TOP, _BOTTOM = 52.0, 8.0, 10.0, 24.0
_COLUMNS = 90  # most bars or strokes side by side
_DATES = 6
_DATE = re.compile(r"\d{4}-\d\d-\d\d")


class Drawing(NamedTuple):
    """A drawing: title, size, markup, and what has to be said below it."""

    title: str
    width: float
    height: float
    markup: str
    note: str = ""


class _Frame(NamedTuple):
    """Where values stand: columns from left to right, and figures from low to high."""

    columns: int
    low: float
    high: float

    def x(self, column: float) -> float:
        return _LEFT + (_WIDTH - _LEFT - _RIGHT) * column / max(self.columns, 1)

    def y(self, value: float) -> float:
        share = (value - self.low) / (self.high - self.low)
        return _HEIGHT - _BOTTOM - (_HEIGHT - _TOP - _BOTTOM) * share

    def axes(self, times: Sequence[str]) -> str:
        """Draw lines and figures, and a date below some of the columns, of which each has a time."""
        step = nice((self.high - self.low) / 4)
        parts = []
        for k in range(math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9) + 1):
            at = self.y(k * step)
            parts.append(f'<path class="grid" d="M{_LEFT:.0f} {at:.1f}H{_WIDTH - _RIGHT:.0f}"/>')
            parts.append(f'<text x="{_LEFT - 6:.0f}" y="{at + 4:.1f}" text-anchor="end">{_figure(k * step)}</text>')
        last = ""
        for column in range(0, len(times), max(1, math.ceil(len(times) / _DATES))):
            date = _DATE.match(times[column])
            if date and date[0] != last:
                last = date[0]
                parts.append(f'<text x="{self.x(column):.1f}" y="{_HEIGHT - 6:.0f}">{last}</text>')
        return "".join(parts)


def _figure(value: float) -> str:
    return f"{value:.6g}".replace("-", "−")


def _starts(count: int) -> NDArray[np.int64]:
    """Return the first layup of each column."""
    return np.unique(np.linspace(0, count, min(count, _COLUMNS) + 1).astype(np.int64)[:-1])


def stacked(times: Sequence[str], verdicts: Sequence[str], pockets: dict[str, NDArray[np.int64]]) -> Drawing | None:
    """Draw the mean number of pockets per layup over time, by verdict; None without any layup.

    A layup that is INVALID may show no pocket, as a good one does: a stroke below the axis tells them apart.
    """
    if not times:
        return None
    starts = _starts(len(times))
    sizes = np.diff([*starts, len(times)])
    order = [v for v in (Verdict.CREASE, Verdict.UNDECIDED, Verdict.INVALID, Verdict.CEASE) if v.name in pockets]
    means = {v: np.add.reduceat(pockets[v.name], starts) / sizes for v in order}
    top = max([float(sum(means.values()).max()), 1.0] if means else [1.0])  # type: ignore[union-attr]
    frame = _Frame(len(starts), 0.0, 1.05 * top)
    below = np.zeros(len(starts))
    parts = [frame.axes([times[start] for start in starts])]
    for verdict, mean in means.items():
        for column, (low, value) in enumerate(zip(below, mean, strict=True)):
            if value > 0:
                a, b = frame.x(column + 0.08), frame.x(column + 0.92)
                y, height = frame.y(low + value), frame.y(low) - frame.y(low + value)
                parts.append(
                    f'<rect class="{verdict.value}" x="{a:.1f}" y="{y:.1f}" width="{b - a:.1f}" height="{height:.1f}"/>'
                )
        below = below + mean
    invalid = np.array(verdicts) == Verdict.INVALID.name
    for column in np.flatnonzero(np.logical_or.reduceat(invalid, starts)).tolist():
        a, b = frame.x(column + 0.08), frame.x(column + 0.92)
        parts.append(f'<rect class="invalid" x="{a:.1f}" y="{frame.y(0) + 2:.1f}" width="{b - a:.1f}" height="4"/>')
    each = "is a layup" if sizes.max() == 1 else f"is the mean of {_span(sizes)}"
    note = f"Each bar {each}, in the order in which they were stored."
    if invalid.any():
        note += " A stroke below the axis: there a layup is INVALID, whose pockets were not judged, or not even sought."
    return Drawing("Pockets per layup", _WIDTH, _HEIGHT, "".join(parts), note)


def _span(sizes: NDArray[np.int64]) -> str:
    low, high = int(sizes.min()), int(sizes.max())
    return f"{low} layups" if low == high else f"{low} or {high} layups"


def chart(title: str, times: Sequence[str], control: Control) -> Drawing | None:
    """Draw a control chart; None if no layup has this figure."""
    known = np.flatnonzero(np.isfinite(control.values))
    if not len(known):
        return None
    figures, starts = control.values[known], _starts(len(known))
    least, most = np.minimum.reduceat(figures, starts), np.maximum.reduceat(figures, starts)
    pointed = np.any([found[known] for found in control.signals.values()], axis=0)
    sizes = np.diff([*starts, len(known)])
    chance = BY_CHANCE * sizes + 3 * np.sqrt(BY_CHANCE * sizes)
    signalled = np.add.reduceat(pointed.astype(np.int64), starts) > chance
    mean = np.add.reduceat(figures, starts) / sizes
    lines = [control.middle, *(control.limits or ())]
    ends = [float(least.min()), float(most.max()), *(line for line in lines if line is not None)]
    room = 0.06 * (max(ends) - min(ends)) or 0.5
    frame = _Frame(len(starts), min(ends) - room, max(ends) + room)
    parts = [frame.axes([times[known[start]] for start in starts])]
    for name, line in zip(("middle", "limit", "limit"), lines, strict=False):
        if line is not None:
            parts.append(f'<path class="{name}" d="M{_LEFT:.0f} {frame.y(line):.1f}H{_WIDTH - _RIGHT:.0f}"/>')
    middles = [frame.x(column + 0.5) for column in range(len(starts))]
    spread = "".join(
        f"M{x:.1f} {frame.y(a):.1f}V{frame.y(b):.1f}" for x, a, b in zip(middles, least, most, strict=True) if b > a
    )
    if spread:
        parts.append(f'<path class="spread" d="{spread}"/>')
    parts.append(f'<path class="mean" d="M{"L".join(_at(frame, x, y) for x, y in zip(middles, mean, strict=True))}"/>')
    for x, y, flag in zip(middles, mean, signalled, strict=True):
        parts.append(
            f'<circle class="{"signal" if flag else "dot"}" cx="{x:.1f}" cy="{frame.y(y):.1f}" r="{4 if flag else 2}"/>'
        )
    return Drawing(title, _WIDTH, _HEIGHT, "".join(parts), _said(control))


def _at(frame: _Frame, x: float, y: float) -> str:
    return f"{x:.1f} {frame.y(y):.1f}"


def _said(control: Control) -> str:
    if control.limits is None:
        return f"No limits: only {control.baseline} layups have this figure, 20 are needed."
    low, high = (_figure(float(f"{value:.4g}")) for value in control.limits)
    middle = _figure(float(f"{control.middle:.4g}"))
    found = [f"{int(at.sum())} × {RULES[name]}" for name, at in control.signals.items() if at.any()]
    limits = f"Middle {middle}, limits {low} to {high}, from the first {control.baseline}."
    return f"{limits} {'Signals: ' + '; '.join(found) + '.' if found else 'No signal.'}"


def place_map(title: str, counts: Grid) -> Drawing:
    """Draw how many pockets had their centroid in each cell of the mold."""
    ny, nx = counts.values.shape
    cell, most = counts.spacing_mm, max(float(counts.values.max()), 1.0)
    low = np.asarray(counts.origin_mm) - 0.5 * cell
    width, height = nx * cell, ny * cell
    font = 0.035 * max(width, height)
    left, bottom = 3.2 * font, 1.8 * font
    parts = []
    for j, i in np.argwhere(counts.values > 0).tolist():
        count = int(counts.values[j, i])
        share = 0.12 + 0.88 * math.sqrt(count / most)
        x, y = left + i * cell, height - (j + 1) * cell
        parts.append(
            f'<rect class="cell" x="{x:.1f}" y="{y:.1f}" width="{cell:.1f}" height="{cell:.1f}" '
            f'fill-opacity="{share:.2f}"><title>{count}</title></rect>'
        )
    spacing = nice(max(width, height) / 8)
    style = f'style="font-size:{font:.1f}px"'
    for tick in ticks(float(low[0]), float(low[0]) + width, spacing, 1):
        x = left + tick.at - float(low[0])
        parts.append(f'<text {style} x="{x:.1f}" y="{height + 1.3 * font:.1f}" text-anchor="middle">{tick.text}</text>')
    for tick in ticks(float(low[1]), float(low[1]) + height, spacing, 1):
        y = height - tick.at + float(low[1])
        parts.append(f'<text {style} x="{left - 0.4 * font:.1f}" y="{y:.1f}" text-anchor="end">{tick.text}</text>')
    frame = f'<rect class="frame" x="{left:.1f}" y="0" width="{width:.1f}" height="{height:.1f}"/>'
    note = f"{int(counts.values.sum())} pockets; the darkest cell of {cell:.3g} mm has {int(most)}. Mold frame, mm."
    return Drawing(title, left + width + font, height + bottom, frame + "".join(parts), note)
