"""The evaluation of one pocket: by the excess of its fibre lines, or lay its net, settle it, post-process, judge."""

from __future__ import annotations

import logging
import time
import zlib
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from debulk import _core, ridge, solve, verdict
from debulk.inspection.evaluate import (
    both_ways,
    bridge_sections,
    by_runs,
    dumps,
    edge_friction,
    left_out,
    ridges,
    starts,
)
from debulk.inspection.evaluate.evaluated import Evaluation
from debulk.inspection.evaluate.laid_pocket import REFUSED, LaidPocket, criteria, lay_pocket
from debulk.inspection.find.found import FoundPocket
from debulk.inspection.holes import pocket_holes, unseen
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.inspection.running.cycle import Cycle
from debulk.recipe import options
from debulk.results.report import ExcessReport, PocketNet, PocketReport, SolveReport
from debulk.stopping import stopping
from debulk.workers import Workers

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["Evaluation", "audit", "evaluate", "evaluate_all", "not_judged", "settle"]

log = logging.getLogger("debulk")


def evaluate_all(pockets: Sequence[FoundPocket], ply: PlyOnMold, cycle: Cycle, begun: float) -> list[Evaluation]:
    """Evaluate all pockets, one per thread at a time; `begun` is the share of the work that is already done."""
    threads = ply.recipe.run.threads or _core.default_threads()
    evaluations = []
    # Calls of the core release the GIL. Whatever ends the wait (Ctrl-C, an error in the progress function) also ends
    # the solvers.
    with Workers(threads) as pool, stopping(cycle.stop):
        for evaluation in pool.map(lambda found: evaluate(found, ply, cycle.stop, pool), pockets):
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
        if not one.report.unsolved or _number_of(one.report) >= ply.recipe.run.audit:
            return one
        audited = settle(found, one, ply, cycle.stop, pool)
        return one if audited.late else audited

    with Workers(ply.recipe.run.threads or _core.default_threads()) as pool, stopping(cycle.stop):
        audited = list(pool.map(whole, pockets, done))
    cycle.check()
    return audited


def _number_of(pocket: PocketReport) -> float:
    """Return a number from 0 to 1, without 1, that follows from the pocket's outline."""
    return zlib.crc32(pocket.outline_mm.tobytes()) / 2**32


def settle(
    found: FoundPocket, decided: Evaluation, ply: PlyOnMold, stop: _core.Stop, pool: Executor | None = None
) -> Evaluation:
    """Evaluate a pocket by its net that the excess has decided without one; its verdict becomes no better."""
    recipe = ply.recipe.model_copy(update={"solve": ply.recipe.solve.model_copy(update={"when": "always"})})
    return evaluate(found, replace(ply, recipe=recipe), stop, pool).no_better_than(decided)


def evaluate(found: FoundPocket, ply: PlyOnMold, stop: _core.Stop, pool: Executor | None = None) -> Evaluation:
    """Evaluate one pocket; idle threads of the pool help, see `starts.settle`.

    An unexpected error does not prevent the report: the pocket is INVALID, and the error is its reason.
    """
    seen = _seen(found)
    if stop.now():
        return _late(found, seen)
    try:
        hole = pocket_holes.holes_of(found, ply)
        if hole is not None:
            return both_ways.judged(
                found, seen, hole, ply, stop, lambda piece: _with_closed_rim(piece, ply, stop, pool)
            )
        if not found.foot.closed:
            return _not_evaluated(seen, verdict.judge(certified=False, refused=unseen.open_rim(found)))
        spacing_mm = found.segmentation.heights.spacing_mm
        if found.promoted and (specks := unseen.single_points(found.pocket, found.unseen, spacing_mm, ply.recipe)):
            share = found.pocket.measured_share
            return _not_evaluated(seen, _refused(found, f"it was seen to {100 * share:.0f} % only{specks}: scan again"))
        return _with_closed_rim(found, ply, stop, pool)
    except _core.Stopped:
        return _late(found, seen)
    except Exception as error:
        log.exception("pocket %d could not be evaluated", found.number)
        what = " ".join(str(error).split())
        refused = f"an unexpected error, {type(error).__name__}{': ' if what else ''}{what}; please report it"
        return _not_evaluated(seen, verdict.judge(certified=False, refused=refused))


def _with_closed_rim(found: FoundPocket, ply: PlyOnMold, stop: _core.Stop, pool: Executor | None) -> Evaluation:
    """Evaluate a pocket whose rim is closed, by the excess of its fibre lines alone if that is enough."""
    seen, watch = _seen(found), _Stopwatch()
    if ply.recipe.solve.when == "needed":
        with watch.step("excess"):
            decided = by_runs.judged(found, ply)
        if decided is not None:
            known, judged = decided[0], _with_joined(decided[1], found)
            report = _not_evaluated(seen, judged).report
            of_lines = {"decided_by": judged.decided_by, "excess": _alone(known, ply.recipe), **watch.figures()}
            return Evaluation(replace(report, **of_lines))
    return _by_net(found, seen, ply, watch, stop, pool)


