"""The report as one HTML page that needs nothing else: no script, no network, every text escaped."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from debulk.page_map import colours, ply_map
from debulk.page_net import net_views
from debulk.report import Verdict
from debulk.report_text import number

if TYPE_CHECKING:
    from debulk.report import PocketReport, Report

_MAX_NET_BYTES = 1_600_000  # of all drawings of nets; with the picture of the heights the page stays below 5 MB


class Look(NamedTuple):
    """How a verdict is shown: a sign as well as a colour, and what to do about it."""

    sign: str
    advice: str


LOOKS = {
    Verdict.CEASE: Look("✓", "Every pocket is predicted to close under vacuum."),
    Verdict.CREASE: Look("✕", "At least one pocket is predicted to leave a wrinkle."),
    Verdict.UNDECIDED: Look("?", "At least one pocket is too near a limit, or its solution is not certified."),
    Verdict.INVALID: Look("∅", "At least one part cannot be judged: scan again or look at the reason."),
}


class Bar(NamedTuple):
    """One line of a bar chart; positions in percent of its width."""

    label: str
    text: str
    percent: float
    verdict: str = ""
    sign: str = ""
    low: float | None = None
    high: float | None = None


class Chart(NamedTuple):
    """A bar chart with an optional limit."""

    title: str
    bars: list[Bar]
    limit_percent: float | None = None
    limit_text: str = ""


def page(report: Report) -> str:
    """Return the page.

    Examples
    --------
    >>> from debulk.report import Report, Verdict
    >>> "nothing raised" in page(Report(verdict=Verdict.CEASE, reason="nothing raised", pockets=()))
    True
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    templates = Path(__file__).with_name("templates")
    environment = Environment(
        loader=FileSystemLoader(templates),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["number"] = number
    limits = report.recipe.get("verdict", {})
    views, left = {}, _MAX_NET_BYTES
    for pocket in report.pockets:
        drawn = net_views(pocket)
        if drawn is not None and drawn.size <= left:
            views[pocket.id] = drawn
            left -= drawn.size
    return environment.get_template("report.html.j2").render(
        report=report,
        looks=LOOKS,
        margin=margin,
        colours=colours(8),
        counts=[(v, n) for v in Verdict if (n := sum(p.verdict is v for p in report.pockets))],
        map=ply_map(report),
        views=views,
        limits=limits,
        charts=[
            _pocket_chart("RMS of the gaps, mm", report, "rms_mm", limits.get("max_rms_mm"), 3),
            _pocket_chart("Ridge height, mm", report, "ridge_height_mm", limits.get("max_ridge_mm"), 2),
        ],
        timings=_timings(report),
        total_ms=total_ms(report),
        recipe=_recipe(report),
    )


def margin(value: float | None, limit: float | None) -> float | None:
    """Return by how much a figure stays below its limit; negative above."""
    return None if value is None or limit is None else limit - value


def _pocket_chart(title: str, report: Report, name: str, limit: float | None, digits: int) -> Chart:
    pockets = [(pocket, getattr(pocket, name)) for pocket in report.pockets]
    tops = [value for _, value in pockets if value is not None] + ([limit * 1.15] if limit else [])
    tops += [pocket.rms_range_mm[1] for pocket, _ in pockets if name == "rms_mm" and pocket.rms_range_mm]
    full = max(tops, default=1.0) or 1.0

    def bar(pocket: PocketReport, value: float | None) -> Bar:
        span = pocket.rms_range_mm if name == "rms_mm" else None
        low, high = (100 * span[0] / full, 100 * span[1] / full) if span and span[1] > span[0] else (None, None)
        sign = LOOKS[pocket.verdict].sign
        percent = 0.0 if value is None else 100 * value / full
        return Bar(str(pocket.id), number(value, digits), percent, pocket.verdict.value, sign, low, high)

    bars = [bar(pocket, value) for pocket, value in pockets]
    return Chart(title, bars, 100 * limit / full if limit else None, f"limit {limit:.2f} mm" if limit else "")


def total_ms(report: Report) -> float:
    """Return the time of the whole inspection: its own entry, or without one the sum of the stages."""
    return report.timings_ms.get("total", sum(report.timings_ms.values()))


def _timings(report: Report) -> Chart:
    stages = {stage: ms for stage, ms in report.timings_ms.items() if stage != "total"}
    longest = max(stages.values(), default=0.0) or 1.0
    bars = [Bar(stage, f"{ms:.1f} ms", 100 * ms / longest) for stage, ms in stages.items()]
    return Chart(f"Times, {total_ms(report):.0f} ms in all", bars)


def _recipe(report: Report) -> list[tuple[str, list[tuple[str, Any, Any]]]]:
    """Sections, names, values, and the default where the value is another."""
    from debulk.recipe import Recipe

    defaults = Recipe().model_dump()
    return [
        (section, [(name, value, defaults.get(section, {}).get(name, value)) for name, value in table.items()])
        for section, table in report.recipe.items()
        if isinstance(table, dict)
    ]
