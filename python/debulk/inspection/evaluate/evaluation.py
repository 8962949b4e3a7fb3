"""The evaluation of one pocket: by its fibre lines where its rim is held, else by the minima of its net."""

from __future__ import annotations

import logging
from dataclasses import replace

from debulk import _core, ridge, solve, verdict
from debulk.inspection.evaluate import both_ways
from debulk.inspection.evaluate.evaluated import Evaluation, not_evaluated, refused, seen_of
from debulk.inspection.find.found import FoundPocket
from debulk.inspection.holes import pocket_holes
from debulk.inspection.lines.bridges import bridge_over
from debulk.inspection.lines.by_runs import ByRuns, by_runs, surely_held
from debulk.inspection.minima import edge_friction, ridges, starts
from debulk.inspection.minima.figures import debulked_figures, left_out_of, net_figures
from debulk.inspection.minima.laid_pocket import LaidPocket, lay_pocket
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.inspection.running.cycle import Stopwatch
from debulk.results.finding import unexpected
from debulk.results.half_seen import or_undecided
from debulk.results.report import ExcessReport, PocketReport
from debulk.results.ridge import RidgeGeometry
from debulk.words import pocket_names

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
        own = or_undecided(done.report.verdict, found.promoted)
        if own is done.report.verdict:
            return done
        reason = f"{found.promoted}; not evaluated: {done.report.reason}"
        return replace(done, report=replace(done.report, verdict=own, reason=reason))
    except _core.Stopped:
        return _late(found, seen)
    except Exception as error:
        log.exception("pocket %d could not be evaluated", found.number)
        return refused(seen, f"an unexpected error, {unexpected(error)}")


def _evaluate(found: FoundPocket, seen: PocketReport, ply: PlyOnMold, stop: _core.Stop) -> Evaluation:
    hole = pocket_holes.holes_of(found, ply)
    if hole is not None:
        return both_ways.judged(found, seen, hole, ply, stop, lambda piece: _ClosedRim(piece, ply, stop).evaluate())
    if not found.foot.closed:
        return refused(seen, "its foot ends where the ply was not seen: scan again")
    return _ClosedRim(found, ply, stop).evaluate()


