"""The comparison as one HTML page: predictions against measurements."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from debulk.page.charts import Row, bar_chart
from debulk.page.map import Area, ply_map
from debulk.page.map_ridges import Ridge, ridge_path
from debulk.page.measured_ridges import measured_ridges
from debulk.page.render import render
from debulk.page.report import recipe_lists
from debulk.page.trace import comparison_lists, identity_of, title_block
from debulk.results.comparison import ComparisonData, PocketComparison, Standing
from debulk.results.number import number
from debulk.verdict import Verdict


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
            measured=measured_ridges(
                comparison.height_map,
                [*(p.outline_mm for p in pockets), *map(_round, comparison.standing)],
                comparison.max_peak_mm,
            ),
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
    )


def _round(one: Standing) -> NDArray[np.float64]:
    """Return a square round a ridge beside the pockets."""
    return np.array(one.place_mm) + one.length_mm * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


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
