"""A pocket at the ply's edge that would be CEASE is settled again with its rim held, as friction may hold that much.

How much ply a free node drags against friction is a choice of the model. The default, the strip to the nearest point of
the edge, lies near the low end (docs/referee.md). So CEASE is kept only if the other end of the range gives it, too.
That other end is a held rim, and not friction along the fibres: with friction along the fibres, a net of 100 nodes
slips where a fine net holds, past the one or two nodes beside the edge whose fibres end soon.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from debulk import _core, net, ridge, sheet, solve
from debulk.inspection.lines.bridges import Bridge
from debulk.inspection.minima import starts
from debulk.inspection.minima.laid_pocket import LaidPocket
from debulk.results.edge_friction import EdgeEnd, EdgeFriction
from debulk.results.report import LeftOut
from debulk.verdict import Judgement, Verdict

_REMEDY = "treat it as CREASE, or smooth it out over the ply's edge and scan again"


@dataclass(frozen=True)
class BothEnds:
    """The result for a pocket from both ends of the friction's range, or its only result if it has no such range."""

    judged: Judgement
    counted: starts.Settled
    """The minima that count: those of both ends if the held ones are certified."""
    report: EdgeFriction | None = None
    left_out: tuple[LeftOut, ...] = ()
    late: str = ""
    """What a deadline left no time for; empty if it cut nothing off."""


def at_both_ends(
    laid: LaidPocket,
    slipping: starts.Settled,
    judged: Judgement,
    bridge: Bridge | None,
    post_process: Callable[[solve.Solution], ridge.PostProcessed],
    stop: _core.Stop,
) -> BothEnds:
    """Settle a pocket at the ply's edge also with its rim held, if that can change the verdict of the slipping rim."""
    if "friction" in laid.sheet.left_out:
        return BothEnds(judged, slipping)
    if laid.recipe.verdict.criterion == "paper" or judged.verdict is not Verdict.CEASE:
        return BothEnds(judged, slipping, left_out=(_not_settled(laid),))
    rim = net.from_core(_core.net.with_rim_held(laid.net._core))
    held = starts.settle(
        sheet.Sheet.of_net(rim, laid.reference, laid.recipe),
        laid.recipe,
        post_process,
        stop,
        judged_as=laid.without_bridge,
    )
    late = held.late(stop)
    if_held = laid.judge(held.solution, held.every, bridge=bridge, deadline_passed=late)
    counted = slipping.and_of(held) if held.solution.certified else slipping
    if if_held.verdict is Verdict.CEASE:
        together = laid.judge(slipping.solution, counted.every, bridge=bridge)
    elif late:
        together = Judgement(Verdict.UNDECIDED, if_held.reason, if_held.decided_by)
    else:
        both = f"{if_held.reason} if its rim is held, {judged.reason} if it slips"
        reason = f"friction at the ply's edge decides: {both}; {_REMEDY}"
        together = Judgement(Verdict.UNDECIDED, reason, if_held.decided_by, _REMEDY)
    return BothEnds(
        together,
        counted,
        EdgeFriction(
            slipping=_end(slipping, judged),
            held=_end(held, if_held),
            held_nodes=int(np.count_nonzero(rim.kinds != laid.net.kinds)),
        ),
        late="the minima with a held rim" if late else "",
    )


def _end(settled: starts.Settled, judged: Judgement) -> EdgeEnd:
    known = settled.solution.certified
    return EdgeEnd(
        verdict=judged.verdict,
        reason=judged.reason,
        ridge_range_mm=settled.ridge_mm if known else None,
        rms_range_mm=settled.rms_mm if known else None,
    )


def _not_settled(laid: LaidPocket) -> LeftOut:
    if laid.recipe.verdict.criterion == "paper":
        why, bound = 'verdict.criterion is "paper"', "ridges may come out higher than those reported, and decide"
    else:
        why, bound = "as their rim slips they do not cease already", "none: no verdict would be better"
    return LeftOut(what="a held rim of pockets at the ply's edge", why=why, bound=bound)
