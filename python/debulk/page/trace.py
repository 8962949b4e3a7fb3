"""What an inspection was made of, as lists for the page."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from debulk.results.report import ReportData
    from debulk.results.trace import ArrayTrace, Trace

__all__ = ["context_text", "headline", "identity", "trace_lists"]

_Entries = list[tuple[str, str]]


def trace_lists(report: ReportData) -> list[tuple[str, _Entries]]:
    """Return titles, each with names and values; unknown values are left out.

    Examples
    --------
    >>> from debulk.report import Report, Verdict
    >>> from debulk.results.trace import Trace
    >>> trace = Trace(time_utc="2026-03-01T12:00:00.250Z", context={"part": "A-17"})
    >>> report = Report(verdict=Verdict.CEASE, reason="nothing raised", pockets=(), trace=trace)
    >>> trace_lists(report)[0]
    ('when and what', [('time (UTC)', '2026-03-01T12:00:00.250Z'), ('part', 'A-17')])
    """
    trace = report.trace
    if trace is None:
        return []
    first = [("time (UTC)", trace.time_utc), *((name, _text(value)) for name, value in trace.context.items())]
    arrays = [*_array("scan", trace.scan), *_array("reference", trace.reference), *_array("mask", trace.mask)]
    lists = [
        ("when and what", first),
        ("scan and reference", arrays),
        ("geometry", _geometry(report, trace)),
        ("versions", list(trace.versions.items())),
        ("host", list(trace.host.items())),
    ]
    return [(title, entries) for title, entries in lists if entries]


def headline(report: ReportData) -> str:
    """Return the header of each printed sheet: part, ply and the like, the time, and the verdict."""
    return " · ".join(filter(None, [identity(report), report.verdict.name]))


def identity(report: ReportData) -> str:
    """Return what was inspected: part, ply and the like, or the files, and the time.

    Examples
    --------
    >>> from debulk.report import Report, Verdict
    >>> from debulk.results.trace import Trace
    >>> trace = Trace(time_utc="2026-03-01T12:00:00.250Z", context={"part": "A-17", "ply": 3})
    >>> identity(Report(verdict=Verdict.CEASE, reason="nothing raised", pockets=(), trace=trace))
    'part A-17 · ply 3 · 2026-03-01 12:00:00 UTC'
    """
    trace = report.trace
    context = {} if trace is None else trace.context
    named = [f"{name} {_text(value)}" for name, value in context.items()]
    if not named:
        named = [f"{name} {value}" for name, value in report.source.items()]
    when = [] if trace is None else [f"{trace.time_utc[:10]} {trace.time_utc[11:19]} UTC"]
    return " · ".join([*named, *when])


def context_text(report: ReportData, name: str) -> str:
    """Return what the caller of the inspection stated about the part, the ply and the like; empty if nothing."""
    context = report.trace.context if report.trace else {}
    return _text(context[name]) if name in context else ""


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


def _array(name: str, array: ArrayTrace | None) -> _Entries:
    if array is None:
        return []
    size = " × ".join(str(length) for length in array.shape)
    kind, value = array.fingerprint or ("SHA-256", "not computed")
    return [(name, size), (f"{name}, {kind}", value)]


def _geometry(report: ReportData, trace: Trace) -> _Entries:
    entries = []
    if trace.fibre_angles_deg is not None:
        entries.append(("fibre angles, degrees", _row(trace.fibre_angles_deg)))
    if trace.fibre_angles_map is not None:
        rows, columns = trace.fibre_angles_map.values.shape[:2]
        entries.append(("fibre angles", f"map of {columns} × {rows}, {trace.fibre_angles_map.spacing_mm:g} mm apart"))
    if trace.mold_from_scanner is None:
        entries.append(("mold from scanner", "none: clouds in the mold's frame"))
    else:
        entries += [(f"mold from scanner, row {k + 1}", _row(row)) for k, row in enumerate(trace.mold_from_scanner[:3])]
    if trace.fitted_camera is not None:
        origin = "fitted" if trace.camera is None else "given"
        entries.append((f"camera f, cx, cy in pixels, {origin}", _row(trace.fitted_camera)))
    outline = report.ply_outline_mm
    entries.append(("ply outline", "unknown" if outline is None else f"{len(outline)} corners"))
    if trace.deadline_s is not None:
        entries.append(("deadline", f"{trace.deadline_s:g} s"))
    return entries


def _row(values: Any) -> str:
    return ", ".join(f"{value:.6g}" for value in values)