def _by_net(
    found: FoundPocket,
    seen: PocketReport,
    ply: PlyOnMold,
    watch: _Stopwatch,
    stop: _core.Stop,
    pool: Executor | None,
) -> Evaluation:
    try:
        with watch.step("net"):
            laid = lay_pocket(found, ply, stop)
    except _core.InputError as error:  # here the data are at fault, not the user: no net can be laid on the surface
        return _not_evaluated(seen, _refused(found, f"no net could be laid: {error}"))

    def post_process(solution: solve.Solution) -> ridge.PostProcessed:
        with watch.step("ridge"):
            return laid.post_process(solution)

    with watch.step("solve"):
        settled = starts.settle(laid.sheet, ply.recipe, post_process, stop, pool, for_the_picture=laid.by_excess)
    dumps.keep(
        laid.sheet,
        settled.solution,
        settled.solution.status in REFUSED,
        watch.split_ms["solve"],
        found.number,
        ply.recipe,
        first=int(laid.by_excess and len(settled.solution.minima) == 1),
    )
    late = settled.cut or (stop.past_deadline and not settled.solution.certified)
    by_rule, by_paper = (
        laid.judge(settled.solution, settled.best, settled.every, deadline_passed=late, criterion=criterion)
        for criterion in (None, "paper")
    )
    with watch.step("solve"):
        ends = edge_friction.at_both_ends(laid, settled, by_rule, post_process, stop, pool)
    with watch.step("ridge"):
        bridge = bridge_sections.weighed(ends.judged, laid, settled, found, ply, stop)
    by_rule = replace(bridge.judged, reason=bridge.judged.reason + _drawn_in(settled.best, laid.recipe))
    unjudged = settled.solution.explanation if settled.solution.status in REFUSED else ""
    if found.promoted and (unjudged or not laid.closed_rim):
        by_rule = _refused(found, unjudged or "the rim of its net is not closed")
    by_rule = _with_joined(by_rule, found)
    with watch.step("ridge"):
        held = laid.excess is not None
        stands = ridges.of_excess(laid, found.foot) if held else ridges.of_minima(laid, ends.shown, found.foot)
    report = replace(
        seen,
        verdict=by_rule.verdict,
        reason=by_rule.reason,
        remedy=by_rule.remedy,
        decided_by=by_rule.decided_by,
        paper_verdict=by_paper.verdict,
        excess=None if laid.excess is None else _alone(laid.excess, laid.recipe),
        ridges=stands,
        edge_friction=ends.report,
        bridge_section=bridge.section,
        **watch.figures(),
        **_net_figures(laid),
        **_debulked_figures(laid, ends.counted),
    )
    cut = "the certified minimum" if late and not settled.cut else ends.late or bridge.late
    return Evaluation(report, left_out.of_pocket(laid.sheet, settled) + ends.left_out, cut)


def _alone(known: ExcessReport, recipe: Recipe) -> ExcessReport:
    """Return the ridge by the excess with the verdict by it alone."""
    limits, mm = criteria(recipe, "excess"), known.range_mm
    alone = verdict.judge(certified=False, inside_ply=True, excess_range_mm=mm, no_bridge=True, criteria=limits)
    return replace(known, verdict=alone.verdict)


def not_judged(pockets: Sequence[FoundPocket], why: str) -> list[Evaluation]:
    """Report pockets for which nothing was computed because the whole scan cannot be judged."""
    return [_not_evaluated(_seen(found), verdict.judge(certified=False, refused=why)) for found in pockets]


@dataclass
class _Stopwatch:
    """Milliseconds per step, without those of the steps nested in it."""

    split_ms: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        began, before_ms = time.perf_counter(), sum(self.split_ms.values())
        yield
        within_ms = sum(self.split_ms.values()) - before_ms
        self.split_ms[name] = self.split_ms.get(name, 0.0) + 1e3 * (time.perf_counter() - began) - within_ms

    def figures(self) -> dict[str, Any]:
        """Return the times as a report has them."""
        return {"runtime_ms": sum(self.split_ms.values()), "runtime_split_ms": self.split_ms}


def _seen(found: FoundPocket) -> PocketReport:
    """Report what is known of a pocket before its ply is modelled."""
    return PocketReport(
        id=found.number,
        verdict=verdict.Verdict.INVALID,
        reason="",
        outline_mm=found.pocket.outline_mm,
        foot_outline_mm=found.foot.outline_mm,
        touches_ply_edge=found.pocket.touches_ply_edge,
        area_mm2=found.pocket.area_mm2,
        peak_mm=found.pocket.peak_mm,
        volume_mm3=found.pocket.volume_mm3,
        measured_share=found.pocket.measured_share,
        promoted=found.promoted,
    )


