"""The evaluation of one pocket: by its fibre lines where its rim is held, else by the minima of its net."""

from __future__ import annotations

import logging
from dataclasses import replace

from debulk import _core, ridge, solve, verdict
from debulk.inspection.evaluate import both_ways
from debulk.inspection.evaluate.evaluated import Evaluation, not_evaluated, seen_of
from debulk.inspection.find.found import FoundPocket
from debulk.inspection.holes import pocket_holes
from debulk.inspection.lines.bridges import bridge_over
from debulk.inspection.lines.by_runs import ByRuns, by_runs, surely_held
from debulk.inspection.minima import edge_friction, replay, ridges, starts
from debulk.inspection.minima.figures import debulked_figures, left_out_of, net_figures
from debulk.inspection.minima.laid_pocket import REFUSED, LaidPocket, lay_pocket
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.inspection.running.cycle import Stopwatch
from debulk.results.report import PocketReport
from debulk.verdict import Verdict

log = logging.getLogger("debulk")


def settle(found: FoundPocket, decided: Evaluation, ply: PlyOnMold, stop: _core.Stop) -> Evaluation:
    """Add net and minimum to a pocket that was decided without; its verdict stays as it is."""
    recipe = ply.recipe.model_copy(update={"solve": ply.recipe.solve.model_copy(update={"when": "always"})})
    return decided.with_picture_of(evaluate(found, replace(ply, recipe=recipe), stop))


def evaluate(found: FoundPocket, ply: PlyOnMold, stop: _core.Stop) -> Evaluation:
    """Evaluate one pocket.

    An unexpected error does not prevent the report: the pocket is INVALID, and the error is its reason.
    """
    seen = seen_of(found)
    if stop.now():
        return _late(found, seen)
    try:
        done = _evaluate(found, seen, ply, stop)
        if found.promoted and done.report.verdict is Verdict.INVALID:  # it may crease, and may be nothing
            reason = f"{found.promoted}; not evaluated: {done.report.reason}"
            done = replace(done, report=replace(done.report, verdict=Verdict.UNDECIDED, reason=reason))
        return done
    except _core.Stopped:
        return _late(found, seen)
    except Exception as error:
        log.exception("pocket %d could not be evaluated", found.number)
        what = " ".join(str(error).split())
        refused = f"an unexpected error, {type(error).__name__}{': ' if what else ''}{what}; please report it"
        return not_evaluated(seen, verdict.judge(certified=False, refused=refused))


def _evaluate(found: FoundPocket, seen: PocketReport, ply: PlyOnMold, stop: _core.Stop) -> Evaluation:
    hole = pocket_holes.holes_of(found, ply)
    if hole is not None:
        return both_ways.judged(found, seen, hole, ply, stop, lambda piece: _with_closed_rim(piece, ply, stop))
    if not found.foot.closed:
        why = "its foot ends where the ply was not seen: scan again"
        return not_evaluated(seen, verdict.judge(certified=False, refused=why))
    return _with_closed_rim(found, ply, stop)


def _with_closed_rim(found: FoundPocket, ply: PlyOnMold, stop: _core.Stop) -> Evaluation:
    """Evaluate a pocket whose rim is closed: by its fibre lines if that is held, else by its minima."""
    seen, watch = seen_of(found), Stopwatch()
    paper = ply.recipe.verdict.criterion == "paper"
    try:
        laid = _lay(found, ply, watch, stop) if paper or not surely_held(found, ply) else None
        if laid is not None and (paper or not laid.held):
            return _by_minima(seen, laid, found, ply, watch, stop)
        with watch.step("excess"):
            decided = by_runs(found, ply, stop)
    except _core.InputError as error:  # here the data are at fault, not the user: no net can be laid, or angles lack
        return not_evaluated(seen, verdict.judge(certified=False, refused=str(error)))
    done = _decided(seen, decided, found, watch)
    if ply.recipe.solve.when == "needed":
        return done
    try:
        return _with_picture(done, laid or _lay(found, ply, watch, stop), found, watch, stop)
    except _core.InputError:  # no net can be laid, and there is no picture
        return done
    except _core.Stopped:
        return replace(done, late="net and minimum")


def _lay(found: FoundPocket, ply: PlyOnMold, watch: Stopwatch, stop: _core.Stop) -> LaidPocket:
    with watch.step("net"):
        try:
            return lay_pocket(found, ply, stop)
        except _core.InputError as error:
            raise _core.InputError(f"no net could be laid: {error}") from None


