"""The result of the evaluation of one pocket."""

from __future__ import annotations

from dataclasses import dataclass, replace

from debulk.inspection.find.found import FoundPocket
from debulk.results.report import LeftOut, PocketReport
from debulk.results.unsettled import PICTURE
from debulk.verdict import Judgement, Verdict, judge


@dataclass(frozen=True)
class Evaluation:
    """A pocket's part of the report."""

    report: PocketReport
    """The pocket."""
    left_out: tuple[LeftOut, ...] = ()
    """What it leaves out."""
    late: str = ""
    """What a deadline cut off; empty: nothing."""
    turned: str = ""
    """How the net contradicts the fibre lines that decided; empty: it does not."""

    def with_picture_of(self, other: Evaluation) -> Evaluation:
        """Return this evaluation with net and minimum of another one of the same pocket."""
        figures = {name: getattr(other.report, name) for name in PICTURE}
        return replace(other, report=replace(self.report, **figures))


_MEASURED = ("outline_mm", "touches_ply_edge", "area_mm2", "peak_mm", "volume_mm3", "measured_share")


def seen_of(found: FoundPocket) -> PocketReport:
    """Report what is known of a pocket before its ply is modelled."""
    return PocketReport(
        id=found.number,
        verdict=Verdict.INVALID,
        reason="",
        foot_outline_mm=found.foot.outline_mm,
        promoted=found.promoted,
        **{name: getattr(found.pocket, name) for name in _MEASURED},
    )


def not_evaluated(seen: PocketReport, judged: Judgement) -> Evaluation:
    """Report a judgement that needed no model of the ply."""
    decided = {name: getattr(judged, name) for name in ("verdict", "reason", "remedy", "decided_by")}
    return Evaluation(replace(seen, **decided))


def refused(seen: PocketReport, why: str, remedy: str = "") -> Evaluation:
    """Report that a pocket cannot be judged."""
    return not_evaluated(seen, replace(judge(certified=False, refused=why), remedy=remedy))
