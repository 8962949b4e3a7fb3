"""The pockets of a scan, evaluated one per thread at a time; a share of those that pass is audited by nets."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import replace

from debulk.inspection.evaluate.evaluated import Evaluation, refused, seen_of
from debulk.inspection.evaluate.evaluation import evaluate, settle
from debulk.inspection.find.found import FoundPocket
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.inspection.running.cycle import Cycle
from debulk.results.report import PocketReport
from debulk.verdict import Verdict
from debulk.workers import Workers


def evaluate_all(pockets: Sequence[FoundPocket], ply: PlyOnMold, cycle: Cycle, begun: float) -> list[Evaluation]:
    """Evaluate all pockets, one per thread at a time; `begun` is the share of the work that is already done."""
    evaluations = []
    # Calls of the core release the GIL. Whatever ends the wait (Ctrl-C, an error in the progress function) also ends
    # the solvers.
    with Workers(ply.recipe.run.threads, cycle.stop) as pool:
        for evaluation in pool.map(lambda found: evaluate(found, ply, cycle.stop), pockets):
            evaluations.append(evaluation)
            cycle.report("debulk", begun + (1 - begun) * len(evaluations) / len(pockets))
    cycle.check()
    return evaluations


def audit(pockets: Sequence[FoundPocket], done: Sequence[Evaluation], ply: PlyOnMold, cycle: Cycle) -> list[Evaluation]:
    """Evaluate a share of the pockets by their nets, too, which the excess has decided without (``run.audit``).

    Their outlines choose them, so that the same scan gives the same choice. They come last: a deadline cuts off an
    audit, and no verdict for its sake.
    """

    def whole(found: FoundPocket, one: Evaluation) -> Evaluation:
        number = zlib.crc32(one.report.outline_mm.tobytes()) / 2**32  # from 0 to 1
        if not one.report.unsolved or number >= ply.recipe.run.audit:
            return one
        audited = settle(found, one, ply, cycle.stop)
        return one if audited.late else replace(audited, turned=_net_bridges(audited.report, ply))

    with Workers(ply.recipe.run.threads, cycle.stop) as pool:
        audited = list(pool.map(whole, pockets, done))
    cycle.check()
    return audited


def _net_bridges(pocket: PocketReport, ply: PlyOnMold) -> str:
    """Say that the certified minimum of a pocket that is CEASE bridges above the limit; empty: it does not."""
    bridge_mm, certified = pocket.bridge_height_mm or 0.0, pocket.solve is not None and pocket.solve.certified
    if pocket.verdict is not Verdict.CEASE or not certified or bridge_mm <= ply.recipe.verdict.max_ridge_mm:
        return ""
    return f"pocket {pocket.id} is CEASE by its fibre lines ({pocket.reason}), but its net bridges {bridge_mm:.2f} mm"


def not_judged(pockets: Sequence[FoundPocket], why: str) -> list[Evaluation]:
    """Report pockets for which nothing was computed because the whole scan cannot be judged."""
    return [refused(seen_of(found), why) for found in pockets]
