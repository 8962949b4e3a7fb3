"""The figures of a record as rows of tables, by which a history is searched; they are made from the record alone."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import astuple, dataclass, fields
from typing import Any

from debulk.page.trace import context_text
from debulk.pocket import height_noise
from debulk.results.approval import recipe_hash
from debulk.results.comparison import ComparisonData
from debulk.results.report import PocketReport, ReportData
from debulk.verdict import Verdict


@dataclass(frozen=True)
class LayupRow:
    """An inspected layup; every figure is None where the report does not have it."""

    record: int
    """Number of the report's record."""
    time_utc: str
    part: str
    ply: str
    """`time_utc`, `part`, `ply`: when the inspection began, ISO 8601; and ``context["part"]`` and ``context["ply"]`` of
    the inspection."""
    verdict: str
    reason: str
    """`verdict`, `reason`: those of the report, the verdict as its name."""
    pockets: int
    creasing: int
    undecided: int
    unjudged: int
    """`pockets`, `creasing`, `undecided`, `unjudged`: number of pockets, and of those that are CREASE, UNDECIDED and
    INVALID."""
    coverage: float | None
    """Share of the ply that was seen."""
    noise_mm: float | None
    """Standard deviation of a cell of the height map by noise (`debulk.pocket.height_noise`): after the filters, so it
    compares layups of one recipe and one scanner."""
    level_mm: float | None
    offset_mm: float | None
    tilt_deg: float | None
    bow_mm: float | None
    """`level_mm`, `offset_mm`, `tilt_deg`, `bow_mm`: median height of the ply between the pockets less its thickness,
    and the plane and parabola fitted to it, which show how well scan and reference are registered."""
    total_ms: float
    """Sum of the stages' times."""
    version: str
    build: str
    recipe: str
    scan: str
    """`version`, `build`, `recipe`, `scan`: version and build of debulk; hash of the recipe; fingerprint of the scan.
    Empty if not known."""


@dataclass(frozen=True)
class PocketRow:
    """A pocket of a layup.

    `ridge_mm`, from `low_mm` to `high_mm`, is the ridge by which it was judged; `noise_mm` is the standard deviation of
    a ridge by the excess from the noise of the scan. `x_mm`, `y_mm` is the centroid in the mold frame.
    """

    record: int
    id: int
    verdict: str
    decided_by: str
    x_mm: float | None
    y_mm: float | None
    area_mm2: float | None
    peak_mm: float | None
    ridge_mm: float | None
    low_mm: float | None
    high_mm: float | None
    noise_mm: float | None
    at_edge: int


@dataclass(frozen=True)
class CauseRow:
    """A check that keeps a layup from CEASE, and the best verdict that it allows."""

    record: int
    name: str
    verdict: str


@dataclass(frozen=True)
class OutcomeRow:
    """What became of a pocket: `source` is "scan" for a comparison and "operator" for somebody's word.

    `report` is the record of the pocket's report; `predicted` and `ridge_mm` are of that report, `measured`, `peak_mm`
    (what may stand there) and `share` (of the pocket's area that was seen) of what came after.
    """

    record: int
    report: int
    pocket: int
    source: str
    predicted: str
    measured: str
    ridge_mm: float | None
    peak_mm: float | None
    share: float | None


@dataclass(frozen=True)
class ChainRow:
    """A figure of a scan's signature, with the limits of the qualified chain; None: none on that side."""

    record: int
    says: str
    unit: str
    measured: float | None
    low: float | None
    high: float | None


Row = LayupRow | PocketRow | CauseRow | OutcomeRow | ChainRow
TABLES: Mapping[str, type[Row]] = {
    "layup": LayupRow,
    "pocket": PocketRow,
    "cause": CauseRow,
    "chain": ChainRow,
    "outcome": OutcomeRow,
}


def digest(rows: Mapping[str, list[tuple[Any, ...]]]) -> str:
    """Return the SHA-256 of a record's rows, by table, which shows whether one of them was changed."""
    # Records of 0.2.0, which knew no table `chain`, keep their digests.
    named = [[name, rows.get(name, [])] for name in TABLES if name != "chain" or rows.get(name)]
    text = json.dumps(named, ensure_ascii=False, separators=(",", ":"))
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def as_tuples(rows: list[Row]) -> dict[str, list[tuple[Any, ...]]]:
    """Return rows by table, as SQLite keeps them: what is not finite is unknown."""
    names = {kind: name for name, kind in TABLES.items()}
    found: dict[str, list[tuple[Any, ...]]] = {}
    for row in rows:
        found.setdefault(names[type(row)], []).append(tuple(_plain(value) for value in astuple(row)))
    return found


def columns(kind: type[Row]) -> list[str]:
    """Return the names of a table's columns."""
    return [entry.name for entry in fields(kind)]


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    # A file name may hold halves of characters, which no database keeps as text.
    return value.encode("utf-8", "backslashreplace").decode() if isinstance(value, str) else value


def of_report(record: int, report: ReportData) -> list[Row]:
    """Return a report's rows: the layup, its pockets, the checks that were not passed, and its scan's signature."""
    verdicts = [pocket.verdict for pocket in report.pockets]
    level, trace = report.level, report.trace
    scan = trace.scan.fingerprint if trace and trace.scan else None
    layup = LayupRow(
        record,
        trace.time_utc if trace else "",
        context_text(report, "part"),
        context_text(report, "ply"),
        report.verdict.name,
        report.reason,
        len(report.pockets),
        verdicts.count(Verdict.CREASE),
        verdicts.count(Verdict.UNDECIDED),
        verdicts.count(Verdict.INVALID),
        report.coverage,
        height_noise(report.height_map) if report.height_map else None,
        level.laid_mm - level.thickness_mm if level else None,
        level.offset_mm if level else None,
        level.tilt_deg if level else None,
        level.bow_mm if level else None,
        float(sum(report.timings_ms.values())),
        report.version,
        trace.versions.get("build", "") if trace else "",
        recipe_hash(report.recipe),
        scan[1] if scan else "",
    )
    bad = {(one.check, one.at_best.name) for one in report.findings if one.at_best not in (None, Verdict.CEASE)}
    causes = (CauseRow(record, *cause) for cause in sorted(bad))
    signature = report.chain.figures if report.chain else ()
    chain = (ChainRow(record, one.says, one.unit, one.measured, one.low, one.high) for one in signature)
    return [layup, *(_pocket(record, pocket) for pocket in report.pockets), *causes, *chain]


def of_comparison(record: int, report: int, comparison: ComparisonData) -> list[Row]:
    """Return the rows of a comparison: what became of each pocket of a report."""
    return [
        OutcomeRow(
            record, report, p.id, "scan", p.predicted.name, p.measured.name, p.predicted_ridge_mm, p.may_stand_mm,
            p.measured_share,
        )
        for p in comparison.pockets
    ]  # fmt: skip


def _pocket(record: int, pocket: PocketReport) -> PocketRow:
    x, y = pocket.centroid_mm or (None, None)
    excess, ridge = pocket.excess, pocket.deciding_ridge
    low, high = ridge.range_mm if ridge else (None, None)
    return PocketRow(
        record, pocket.id, pocket.verdict.name, pocket.decided_by, x, y, pocket.area_mm2, pocket.peak_mm,
        ridge.height_mm if ridge else None, low, high, excess.noise_mm if excess else None,
        int(pocket.touches_ply_edge),
    )  # fmt: skip
