"""The evaluation of one pocket: by the excess of its fibre lines, or lay its net, settle it, post-process, judge."""

from __future__ import annotations

import logging
import time
import zlib
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from debulk import _core, ridge, solve, verdict
from debulk.inspection.evaluate import both_ways, dumps, edge_friction, left_out, ridges, starts
from debulk.inspection.evaluate.bridges import bridge_over
from debulk.inspection.evaluate.by_runs import ByRuns, by_runs, surely_held
from debulk.inspection.evaluate.evaluated import Evaluation
from debulk.inspection.evaluate.laid_pocket import REFUSED, LaidPocket, lay_pocket
from debulk.inspection.find.found import FoundPocket
from debulk.inspection.holes import pocket_holes, unseen
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.inspection.running.cycle import Cycle
from debulk.results.report import PocketNet, PocketReport, SolveReport
from debulk.stopping import stopping
from debulk.verdict import Verdict
from debulk.workers import Workers

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
        return one if audited.late else replace(audited, turned=_net_bridges(audited.report, ply))

    with Workers(ply.recipe.run.threads or _core.default_threads()) as pool, stopping(cycle.stop):
        audited = list(pool.map(whole, pockets, done))
    cycle.check()
    return audited


def _net_bridges(pocket: PocketReport, ply: PlyOnMold) -> str:
    """Say that the certified minimum of a pocket that is CEASE bridges above the limit; empty: it does not."""
    bridge_mm, certified = pocket.bridge_height_mm or 0.0, pocket.solve is not None and pocket.solve.certified
    if pocket.verdict is not Verdict.CEASE or not certified or bridge_mm <= ply.recipe.verdict.max_ridge_mm:
        return ""
    return f"pocket {pocket.id} is CEASE by its fibre lines ({pocket.reason}), but its net bridges {bridge_mm:.2f} mm"


def _number_of(pocket: PocketReport) -> float:
    """Return a number from 0 to 1, without 1, that follows from the pocket's outline."""
    return zlib.crc32(pocket.outline_mm.tobytes()) / 2**32


def settle(
    found: FoundPocket, decided: Evaluation, ply: PlyOnMold, stop: _core.Stop, pool: Executor | None = None
) -> Evaluation:
    """Add net and minimum to a pocket that was decided without; its verdict stays as it is."""
    recipe = ply.recipe.model_copy(update={"solve": ply.recipe.solve.model_copy(update={"when": "always"})})
    return decided.with_picture_of(evaluate(found, replace(ply, recipe=recipe), stop, pool))


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
    """Evaluate a pocket whose rim is closed: by its fibre lines if that is held, else by its minima."""
    seen, watch = _seen(found), _Stopwatch()
    paper = ply.recipe.verdict.criterion == "paper"
    try:
        laid = _lay(found, ply, watch, stop) if paper or not surely_held(found, ply) else None
        if laid is not None and (paper or not laid.held):
            return _by_minima(seen, laid, found, ply, watch, stop, pool)
        with watch.step("excess"):
            decided = by_runs(found, ply, stop)
    except _core.InputError as error:  # here the data are at fault, not the user: no net can be laid, or angles lack
        return _not_evaluated(seen, _refused(found, str(error)))
    done = _decided(seen, decided, found, watch)
    if ply.recipe.solve.when == "needed":
        return done
    try:
        return _with_picture(done, laid or _lay(found, ply, watch, stop), found, watch, stop, pool)
    except _core.InputError:  # no net can be laid, and there is no picture
        return done
    except _core.Stopped:
        return replace(done, late="net and minimum")


def _lay(found: FoundPocket, ply: PlyOnMold, watch: _Stopwatch, stop: _core.Stop) -> LaidPocket:
    with watch.step("net"):
        try:
            return lay_pocket(found, ply, stop)
        except _core.InputError as error:
            raise _core.InputError(f"no net could be laid: {error}") from None


def _decided(seen: PocketReport, decided: ByRuns, found: FoundPocket, watch: _Stopwatch) -> Evaluation:
    """Report what the fibre lines decide."""
    judged = _with_joined(decided.judged, found)
    report = replace(
        _not_evaluated(seen, judged).report,
        decided_by=judged.decided_by,
        excess=decided.excess,
        bridge_section=decided.bridge.section,
        **watch.figures(),
    )
    return Evaluation(report)