def _not_evaluated(seen: PocketReport, judged: verdict.Judgement) -> Evaluation:
    return Evaluation(replace(seen, verdict=judged.verdict, reason=judged.reason, remedy=judged.remedy))


def _late(found: FoundPocket, seen: PocketReport) -> Evaluation:
    judged = verdict.judge(certified=False, deadline_passed=True, coverage=found.pocket.measured_share)
    return replace(_not_evaluated(seen, judged), late="net and minimum")


def _with_joined(judged: verdict.Judgement, found: FoundPocket) -> verdict.Judgement:
    """Name the pockets that are judged with this one."""
    if not found.joined:
        return judged
    names = ", ".join(str(number) for number in found.joined)
    others = f"pocket{'s' * (len(found.joined) > 1)} {names}"
    return replace(judged, reason=f"{judged.reason}; judged in one net with {others}, whose foot is the same")


def _refused(found: FoundPocket, why: str) -> verdict.Judgement:
    """Judge a pocket without a result of its net; a bump below the tolerances is UNDECIDED, as it may crease."""
    if not found.promoted:
        return verdict.judge(certified=False, refused=why)
    return verdict.Judgement(verdict.Verdict.UNDECIDED, f"{found.promoted}; not evaluated: {why}")


def _net_figures(laid: LaidPocket) -> dict[str, Any]:
    net = laid.net
    return {
        "spacing_mm": net.spacing_mm,
        "node_count": len(net.nodes_mm),
        "net": PocketNet(
            nodes_mm=net.nodes_mm,
            neighbours=net.neighbours,
            kinds=net.kinds.astype(np.uint8),
            edges=net.edges,
            inside=net.inside,
        ),
        "initial_gap_mm": laid.sheet.gaps(net.nodes_mm),
    }


def _debulked_figures(laid: LaidPocket, settled: starts.Settled) -> dict[str, Any]:
    solution, best = settled.solution, settled.best
    worst = max(best.sections, key=lambda section: section.height_mm, default=None)
    return {
        "rms_mm": best.rms_mm,
        "rms_range_mm": settled.rms_mm,
        "ridge_height_mm": best.ridge_height_mm,
        "ridge_range_mm": settled.ridge_mm,
        "ridge_length_mm": best.ridge_length_mm,
        "ridge_nodes": None if worst is None else np.array(worst.nodes, dtype=np.int32),
        "bridge_height_mm": best.bridge_height_mm,
        **_drawn_in_figures(best),
        "excess_length_mm": laid.held_excess_mm,
        "debulked_mm": solution.nodes_mm,
        "debulked_gap_mm": laid.sheet.gaps(solution.nodes_mm),
        "post_processed_gap_mm": best.gap_mm,
        "energy_mj": solution.energy_mj,
        "energy_terms_mj": laid.sheet.terms(solution.nodes_mm),
        "solve": _solve_report(laid, solution),
    }


def _drawn_in_figures(best: ridge.PostProcessed) -> dict[str, float]:
    if not best.is_drawn_in.any():
        return {}
    return {
        "drawn_in_mm": best.drawn_in_height_mm,
        "drawn_in_tension_n_per_mm": best.drawn_in_tension_n_per_mm,
        "drawn_in_hold_n_per_mm": best.drawn_in_hold_n_per_mm,
    }


def _drawn_in(best: ridge.PostProcessed, recipe: Recipe) -> str:
    """Name a bridge of the model that is not counted although it is high enough to count and higher than the others."""
    if best.drawn_in_height_mm <= max(options.counts_from_mm(recipe), best.bridge_height_mm):
        return ""
    return (
        f"; a bridge of {best.drawn_in_height_mm:.2f} mm is not counted: it pulls with "
        f"{best.drawn_in_tension_n_per_mm:.3g} N/mm, friction holds {best.drawn_in_hold_n_per_mm:.3g} N/mm, and the "
        "ply is drawn in"
    )


def _solve_report(laid: LaidPocket, solution: solve.Solution) -> SolveReport:
    certificate = solution.certificate
    return SolveReport(
        method=laid.recipe.solve.method,
        status=solution.status,
        certified=solution.certified,
        iterations=solution.iterations,
        evaluations=solution.evaluations,
        length_error=certificate.length_error,
        penetration_mm=certificate.penetration_mm,
        kkt_error=certificate.kkt_error,
        curvature=certificate.curvature,
        energy_gain_mj=laid.sheet.energy(laid.sheet.start_mm) - solution.energy_mj,
        compliant=certificate.compliant,
        starts=len(solution.minima),
        doubt=certificate.failure,
    )
