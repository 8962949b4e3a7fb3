"""The report of an inspection: what its checks found, the verdict that follows, and what was left out."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Any

from debulk.grid import Grid
from debulk.inspection import left_out
from debulk.inspection.bumps import tolerances
from debulk.inspection.bumps.tolerances import Bump
from debulk.inspection.checks import shared_runs
from debulk.inspection.evaluate.evaluation import Evaluation
from debulk.inspection.evaluate.laid_pocket import criteria
from debulk.inspection.find.found import Found, FoundPocket
from debulk.inspection.holes import unseen
from debulk.inspection.place.placing import Placed
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.inspection.rawscan import wrinkles
from debulk.inspection.rawscan.filled import Filled
from debulk.inspection.rawscan.wrinkles import Standing
from debulk.report import Report
from debulk.results.compose import compose
from debulk.results.finding import Finding
from debulk.results.report import PocketReport
from debulk.verdict import Judgement, Verdict, judge_layup

__all__ = ["out_of_place", "report", "too_late"]

_NO_OUTLINE = (
    "the ply's outline is not given: where that lies beside the ply, or at the mold's edge, give it (ply_outline, "
    "--outline)"
)
log = logging.getLogger("debulk")


def report(
    found: Found,
    placed: Placed,
    filled: Filled,
    bumps: Sequence[Bump],
    standing: Standing,
    others: Sequence[Finding],
    judged_as: Sequence[FoundPocket],
    evaluations: Sequence[Evaluation],
    ply: PlyOnMold,
    timings_ms: dict[str, float],
) -> Report:
    """Judge the layup by its evaluated pockets and by the findings of everything else, and report it.

    Evaluations and `judged_as` are in the same order: first the pockets found, then the bumps judged as pockets.
    """
    seen = found.unseen.coverage
    pockets = shared_runs.named([evaluation.report for evaluation in evaluations], judged_as, bumps, ply)
    findings = [
        *_of_place(found, placed, ply),
        *_of_coverage(found, ply),
        *_mentioned(found, placed, ply),
        *_of_pockets(pockets, evaluations, seen, ply),
        *_of_unseen(found, pockets, bumps, ply),
        *tolerances.findings(bumps),
        *shared_runs.findings(found.runs, judged_as, ply),
        *others,
        *wrinkles.findings(standing, ply.recipe),
        *filled.findings(ply.recipe),
    ]
    judged = compose(findings)
    entries = tolerances.left_out(bumps, ply.recipe)
    entries += left_out.of_scan(found, ply.outline is not None, standing.bumps is not None)
    entries += standing.left_out + filled.left_out()
    entries += tuple(entry for evaluation in evaluations for entry in evaluation.left_out)
    entries += left_out.of_late([(one.report.id, one.late) for one in evaluations if one.late])
    log.info("%s: %s", judged.verdict.value, judged.reason)
    return Report(
        verdict=judged.verdict,
        reason=judged.reason,
        findings=tuple(findings),
        pockets=pockets,
        timings_ms=timings_ms,
        left_out=left_out.merged(entries),
        coverage=seen,
        unseen=unseen.holes(found, pockets, ply.recipe),
        wrinkles=standing.wrinkles,
        level=placed.level,
        warnings=placed.warnings,
        height_map=found.overview,
        excess_map=None if found.runs is None else found.runs.largest,
        ply_outline_mm=ply.outline,
        recipe=ply.recipe.model_dump(),
    )


def _of_place(found: Found, placed: Placed, ply: PlyOnMold) -> list[Finding]:
    """Return what the checks of the place found.

    Too little coverage is a more helpful reason than a level that could not be read because of it. If no pockets were
    looked for, the level does not count either: the pockets stand in the squares that it is read from.
    """
    telling = placed.level is not None or found.unseen.coverage >= ply.recipe.verdict.min_coverage
    return [placed.finding] if placed.finding is not None and telling and not found.doubt else []


def _of_coverage(found: Found, ply: PlyOnMold) -> list[Finding]:
    """Return INVALID if too little of the ply was seen."""
    seen, least = found.unseen.coverage, ply.recipe.verdict.min_coverage
    if seen >= least:
        return []
    reason = judge_layup([], seen, criteria(ply.recipe)).reason
    return [
        Finding("coverage", Verdict.INVALID, reason, seen, least),
        *unseen.missing_reference(found, ply.recipe),
    ]


def _mentioned(found: Found, placed: Placed, ply: PlyOnMold) -> list[Finding]:
    """Mention what may be the cause of a layup that cannot be judged."""
    mentioned = []
    if ply.outline is None and not _of_place(found, placed, ply):
        mentioned.append(Finding("outline", None, _NO_OUTLINE))
    if found.doubt:
        mentioned.append(Finding("search", None, found.doubt))
    return mentioned


def _of_pockets(
    pockets: Sequence[PocketReport], evaluations: Sequence[Evaluation], seen: float, ply: PlyOnMold
) -> list[Finding]:
    """Return the verdict of the worst pocket, and name those that only the deadline kept from one."""
    limits = criteria(ply.recipe)
    judged = judge_layup(
        [(p.id, Judgement(p.verdict, p.reason)) for p in pockets], max(seen, limits.min_coverage), limits
    )
    worst = max(pockets, key=lambda p: p.verdict.severity, default=None)
    late = [
        Finding("deadline", None, f"the deadline cut off the {one.late} of pocket {p.id}", pocket=p.id)
        for p, one in zip(pockets, evaluations, strict=True)
        if one.late and p.verdict is Verdict.UNDECIDED and not p.decided_by
    ]
    return [Finding("pockets", judged.verdict, judged.reason, pocket=None if worst is None else worst.id), *late]


def _of_unseen(found: Found, pockets: Sequence[PocketReport], bumps: Sequence[Bump], ply: PlyOnMold) -> list[Finding]:
    """Return what may lie in the parts of the ply that were not seen."""
    taken = [bump.dropped for bump in bumps if bump.found is not None]  # the last of the pockets
    halves = [p.half_seen for p in pockets[len(pockets) - len(taken) :]]
    judged_bumps = [bump for bump, half in zip(taken, halves, strict=True) if half is not None and half.ways]
    return unseen.findings(found, pockets, ply.recipe, judged_bumps)


def out_of_place(placed: Placed, overview: Grid, ply: PlyOnMold, timings_ms: dict[str, float]) -> Report:
    """Report a scan in which no pockets were looked for, because it cannot be this ply's."""
    findings = () if placed.finding is None else (placed.finding,)
    known = {"level": placed.level, "warnings": placed.warnings, "height_map": overview}
    return _without_pockets(findings, ply, timings_ms, known)


def too_late(ply: PlyOnMold, stage: str, timings_ms: dict[str, float]) -> Report:
    """Report that the deadline passed before any pocket was known."""
    reason = f"the deadline passed during the stage {stage}, before any pocket was known"
    findings = (Finding("deadline", Verdict.UNDECIDED, reason),)
    return _without_pockets(findings, ply, timings_ms, {"left_out": left_out.of_stages(stage)})


def _without_pockets(
    findings: tuple[Finding, ...], ply: PlyOnMold, timings_ms: dict[str, float], known: dict[str, Any]
) -> Report:
    judged = compose(findings)
    log.info("%s: %s", judged.verdict.value, judged.reason)
    return Report(
        verdict=judged.verdict,
        reason=judged.reason,
        findings=findings,
        pockets=(),
        timings_ms=timings_ms,
        ply_outline_mm=ply.outline,
        recipe=ply.recipe.model_dump(),
        **known,
    )
