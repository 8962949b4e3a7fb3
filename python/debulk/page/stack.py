"""The layups of a stack as one HTML page: first which plies are bad, and then ply by ply."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from debulk.page.drawable import check_drawable
from debulk.page.map import PlyMap
from debulk.page.render import render
from debulk.page.report import report_map
from debulk.page.trace import context_text
from debulk.results.advice import Deed, advice, deciding
from debulk.results.comparison import ComparisonData
from debulk.results.deciding import worst_first
from debulk.results.number import number
from debulk.results.report import PocketReport, ReportData
from debulk.verdict import Verdict

_MAX_PNG_BYTES = 2_400_000  # limit for all maps: with base64 and text, a page of some ten plies stays below 5 MB


class Layup(NamedTuple):
    """A report, its file's name, the address of its own page (empty: none), and what became of the ply, if known."""

    report: ReportData
    name: str
    link: str = ""
    comparison: ComparisonData | None = None


class Ply(NamedTuple):
    """The section of the page for one ply."""

    number: int
    title: str
    layup: Layup
    time: str
    map: PlyMap | None
    pockets: list[PocketReport]
    advice: list[Deed]
    deciding: list[tuple[Verdict, list[int]]]
    below: str
    after: str
    wrong: str


def page(layups: Sequence[Layup]) -> str:
    """Return the page of the layups of a stack, in their order, or in that of the numbers "ply" of their contexts.

    Those of several parts come part by part.
    """
    for layup in layups:
        check_drawable(layup.report)
    parts = sorted({text for layup in layups if (text := context_text(layup.report, "part"))})
    numbers = {id(layup): _ply_number(layup) for layup in layups}
    ordered = list(layups) if None in numbers.values() else sorted(layups, key=lambda one: numbers[id(one)] or 0.0)
    ordered.sort(key=lambda one: context_text(one.report, "part"))
    share = max(_MAX_PNG_BYTES // len(ordered), 40_000)
    wrong = references(ordered)
    plies = [_ply(k, layup, share, wrong[k - 1], len(parts) > 1) for k, layup in enumerate(ordered, start=1)]
    worst = sorted(plies, key=lambda ply: (-ply.layup.report.verdict.severity, ply.number))
    verdict = worst[0].layup.report.verdict
    counts = [(v, n) for v in Verdict if (n := sum(ply.layup.report.verdict is v for ply in plies))]
    times = sorted(ply.time for ply in plies if ply.time)
    when = [] if not times else [times[0] if times[0] == times[-1] else f"{times[0]} to {times[-1]}"]
    named = [f"{'part' if len(parts) == 1 else 'parts'} {', '.join(parts)}"] if parts else []
    count = f"{len(plies)} {'ply' if len(plies) == 1 else 'plies'}"
    return render(
        "stack.html.j2",
        running=" · ".join([*named, count, *when, verdict.name]),
        verdict=verdict,
        plies=plies,
        worst=worst,
        counts=counts,
        of_parts=named[0] if named else "",
    )


def _ply_number(layup: Layup) -> float | None:
    try:
        return float(context_text(layup.report, "ply"))
    except ValueError:
        return None


def references(layups: Sequence[Layup]) -> list[str]:
    """Return for each ply of a stack, in order, what is wrong with its reference by the fingerprints; empty: nothing.

    The reference of a ply is the scan of the ply before, after it was debulked. A cloud that was another ply's
    reference, or another ply's scan before debulking, is not.
    """
    used: dict[str, str] = {}
    draped: dict[tuple[str, str], str] = {}
    out = []
    for k, layup in enumerate(layups, start=1):
        trace = layup.report.trace
        name = context_text(layup.report, "ply") or str(k)
        below = trace.reference.fingerprint if trace and trace.reference else None
        why = ""
        if below is not None:
            if used.get(below[1], name) != name:
                why = f"it is that of ply {used[below[1]]}, too: the ply between them is not in it"
            elif below in draped:
                why = f"it is the scan of ply {draped[below]} before debulking, whose pockets it hides"
            used.setdefault(below[1], name)
        scan = trace.scan.fingerprint if trace and trace.scan else None
        if scan is not None:
            draped.setdefault(scan, name)
        out.append(why)
    return out


def _after(comparison: ComparisonData | None) -> str:
    """Say what a ply's scan after debulking showed; empty if there was none."""
    if comparison is None:
        return ""
    bad = comparison.not_passed
    return f"did not pass: {', '.join(bad)}" if bad else "passed: every pocket ceased"


def _ply(place: int, layup: Layup, png_bytes: int, wrong: str, several_parts: bool) -> Ply:
    report = layup.report
    name = context_text(report, "ply")
    title = f"Ply {name}" if name else f"Layup {number(place, 0)}"
    part = context_text(report, "part") if several_parts else ""
    time = report.trace.time_utc if report.trace else ""
    return Ply(
        place,
        f"{part}, {title[0].lower()}{title[1:]}" if part else title,
        layup,
        f"{time[:10]} {time[11:19]} UTC" if time else "",
        report_map(report, png_bytes),
        worst_first(report.pockets),
        advice(report),
        deciding(report),
        context_text(report, "reference"),
        _after(layup.comparison),
        wrong,
    )