def _decided(seen: PocketReport, decided: ByRuns, found: FoundPocket, watch: Stopwatch) -> Evaluation:
    """Report what the fibre lines decide."""
    judged = _with_joined(decided.judged, found)
    report = replace(
        not_evaluated(seen, judged).report,
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
    watch: Stopwatch,
    stop: _core.Stop,
) -> Evaluation:
    """Add the net of a pocket that its lines decided, and one minimum, which decides nothing."""
    settled, late = _settled(laid, found, _timed(laid, watch), watch, stop, for_the_picture=True)
    known = done.report.excess
    with watch.step("ridge"):
        stands = () if known is None else ridges.of_excess(laid, known, found.foot)
    by_paper = laid.judge(settled.solution, settled.best, settled.every, deadline_passed=late, criterion="paper")
    report = replace(
        done.report,
        paper_verdict=by_paper.verdict,
        ridges=stands,
        **watch.figures(),
        **net_figures(laid),
        **debulked_figures(laid, settled),
    )
    late_for = "the certified minimum" if late else ""
    return Evaluation(report, left_out_of(laid.sheet, settled), late_for)


def _by_minima(
    seen: PocketReport,
    laid: LaidPocket,
    found: FoundPocket,
    ply: PlyOnMold,
    watch: Stopwatch,
    stop: _core.Stop,
) -> Evaluation:
    """Judge a pocket by its minima: at the ply's edge, where fibres may slip, and by the paper's criterion."""
    bridge = known = None
    with watch.step("excess"):
        if ply.recipe.verdict.criterion == "excess":
            bridge = bridge_over(found, ply, stop)
        elif laid.held:
            known = by_runs(found, ply, stop).excess
    post_process = _timed(laid, watch)
    settled, late = _settled(laid, found, post_process, watch, stop)
    by_rule = laid.judge(settled.solution, settled.best, settled.every, bridge=bridge, deadline_passed=late)
    by_paper = laid.judge(settled.solution, settled.best, settled.every, deadline_passed=late, criterion="paper")
    with watch.step("solve"):
        ends = edge_friction.at_both_ends(laid, settled, by_rule, bridge, post_process, stop)
    by_rule = ends.judged
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
        **net_figures(laid),
        **debulked_figures(laid, ends.counted),
    )
    cut = "the certified minimum" if late and not settled.cut else ends.late
    return Evaluation(report, left_out_of(laid.sheet, settled) + ends.left_out, cut)


def _timed(laid: LaidPocket, watch: Stopwatch) -> starts.PostProcess:
    def post_process(solution: solve.Solution) -> ridge.PostProcessed:
        with watch.step("ridge"):
            return laid.post_process(solution)

    return post_process


def _settled(
    laid: LaidPocket,
    found: FoundPocket,
    post_process: starts.PostProcess,
    watch: Stopwatch,
    stop: _core.Stop,
    *,
    for_the_picture: bool = False,
) -> tuple[starts.Settled, bool]:
    """Minimise the energy; return the minima, and whether a deadline cut them off."""
    with watch.step("solve"):
        by_strings = laid.recipe.verdict.criterion == "excess"  # they decide on bridges, in place of the net's
        judged_as = laid.without_bridge if by_strings else starts.as_they_are
        settled = starts.settle(
            laid.sheet, laid.recipe, post_process, stop, judged_as=judged_as, for_the_picture=for_the_picture
        )
    replay.keep(
        laid.sheet,
        settled.solution,
        settled.solution.status in REFUSED,
        watch.split_ms["solve"],
        found.number,
        laid.recipe,
        first=int(for_the_picture and len(settled.solution.minima) == 1),
    )
    return settled, settled.cut or (stop.past_deadline and not settled.solution.certified)


def _late(found: FoundPocket, seen: PocketReport) -> Evaluation:
    judged = verdict.judge(certified=False, deadline_passed=True, coverage=found.pocket.measured_share)
    return replace(not_evaluated(seen, judged), late="net and minimum")


def _with_joined(judged: verdict.Judgement, found: FoundPocket) -> verdict.Judgement:
    """Name the pockets that are judged with this one."""
    if not found.joined:
        return judged
    names = ", ".join(str(number) for number in found.joined)
    others = f"pocket{'s' * (len(found.joined) > 1)} {names}"
    return replace(judged, reason=f"{judged.reason}; judged in one net with {others}, whose foot is the same")
