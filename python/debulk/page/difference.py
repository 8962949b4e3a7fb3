"""Two reports side by side as one HTML page: what differs, place by place and setting by setting."""

from __future__ import annotations

from typing import NamedTuple

from debulk.page.drawable import check_drawable
from debulk.page.map import PlyMap
from debulk.page.render import render
from debulk.page.report import report_map
from debulk.page.trace import identity
from debulk.results.difference import changes, places
from debulk.results.report import ReportData
from debulk.results.trace import ArrayTrace

_MAX_PNG_BYTES = 1_200_000  # limit for each map


class Side(NamedTuple):
    """One of the two reports."""

    report: ReportData
    name: str
    identity: str
    map: PlyMap | None


def page(first: ReportData, second: ReportData, names: tuple[str, str] = ("first", "second")) -> str:
    """Return the page of two reports, of one scan with two recipes or of two scans of a ply."""
    for report in (first, second):
        check_drawable(report)
    sides = [
        Side(r, n, identity(r), report_map(r, _MAX_PNG_BYTES)) for r, n in zip((first, second), names, strict=True)
    ]
    every = sorted(places(first, second), key=lambda place: not place.differs)
    return render(
        "difference.html.j2",
        running=" · ".join([*names, f"{first.verdict}, then {second.verdict}"]),
        sides=sides,
        places=every,
        changed=sum(place.differs for place in every),
        settings=changes(first.recipe, second.recipe),
        scans=_same(*(one.trace.scan if one.trace else None for one in (first, second))),
        references=_same(*(one.trace.reference if one.trace else None for one in (first, second))),
    )


def _same(first: ArrayTrace | None, second: ArrayTrace | None) -> str:
    """Say whether two clouds are the same by their fingerprints."""
    a, b = (one.fingerprint if one else None for one in (first, second))
    if a is None or b is None or a[0] != b[0]:
        return "not known whether the same"
    return "the same, by fingerprint" if a == b else "different"