class _ClosedRim:
    """A pocket whose rim is closed."""

    def __init__(self, found: FoundPocket, ply: PlyOnMold, stop: _core.Stop) -> None:
        self.found, self.ply, self.stop = found, ply, stop
        self.seen, self.watch = seen_of(found), Stopwatch()

    def evaluate(self) -> Evaluation:
        """Evaluate it by its fibre lines if its rim is held, else by its minima."""
        found, ply, recipe = self.found, self.ply, self.ply.recipe
        paper = recipe.verdict.criterion == "paper"
        try:
            laid = self._lay() if paper or not surely_held(found, ply) else None
            if laid is not None and (paper or not laid.held):
                return self._by_minima(laid)
            with self.watch.step("excess"):
                decided = by_runs(found, ply, self.stop)
        except _core.InputError as error:  # of the data, not of the user: no net can be laid, or angles lack
            return refused(self.seen, str(error))
        done = self._decided(decided)
        if recipe.solve.when == "needed":
            return done
        try:
            return self._with_picture(done, decided.excess, laid or self._lay())
        except _core.InputError:  # no net can be laid, and there is no picture
            return done
        except _core.Stopped:
            return replace(done, late="net and minimum")

    def _lay(self) -> LaidPocket:
        with self.watch.step("net"):
            try:
                return lay_pocket(self.found, self.ply, self.stop)
            except _core.InputError as error:
                raise _core.InputError(f"no net could be laid: {error}") from None

    def _decided(self, decided: ByRuns) -> Evaluation:
        """Report what the fibre lines decide."""
        judged = _with_joined(decided.judged, self.found)
        report = replace(
            not_evaluated(self.seen, judged).report,
            excess=decided.excess,
            bridge_section=decided.bridge.section,
            **self.watch.figures(),
        )
        return Evaluation(report)

    def _with_picture(self, done: Evaluation, known: ExcessReport, laid: LaidPocket) -> Evaluation:
        """Add the net of a pocket that its lines decided, and one minimum, which decides nothing."""
        settled, late = self._settled(laid, for_the_picture=True)
        by_paper = laid.judge(settled.solution, settled.every, deadline_passed=late, criterion="paper")
        report = replace(
            done.report,
            paper_verdict=by_paper.verdict,
            ridges=self._ridges(laid, known),
            **self.watch.figures(),
            **net_figures(laid),
            **debulked_figures(laid, settled),
        )
        return Evaluation(report, left_out_of(laid.sheet, settled), "the certified minimum" if late else "")

    def _by_minima(self, laid: LaidPocket) -> Evaluation:
        """Judge the pocket by its minima: at the ply's edge, where fibres may slip, and by the paper's criterion."""
        bridge = known = None
        with self.watch.step("excess"):
            if laid.recipe.verdict.criterion == "excess":
                bridge = bridge_over(self.found, self.ply, self.stop)
            elif laid.held:
                known = by_runs(self.found, self.ply, self.stop).excess
        settled, late = self._settled(laid)
        by_rule = laid.judge(settled.solution, settled.every, bridge=bridge, deadline_passed=late)
        by_paper = laid.judge(settled.solution, settled.every, deadline_passed=late, criterion="paper")
        with self.watch.step("solve"):
            ends = edge_friction.at_both_ends(laid, settled, by_rule, bridge, self._timed(laid), self.stop)
        by_rule = _with_joined(ends.judged, self.found)
        report = replace(
            not_evaluated(self.seen, by_rule).report,
            paper_verdict=by_paper.verdict,
            excess=known,
            ridges=() if known is None else self._ridges(laid, known),
            edge_friction=ends.report,
            bridge_section=None if bridge is None else bridge.section,
            **self.watch.figures(),
            **net_figures(laid),
            **debulked_figures(laid, ends.counted),
        )
        cut = "the certified minimum" if late and not settled.cut else ends.late
        return Evaluation(report, left_out_of(laid.sheet, settled) + ends.left_out, cut)

    def _ridges(self, laid: LaidPocket, known: ExcessReport) -> tuple[RidgeGeometry, ...]:
        with self.watch.step("ridge"):
            return ridges.of_excess(laid, known, self.found.foot)

    def _timed(self, laid: LaidPocket) -> starts.PostProcess:
        def post_process(solution: solve.Solution) -> ridge.PostProcessed:
            with self.watch.step("ridge"):
                return laid.post_process(solution)

        return post_process

    def _settled(self, laid: LaidPocket, *, for_the_picture: bool = False) -> tuple[starts.Settled, bool]:
        """Minimise the energy; return the minima, and whether a deadline cut them off."""
        by_strings = laid.recipe.verdict.criterion == "excess"  # they decide on bridges, in place of the net's
        judged_as = laid.without_bridge if by_strings else None
        given = laid.sheet, laid.recipe, self._timed(laid), self.stop
        with self.watch.step("solve"):
            settled = starts.settle(*given, judged_as=judged_as, for_the_picture=for_the_picture)
        return settled, settled.late(self.stop)


def _late(found: FoundPocket, seen: PocketReport) -> Evaluation:
    judged = verdict.judge(certified=False, deadline_passed=True, coverage=found.pocket.measured_share)
    return replace(not_evaluated(seen, judged), late="net and minimum")


def _with_joined(judged: verdict.Judgement, found: FoundPocket) -> verdict.Judgement:
    """Name the pockets that are judged with this one."""
    if not found.joined:
        return judged
    others = pocket_names(found.joined)
    return replace(judged, reason=f"{judged.reason}; judged in one net with {others}, whose foot is the same")
