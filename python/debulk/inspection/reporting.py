"""The report of an inspection: what its checks found, the verdict that follows, and what was left out.

The nets and minima that a verdict did not need are made when somebody looks, to the same bits at any time.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from debulk import _core
from debulk.grid import Grid
from debulk.inspection import left_out
from debulk.inspection.checks import shared_runs
from debulk.inspection.checks.check import findings_of
from debulk.inspection.checks.listed import CHECKS
from debulk.inspection.checks.seen import Judged, Seen
from debulk.inspection.evaluate.evaluated import Evaluation
from debulk.inspection.evaluate.evaluation import settle
from debulk.inspection.find.found import FoundPocket
from debulk.inspection.holes import unseen
from debulk.inspection.lines import places
from debulk.inspection.place.placing import Placed
from debulk.inspection.ply import humps
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.inspection.rawscan import lost_places, scattered
from debulk.inspection.rawscan.narrow import Standing
from debulk.report import Report
from debulk.results.compose import compose
from debulk.results.finding import Finding
from debulk.results.report import PocketReport
from debulk.results.unsettled import Later, UnsettledPocket
from debulk.verdict import Verdict
from debulk.workers import Workers

log = logging.getLogger("debulk")


def judged_of(
    pockets: Sequence[FoundPocket], done: Sequence[Evaluation], ply: PlyOnMold, standing: Standing, *, late: bool
) -> Judged:
    """Put the evaluations of pockets together, with what each one's report says about the others and its points."""
    reports = shared_runs.named([one.report for one in done], pockets, ply)
    return Judged(pockets, done, scattered.told(reports, standing), late)


def report(seen: Seen, timings_ms: dict[str, float]) -> Report:
    """Report an inspection in which all pockets were judged."""
    ply, found, judged = seen.ply, seen.found, seen.judged
    entries = () if seen.placed.finding else places.left_out(found, judged.pockets, ply.recipe)
    entries += left_out.of_scan(found, ply.outline is not None)
    entries += lost_places.left_out(seen.lost, seen.standing, found) + seen.filled.left_out()
    entries += tuple(entry for evaluation in judged.evaluations for entry in evaluation.left_out)
    entries += left_out.of_unsolved([evaluation.report for evaluation in judged.evaluations])
    entries += left_out.of_late([(one.report.id, one.late) for one in judged.evaluations if one.late])
    entries += (left_out.of_chain(),) if seen.recognised is None else seen.recognised.left_out
    entries += humps.left_out(seen.humps)
    pockets = tuple(replace(one, crease_probability=seen.risks.pockets[one.id]) for one in judged.reports)
    return _composed(
        findings_of(CHECKS, seen),
        ply,
        timings_ms,
        pockets=pockets,
        left_out=tuple(dict.fromkeys(entries)),  # several pockets may have the same one
        coverage=found.unseen.coverage,
        unseen=unseen.holes(found, judged.reports, ply.recipe),
        wrinkles=tuple(one.wrinkle for one in seen.lost if one.place.is_wrinkle),
        level=seen.placed.level,
        chain=None if seen.recognised is None else seen.recognised.report,
        warnings=seen.placed.warnings,
        height_map=found.overview,
        excess_map=None if found.runs is None else found.runs.largest,
        shear_map=ply.shear,
        runs=seen.runs,
        crease_probability=seen.risks.layup,
    )


def out_of_place(placed: Placed, overview: Grid, ply: PlyOnMold, timings_ms: dict[str, float]) -> Report:
    """Report a scan in which no pockets were looked for, because it cannot be this ply's."""
    findings = () if placed.finding is None else (placed.finding,)
    known = {"level": placed.level, "warnings": placed.warnings, "height_map": overview}
    return _composed(findings, ply, timings_ms, **known)


def too_late(ply: PlyOnMold, stage: str, timings_ms: dict[str, float]) -> Report:
    """Report that the deadline passed before any pocket was known."""
    reason = f"the deadline passed during the stage {stage}, before any pocket was known"
    findings = (Finding("deadline", Verdict.UNDECIDED, reason),)
    return _composed(findings, ply, timings_ms, left_out=(left_out.of_stages(stage),))


def _composed(findings: tuple[Finding, ...], ply: PlyOnMold, timings_ms: dict[str, float], **known: Any) -> Report:
    """Return the report with the verdict that the findings give; it has no pockets unless they are given."""
    judged = compose(findings)
    log.info("%s: %s", judged.verdict.value, judged.reason)
    return Report(
        verdict=judged.verdict,
        reason=judged.reason,
        findings=findings,
        timings_ms=timings_ms,
        ply_outline_mm=ply.outline,
        recipe=ply.recipe.model_dump(),
        **{"pockets": (), **known},
    )


def unsettled(given: Report, seen: Seen) -> Report:
    """Return the report with what makes the nets and minima that its verdict did not need, if there are any.

    Each pocket holds its piece of the height map until its net is made, and the report all of them until it is settled.
    """
    judged, ply = seen.judged, seen.ply
    later = [
        Later(partial(settle, found, one, ply, _core.Stop())) if one.report.unsolved else None
        for found, one in zip(judged.pockets, judged.evaluations, strict=True)
    ]
    if not any(later):
        return given

    def whole() -> Report:
        with Workers(ply.recipe.run.threads) as pool:
            again = list(pool.map(lambda one, make: make() if make else one, judged.evaluations, later))
        return report(replace(seen, judged=judged_of(judged.pockets, again, ply, seen.standing, late=judged.late)), {})

    pockets = tuple(
        one if make is None else UnsettledPocket.of(one, _report_of(make))
        for one, make in zip(given.pockets, later, strict=True)
    )
    return given.changed(pockets=pockets).settled_by(Later(whole))


def _report_of(make: Later[Evaluation]) -> Callable[[], PocketReport]:
    return lambda: make().report
