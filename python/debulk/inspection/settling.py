"""The nets and minima that a verdict did not need are made when somebody looks, to the same bits at any time."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from debulk import _core
from debulk.inspection import reporting
from debulk.inspection.checks import shared_runs
from debulk.inspection.checks.seen import Seen
from debulk.inspection.evaluate.evaluated import Evaluation
from debulk.inspection.evaluate.evaluation import settle
from debulk.report import Report
from debulk.results.report import PocketReport
from debulk.results.unsettled import Later, UnsettledPocket
from debulk.workers import Workers


def unsettled(report: Report, seen: Seen) -> Report:
    """Return the report with what makes the nets and minima that its verdict did not need, if there are any.

    Each pocket holds its piece of the height map until its net is made, and the report all of them until it is settled.
    """
    judged, ply = seen.judged, seen.ply
    later = [
        Later(partial(settle, found, one, ply, _core.Stop())) if one.report.unsolved else None
        for found, one in zip(judged.pockets, judged.evaluations, strict=True)
    ]
    if not any(later):
        return report

    def whole() -> Report:
        with Workers(ply.recipe.run.threads or _core.default_threads()) as pool:
            again = list(pool.map(lambda one, make: make() if make else one, judged.evaluations, later))
        reports = shared_runs.named([one.report for one in again], judged.pockets, ply)
        return reporting.report(replace(seen, judged=replace(judged, evaluations=again, reports=reports)), {})

    pockets = tuple(
        one if make is None else _unsettled(one, make) for one, make in zip(report.pockets, later, strict=True)
    )
    return report.changed(pockets=pockets).settled_by(Later(whole))


def _unsettled(pocket: PocketReport, make: Later[Evaluation]) -> PocketReport:
    return UnsettledPocket.of(pocket, lambda: make().report)
