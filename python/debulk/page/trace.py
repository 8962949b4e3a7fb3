"""What an inspection was made of, as lists for the page."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from debulk import rings
from debulk.results.approval import recipe_hash
from debulk.results.chain import ChainReport
from debulk.results.comparison import ComparisonData
from debulk.results.report import ReportData
from debulk.results.trace import ArrayTrace, Trace

_Entries = list[tuple[str, str]]


def trace_lists(report: ReportData) -> list[tuple[str, _Entries]]:
    """Return titles, each with names and values; unknown values are left out."""
    trace = report.trace
    if trace is None:
        return []
    return [*_lists(trace, report.ply_outline_mm), ("chain that measured", _chain(report.chain))]


def comparison_lists(comparison: ComparisonData) -> list[tuple[str, _Entries]]:
    """Return likewise what a comparison was made of: the report that it judges, and the scan after debulking."""
    before, trace = comparison.report_trace, comparison.trace
    report = list(comparison.source.items())
    if comparison.report_sha256:
        report.append(("SHA-256 of the report", comparison.report_sha256))
    if comparison.report_verdict:
        report.append(("its verdict", comparison.report_verdict.name))
    if before is not None:
        report += [("inspected (UTC)", before.time_utc), *_array("its scan", before.scan)]
        report += [(name, _text(value)) for name, value in before.context.items()]
    lists = [] if trace is None else _lists(trace, comparison.ply_outline_mm, "after debulking")
    return [*([("the report", report)] if report else []), *lists]


def _lists(trace: Trace, outline: Any, first: str = "when and what") -> list[tuple[str, _Entries]]:
    when = [("time (UTC)", trace.time_utc), *((name, _text(value)) for name, value in trace.context.items())]
    arrays = [*_array("scan", trace.scan), *_array("reference", trace.reference), *_array("mask", trace.mask)]
    lists = [
        (first, when),
        ("scan and reference", arrays),
        ("geometry", _geometry(outline, trace)),
        ("versions", list(trace.versions.items())),
        ("host", list(trace.host.items())),
    ]
    return [(title, entries) for title, entries in lists if entries]


def title_block(
    trace: Trace | None, recipe: Mapping[str, Any], source: Mapping[str, str], version: str
) -> list[tuple[str, str]]:
    """Return the entries of the title block of a filed page; an empty one leaves room to write."""
    context = dict(trace.context) if trace else {}
    told = {name: _text(context.get(name, "")) for name in ("part", "ply", "operator")}
    print_ = f"SHA-256 {recipe_hash(recipe)[:16]}" if recipe else ""
    return [
        ("part", told["part"]),
        ("ply", told["ply"]),
        ("inspected (UTC)", trace.time_utc[:19].replace("T", " ") if trace else ""),
        ("recipe", " · ".join(filter(None, [source.get("recipe", ""), print_]))),
        ("recipe approved by", _text(context.get("recipe approved by", ""))),
        ("software", f"debulk {version}"),
        ("operator", told["operator"]),
        ("date, signature", ""),
    ]


def headline(report: ReportData) -> str:
    """Return the header of each printed sheet: part, ply and the like, the time, and the verdict."""
    return " · ".join(filter(None, [identity(report), report.verdict.name]))


def identity(report: ReportData) -> str:
    """Return what was inspected: part, ply and the like, or the files, and the time."""
    return identity_of(report.trace, report.source)


def identity_of(trace: Trace | None, source: Mapping[str, str]) -> str:
    """Return likewise what a trace belongs to; `source` is used if it has no context."""
    context = {} if trace is None else trace.context
    named = [f"{name} {_text(value)}" for name, value in context.items()]
    if not named:
        named = [f"{name} {value}" for name, value in source.items()]
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


def _chain(chain: ChainReport | None) -> _Entries:
    """Return how the scan compares with its chain, figure by figure."""
    if chain is None:
        return [("qualified chain", "none was given")]
    named = [("name, qualified", f"{chain.name}, {chain.made_utc[:10]}"), ("SHA-256", chain.sha256)]
    return [*named, *((f"{one.differs.upper()} {one.says}".strip(), one.figures) for one in chain.figures)]


def _geometry(outline: Any, trace: Trace) -> _Entries:
    entries = []
    if trace.fibre_angles_deg is not None:
        entries.append(("fibre angles, degrees", _row(trace.fibre_angles_deg)))
    if trace.fibre_angles_map is not None:
        rows, columns = trace.fibre_angles_map.values.shape[:2]
        what = f"map of {columns} × {rows}, {trace.fibre_angles_map.spacing_mm:g} mm apart"
        entries.append(("fibre angles", what + ", with nominal ones" * (trace.nominal_angles_map is not None)))
    if trace.mold_from_scanner is None:
        entries.append(("mold from scanner", "none: clouds in the mold's frame"))
    else:
        entries += [(f"mold from scanner, row {k + 1}", _row(row)) for k, row in enumerate(trace.mold_from_scanner[:3])]
    if trace.fitted_camera is not None:
        origin = "fitted" if trace.camera is None else "given"
        entries.append((f"camera f, cx, cy in pixels, {origin}", _row(trace.fitted_camera)))
    entries.append(("ply outline", "unknown" if outline is None else rings.said(outline)))
    if trace.deadline_s is not None:
        entries.append(("deadline", f"{trace.deadline_s:g} s"))
    return entries


def _row(values: Any) -> str:
    return ", ".join(f"{value:.6g}" for value in values)
