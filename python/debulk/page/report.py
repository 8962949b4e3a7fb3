"""The report as one self-contained HTML page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from debulk.page import net as page_net
from debulk.page import profile as page_profile
from debulk.page.charts import Bar, Chart, Row, bar_chart
from debulk.page.drawable import check_drawable
from debulk.page.heights import MAX_PNG_BYTES
from debulk.page.map import Area, PlyMap, ply_map
from debulk.page.map_ridges import ridges, says
from debulk.page.render import render
from debulk.page.trace import headline, identity, title_block, trace_lists
from debulk.results.advice import advice, deciding, hole_line, level_line
from debulk.results.check_texts import text_of
from debulk.results.deciding import worst_first
from debulk.results.edge_friction import edge_friction_line
from debulk.results.half_seen import half_seen_line
from debulk.results.report import ReportData
from debulk.results.rework import lines_of, rework
from debulk.verdict import Verdict

# With the picture of the heights, and 3 kB of text per pocket, the page stays below 5 MB.
_MAX_STILL_BYTES = 1_450_000  # limit for all drawings
_MAX_DATA_BYTES = 700_000  # limit for the data that the script draws
_LIMIT_MM = 0.6  # of a ridge, for the colours of a report without a recipe


class Drawings(NamedTuple):
    """Net and section of a pocket; `still` if the net is drawn in the file, and not only by the script."""

    net: page_net.NetViews | None
    profile: page_profile.Profile | None
    still: bool


def page(report: ReportData) -> str:
    """Return the page; an `InputError` if the report was changed by hand and contains infinite values."""
    check_drawable(report)
    limits = report.recipe.get("verdict", {})
    floor = _floor(report)
    pockets = worst_first(report.pockets)
    return render(
        "report.html.j2",
        report=report,
        running=headline(report),
        identity=identity(report),
        pockets=pockets,
        counts=[(v, n) for v in Verdict if (n := sum(p.verdict is v for p in report.pockets))],
        map=report_map(report),
        advice=advice(report),
        cause=next((one for one in report.findings if one.at_best is report.verdict), None),
        checks=[(name, text_of(name)) for name in dict.fromkeys(one.check for one in report.findings)],
        deciding=deciding(report),
        level_line=level_line(report.level) if report.level else "",
        half_seen_line=half_seen_line,
        edge_friction_line=edge_friction_line,
        hole_line=hole_line,
        rework=lines_of(rework(report)),
        drawings=_drawings(report),
        limits=limits,
        judged=bool(report.pockets) or report.coverage is not None,
        limit_mm=limits.get("max_ridge_mm") or _LIMIT_MM,
        charts=[
            bar_chart(
                "Ridge that decides, mm",
                [Row(p.id, p.verdict, r.height_mm, r.range_mm) for p in pockets if (r := p.deciding_ridge)],
                limits.get("max_ridge_mm"),
                2,
                "thin line: its range",
            ),
            bar_chart(
                "Another model: RMS of the gaps of the net, mm",
                [Row(p.id, p.verdict, p.rms_mm, p.rms_range_mm) for p in pockets],
                limits.get("max_rms_mm"),
                3,
                "thin line: range over the minima" + (f"; {floor.why}" if floor else ""),
                floor=floor.rms_mm if floor else 0.0,
            ),
        ],
        timings=_timings(report),
        total_ms=total_ms(report),
        recipe=recipe_lists(report.recipe),
        trace=trace_lists(report),
        block=title_block(report.trace, report.recipe, report.source, report.version),
    )


def report_map(report: ReportData, png_bytes: int = MAX_PNG_BYTES) -> PlyMap | None:
    """Draw the heights of a report with everything known of its pockets; None if there is nothing to draw."""
    if report.height_map is None and not report.pockets:
        return None
    areas = [Area(p.id, p.verdict, p.outline_mm, says(p)) for p in report.pockets]
    found = ridges(report.pockets, report.limit_mm)
    return ply_map(report.height_map, report.ply_outline_mm, areas, _top(report), report, found, png_bytes=png_bytes)


class Floor(NamedTuple):
    """The RMS below which no pocket can come, and the reason."""

    rms_mm: float
    why: str


def _floor(report: ReportData) -> Floor | None:
    """Return the consolidated thickness, the gap where the ply lies on the mold; None if it is unknown or no use."""
    material, limit = report.recipe.get("material", {}), report.recipe.get("verdict", {}).get("max_rms_mm")
    thickness, bulk = material.get("thickness_mm"), material.get("bulk_factor")
    if not thickness or not bulk or not limit or thickness / bulk >= limit:
        return None
    laid = thickness / bulk
    why = (
        f"bars start at {laid:.3f} mm, the RMS of a ply that lies flat on the mold: its thickness of {thickness:g} mm "
        f"over the bulk factor of {bulk:g}; only what is above that comes from ridges and bridges"
    )
    return Floor(laid, why)


def total_ms(report: ReportData) -> float:
    """Return the time of the whole inspection: its own entry, or the sum of the stages if there is none."""
    return report.timings_ms.get("total", sum(report.timings_ms.values()))


def _top(report: ReportData) -> float | None:
    """Height of the last colour: that of the highest pocket, but at least the cut, so that noise does not stand out."""
    cut = report.recipe.get("segmentation", {}).get("cut_height_mm")
    return max([p.peak_mm for p in report.pockets] + ([] if cut is None else [cut]), default=None)


def _drawings(report: ReportData) -> dict[int, Drawings]:
    """Draw the pockets, the worst first, until the page would be too large: then without stills, then not at all."""
    stills, data = _MAX_STILL_BYTES, _MAX_DATA_BYTES
    made = {}
    limit_mm = report.limit_mm or _LIMIT_MM
    for pocket in worst_first(report.pockets):
        if pocket.net is None or (stills < 0 and data < 0):
            continue
        profile = page_profile.profile(pocket, report.recipe)
        net = page_net.net_views(pocket, limit_mm, profile.nodes if profile else None)
        if net is not None:
            data -= len(net.data)
        if data < 0:
            net = None
        still = net is not None and net.size <= stills
        if net is not None and still:
            stills -= net.size
        if profile is not None:
            stills -= len(profile.markup)
        made[pocket.id] = Drawings(net, profile if stills > 0 else None, still)
    return made


def _timings(report: ReportData) -> Chart:
    stages = {stage: ms for stage, ms in report.timings_ms.items() if stage != "total"}
    longest = max(stages.values(), default=0.0) or 1.0
    bars = [Bar(stage, f"{ms:.1f} ms", 100 * ms / longest) for stage, ms in stages.items()]
    return Chart(f"Times, {total_ms(report):.0f} ms in all", bars)


def recipe_lists(recipe: Mapping[str, Any]) -> list[tuple[str, list[tuple[str, Any, Any]]]]:
    """Sections, names, values, and the default if the value differs from it."""
    from debulk.recipe import Recipe

    defaults = Recipe().model_dump()
    return [
        (section, [(name, value, defaults.get(section, {}).get(name, value)) for name, value in table.items()])
        for section, table in recipe.items()
        if isinstance(table, dict)
    ]
