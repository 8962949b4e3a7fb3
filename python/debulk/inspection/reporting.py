"""The report of an inspection: the layup's verdict from those of its pockets, the coverage, and what was left out."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import replace

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
    others: Sequence[Judgement],
    judged_as: Sequence[FoundPocket],
    evaluations: Sequence[Evaluation],
    ply: PlyOnMold,
    timings_ms: dict[str, float],
) -> Report:
    """Judge the layup by its evaluated pockets and by the judgements `others` of everything else, and report it.

    Evaluations and `judged_as` are in the same order: first the pockets found, then the bumps judged as pockets.
    """
    seen = found.unseen.coverage
    pockets = shared_runs.named([evaluation.report for evaluation in evaluations], judged_as, bumps, ply)
    judged = judge_layup([(p.id, Judgement(p.verdict, p.reason)) for p in pockets], seen, criteria(ply.recipe))
    judged = unseen.missing_reference(judged, found, ply.recipe)
    taken = [bump.dropped for bump in bumps if bump.found is not None]  # the last of the pockets
    halves = [p.half_seen for p in pockets[len(pockets) - len(taken) :]]
    judged_bumps = [bump for bump, half in zip(taken, halves, strict=True) if half is not None and half.ways]
    unknown = unseen.doubts(found, pockets, ply.recipe, judged_bumps)
    shared = shared_runs.doubts(found.runs, judged_as, ply)
    judged = unseen.worst(judged, [*unknown, *tolerances.doubts(bumps), *shared, *others])
    judged = unseen.worst(judged, [*wrinkles.doubts(standing, ply.recipe), *filled.doubts(ply.recipe)])
    if ply.outline is None and judged.verdict is Verdict.INVALID:
        judged = replace(judged, reason=f"{judged.reason}; {_NO_OUTLINE}")
    # Too little coverage is a more helpful reason than a level that could not be read because of it. If no pockets were
    # looked for, the level's doubt does not count either: the pockets stand in the squares that the level is read from.
    telling = placed.level is not None or seen >= ply.recipe.verdict.min_coverage
    if placed.doubt and telling and not found.doubt:
        judged = Judgement(Verdict.INVALID, placed.doubt)
    entries = tolerances.left_out(bumps, ply.recipe)
    entries += left_out.of_scan(found, ply.outline is not None, standing.bumps is not None)
    entries += standing.left_out + filled.left_out()
    entries += tuple(entry for evaluation in evaluations for entry in evaluation.left_out)
    entries += left_out.of_late([(one.report.id, one.late) for one in evaluations if one.late])
    reason = judged.reason + (f"; {found.doubt}" if found.doubt else "")
    log.info("%s: %s", judged.verdict.value, reason)
    return Report(
        verdict=judged.verdict,
        reason=reason,
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


def out_of_place(placed: Placed, overview: Grid, ply: PlyOnMold, timings_ms: dict[str, float]) -> Report:
    """Report a scan in which no pockets were looked for, because it cannot be this ply's."""
    log.info("%s: %s", Verdict.INVALID.value, placed.doubt)
    return Report(
        verdict=Verdict.INVALID,
        reason=placed.doubt,
        pockets=(),
        timings_ms=timings_ms,
        level=placed.level,
        warnings=placed.warnings,
        height_map=overview,
        ply_outline_mm=ply.outline,
        recipe=ply.recipe.model_dump(),
    )


def too_late(ply: PlyOnMold, stage: str, timings_ms: dict[str, float]) -> Report:
    """Report that the deadline passed before any pocket was known."""
    return Report(
        verdict=Verdict.UNDECIDED,
        reason=f"the deadline passed during the stage {stage}, before any pocket was known",
        pockets=(),
        timings_ms=timings_ms,
        left_out=left_out.of_stages(stage),
        ply_outline_mm=ply.outline,
        recipe=ply.recipe.model_dump(),
    )
