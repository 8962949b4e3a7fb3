"""The comparison as one HTML page: predictions against measurements."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from debulk.page.charts import Row, bar_chart
from debulk.page.map import Area, ply_map
from debulk.page.map_ridges import Ridge, ridge_path
from debulk.page.measured_ridges import measured_ridges
from debulk.page.render import render
from debulk.page.report import recipe_lists
from debulk.page.scales import nice
from debulk.page.trace import comparison_lists, identity_of, title_block
from debulk.results.number import number
from debulk.verdict import Verdict

if TYPE_CHECKING:
    from debulk.results.comparison import ComparisonData, PocketComparison

_SIZE = 360.0  # size of the scatter plot
_LEFT, _BOTTOM, _TOP = 44.0, 40.0, 22.0


class Scatter(NamedTuple):
    """A square plot; its markup contains nothing from the report but numbers."""

    size: float
    markup: str


def page(comparison: ComparisonData) -> str:
    """Return the page."""
    pockets = comparison.pockets
    outcomes = comparison.outcomes()
    rows = [v for v in Verdict if any(p is v for p, _ in outcomes)]
    columns = [v for v in Verdict if any(m is v for _, m in outcomes)]
    peaks = [p.measured_peak_mm for p in pockets if p.measured_peak_mm is not None]
    before, source = comparison.report_trace, comparison.source
    return render(
        "comparison.html.j2",
        comparison=comparison,
        running=" · ".join(filter(None, [identity_of(before, source), "after debulking", comparison.headline])),
        identity=identity_of(before, source),
        trace=comparison_lists(comparison),
        block=title_block(before, comparison.recipe, source, comparison.version),
        recipe=recipe_lists(comparison.recipe),
        map=ply_map(
            comparison.height_map,
            comparison.ply_outline_mm,
            [Area(p.id, p.measured, p.outline_mm, _says(p)) for p in pockets],
            max([*peaks, 2 * comparison.max_peak_mm]),
            ridges=[ridge for p in pockets if (ridge := _ridge(p, comparison.max_peak_mm))],
            measured=measured_ridges(comparison.height_map, [p.outline_mm for p in pockets], comparison.max_peak_mm),
        ),
        counts=[(v, n) for v in columns if (n := sum(p.measured is v for p in pockets))],
        pockets=sorted(pockets, key=lambda p: ({False: 0, None: 1, True: 2}[p.hit], -p.measured.severity, p.id)),
        rows=rows,
        columns=columns,
        outcomes=outcomes,
        charts=[
            bar_chart(
                "RMS of the gaps, mm",
                [
                    Row(p.id, p.predicted, p.predicted_rms_mm, p.predicted_rms_range_mm, p.measured_rms_mm)
                    for p in pockets
                ],
                comparison.max_rms_mm,
                3,
                "bar: predicted; thin line: range over the starts; ◆ measured",
            ),
            bar_chart(
                "Ridge height, mm",
                [
                    Row(p.id, p.predicted, p.predicted_ridge_mm, p.predicted_ridge_range_mm, p.measured_peak_mm)
                    for p in pockets
                ],
                comparison.max_peak_mm,
                2,
                "bar: predicted ridge; thin line: its range; ◆ measured peak",
            ),
        ],
        scatter=_scatter(comparison),
    )


def _ridge(pocket: PocketComparison, limit_mm: float) -> Ridge | None:
    if not pocket.predicted_ridges_mm or pocket.predicted_place_mm is None:
        return None
    place = pocket.predicted_place_mm
    height = number(pocket.predicted_ridge_mm, 2)
    title = f"predicted ridge of pocket {pocket.id}, {height} mm high, its place known to ±{place:.1f} mm"
    span = pocket.predicted_ridge_range_mm
    low = span is not None and span[1] <= limit_mm
    return Ridge(ridge_path(pocket.predicted_ridges_mm), 2 * place, title, low)


def _says(pocket: PocketComparison) -> str:
    measured = "" if pocket.measured_peak_mm is None else f", {number(pocket.measured_peak_mm, 2)} mm"
    return f"pocket {pocket.id}: {pocket.predicted.name} predicted, {pocket.measured.name} measured{measured}"


def _scatter(comparison: ComparisonData) -> Scatter | None:
    """Plot measured over predicted RMS, with each limit as a line: points lower left and upper right agree."""
    points = [
        (p, p.predicted_rms_mm, p.measured_rms_mm, p.predicted_rms_range_mm)
        for p in comparison.pockets
        if p.predicted_rms_mm is not None and p.measured_rms_mm is not None
    ]
    if not points:
        return None
    limit = comparison.max_rms_mm
    full = 1.06 * max([1.5 * limit, *(max(a, b, r[1] if r else 0.0) for _, a, b, r in points)])
    scale = (_SIZE - _BOTTOM - _TOP) / full

    def x(value: float) -> float:
        return _LEFT + scale * value

    def y(value: float) -> float:
        return _SIZE - _BOTTOM - scale * value

    bottom, left, top = y(0), x(0), y(full)
    parts = [
        f'<path class="diagonal" d="M{left:.1f} {bottom:.1f}L{x(full):.1f} {top:.1f}"/>',
        f'<path class="limit" d="M{x(limit):.1f} {bottom:.1f}V{top:.1f}M{left:.1f} {y(limit):.1f}H{x(full):.1f}"/>',
        f'<path class="axis" d="M{left:.1f} {top:.1f}V{bottom:.1f}H{x(full):.1f}"/>',
    ]
    step = nice(full / 5)
    for k in range(int(full / step) + 1):
        parts.append(f'<text x="{x(k * step):.1f}" y="{bottom + 16:.1f}" text-anchor="middle">{k * step:g}</text>')
        parts.append(f'<text x="{left - 5:.1f}" y="{y(k * step) + 4:.1f}" text-anchor="end">{k * step:g}</text>')
    parts.append(f'<text x="{x(full):.1f}" y="{_SIZE - 6:.1f}" text-anchor="end">predicted RMS, mm</text>')
    parts.append(f'<text x="2" y="{top - 7:.1f}">measured RMS, mm</text>')
    spots = []
    for p, predicted, measured, span in points:
        if span is not None and span[1] > span[0]:
            parts.append(f'<path class="span" d="M{x(span[0]):.1f} {y(measured):.1f}H{x(span[1]):.1f}"/>')
        parts.append(f'<circle class="{p.measured.value}" cx="{x(predicted):.1f}" cy="{y(measured):.1f}" r="4.5"/>')
        spots.append((x(predicted), y(measured), str(p.id)))
    parts += [f'<text class="name" x="{u:.1f}" y="{v:.1f}">{text}</text>' for u, v, text in _names(spots, x(full))]
    return Scatter(_SIZE, "".join(parts))


def _names(spots: list[tuple[float, float, str]], right: float) -> list[tuple[float, float, str]]:
    """Put the points' numbers beside them; points that overlap share one label, and no label covers another."""
    groups: list[tuple[float, float, list[str]]] = []
    for u, v, name in spots:
        near = next((names for a, b, names in groups if abs(a - u) < 7 and abs(b - v) < 7), None)
        if near is None:
            groups.append((u, v, [name]))
        else:
            near.append(name)
    taken = [(u - 5, v - 5, u + 5, v + 5) for u, v, _ in groups]
    labels = []
    for u, v, names in groups:
        text = ", ".join(names)
        width = 7.6 * len(text)
        places = [(u + 7, v + 4), (u - 7 - width, v + 4), (u + 4, v - 8), (u + 4, v + 16), (u - width, v - 8)]
        boxes = [(a, b - 10, a + width, b + 1) for a, b in places]

        def cost(k: int, boxes: list[tuple[float, float, float, float]] = boxes) -> float:
            a, b, c, d = boxes[k]
            hit = sum(max(0.0, min(c, r) - max(a, p)) * max(0.0, min(d, s) - max(b, q)) for p, q, r, s in taken)
            return hit + 100.0 * (max(0.0, c - right) + max(0.0, _LEFT - a)) + 0.01 * k

        best = min(range(len(places)), key=cost)
        taken.append(boxes[best])
        labels.append((*places[best], text))
    return labels
