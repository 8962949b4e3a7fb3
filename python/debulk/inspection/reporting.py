"""What an inspection reports: the layup's verdict from its pockets', the coverage, and what was left out."""

from __future__ import annotations

import logging
from collections.abc import Sequence

import numpy as np

from debulk import pocket
from debulk.inspection import left_out
from debulk.inspection.evaluation import Evaluation
from debulk.inspection.found import Found
from debulk.inspection.laid_pocket import criteria
from debulk.inspection.ply_on_mold import PlyOnMold
from debulk.inspection.prepared import Prepared
from debulk.report import Report
from debulk.verdict import Judgement, Verdict, judge_layup

__all__ = ["coverage", "report", "too_late"]

log = logging.getLogger("debulk")


def report(
    found: Found,
    evaluations: Sequence[Evaluation],
    ply: PlyOnMold,
    prepared: Prepared,
    timings_ms: dict[str, float],
) -> Report:
    """Judge the layup by its evaluated pockets, and report all of it."""
    seen = coverage(found, ply, prepared)
    pockets = tuple(evaluation.report for evaluation in evaluations)
    judged = judge_layup([(p.id, Judgement(p.verdict, p.reason)) for p in pockets], seen, criteria(ply.recipe))
    entries = left_out.of_scan(found, ply.outline is not None, ply.recipe)
    entries += tuple(entry for evaluation in evaluations for entry in evaluation.left_out)
    log.info("%s: %s", judged.verdict.value, judged.reason)
    return Report(
        verdict=judged.verdict,
        reason=judged.reason,
        pockets=pockets,
        timings_ms=timings_ms,
        left_out=left_out.merged(entries),
        coverage=seen,
        height_map=found.overview,
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
        ply_outline_mm=ply.outline,
        recipe=ply.recipe.model_dump(),
    )


def coverage(found: Found, ply: PlyOnMold, prepared: Prepared) -> float:
    """Share of the ply (no outline: of the reference) whose height is known, measured or filled in by the rule."""
    expected: float
    if ply.outline is None:
        expected = np.count_nonzero(np.isfinite(prepared.seen.values)) * prepared.grid_spacing_mm**2
    else:
        expected = abs(pocket.polygon_area(ply.outline))
    return float(min(1.0, found.known_mm2 / expected))