def _with_picture(
    done: Evaluation,
    laid: LaidPocket,
    found: FoundPocket,
    watch: _Stopwatch,
    stop: _core.Stop,
    pool: Executor | None,
) -> Evaluation:
    """Add the net of a pocket that its lines decided, and one minimum, which decides nothing."""
    settled, late = _settled(laid, found, _timed(laid, watch), watch, stop, pool, for_the_picture=True)
    known = done.report.excess
    with watch.step("ridge"):
        stands = () if known is None else ridges.of_excess(laid, known, found.foot)
    by_paper = laid.judge(settled.solution, settled.best, settled.every, deadline_passed=late, criterion="paper")
    report = replace(
        done.report,
        paper_verdict=by_paper.verdict,
        ridges=stands,
        **watch.figures(),
        **_net_figures(laid),
        **_debulked_figures(laid, settled),
    )
    late_for = "the certified minimum" if late else ""
    return Evaluation(report, left_out.of_pocket(laid.sheet, settled), late_for)


def _by_minima(
    seen: PocketReport,
    laid: LaidPocket,
    found: FoundPocket,
    ply: PlyOnMold,
    watch: _Stopwatch,
    stop: _core.Stop,
    pool: Executor | None,
) -> Evaluation:
    """Judge a pocket by its minima: at the ply's edge, where fibres may slip, and by the paper's criterion."""
    bridge = known = None
    with watch.step("excess"):
        if ply.recipe.verdict.criterion == "excess":
            bridge = bridge_over(found, ply, stop)
        elif laid.held:
            known = by_runs(found, ply, stop).excess
    post_process = _timed(laid, watch)
    settled, late = _settled(laid, found, post_process, watch, stop, pool)
    by_rule = laid.judge(settled.solution, settled.best, settled.every, bridge=bridge, deadline_passed=late)
    by_paper = laid.judge(settled.solution, settled.best, settled.every, deadline_passed=late, criterion="paper")
    with watch.step("solve"):
        ends = edge_friction.at_both_ends(laid, settled, by_rule, bridge, post_process, stop, pool)
    by_rule = ends.judged
    unjudged = settled.solution.explanation if settled.solution.status in REFUSED else ""
    if found.promoted and (unjudged or not laid.closed_rim):
        by_rule = _refused(found, unjudged or "the rim of its net is not closed")
    by_rule = _with_joined(by_rule, found)
    with watch.step("ridge"):
        stands = ridges.of_excess(laid, known, found.foot) if known else ridges.of_minima(laid, ends.shown, found.foot)
    report = replace(
        seen,
        verdict=by_rule.verdict,
        reason=by_rule.reason,
        remedy=by_rule.remedy,
        decided_by=by_rule.decided_by,
        paper_verdict=by_paper.verdict,
        excess=known,
        ridges=stands,
        edge_friction=ends.report,
        bridge_section=None if bridge is None else bridge.section,
        **watch.figures(),
        **_net_figures(laid),
        **_debulked_figures(laid, ends.counted),
    )
    cut = "the certified minimum" if late and not settled.cut else ends.late
    return Evaluation(report, left_out.of_pocket(laid.sheet, settled) + ends.left_out, cut)


def _timed(laid: LaidPocket, watch: _Stopwatch) -> starts.PostProcess:
    def post_process(solution: solve.Solution) -> ridge.PostProcessed:
        with watch.step("ridge"):
            return laid.post_process(solution)

    return post_process


def _settled(
    laid: LaidPocket,
    found: FoundPocket,
    post_process: starts.PostProcess,
    watch: _Stopwatch,
    stop: _core.Stop,
    pool: Executor | None,
    *,
    for_the_picture: bool = False,
) -> tuple[starts.Settled, bool]:
    """Minimise the energy; return the minima, and whether a deadline cut them off."""
    with watch.step("solve"):
        settled = starts.settle(laid.sheet, laid.recipe, post_process, stop, pool, for_the_picture=for_the_picture)
    dumps.keep(
        laid.sheet,
        settled.solution,
        settled.solution.status in REFUSED,
        watch.split_ms["solve"],
        found.number,
        laid.recipe,
        first=int(for_the_picture and len(settled.solution.minima) == 1),
    )
    return settled, settled.cut or (stop.past_deadline and not settled.solution.certified)


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
        verdict=Verdict.INVALID,
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
    return verdict.Judgement(Verdict.UNDECIDED, f"{found.promoted}; not evaluated: {why}")


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
