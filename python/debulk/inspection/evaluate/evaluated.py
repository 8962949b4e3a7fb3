"""The result of the evaluation of one pocket."""

from __future__ import annotations

from dataclasses import dataclass, replace

from debulk.results.report import LeftOut, PocketReport
from debulk.results.unsettled import PICTURE

__all__ = ["Evaluation"]


@dataclass(frozen=True)
class Evaluation:
    """A pocket's part of the report.

    Attributes
    ----------
    report
        The pocket.
    left_out
        What it leaves out.
    late
        What a deadline cut off; empty: nothing.
    turned
        How the net contradicts the fibre lines that decided; empty: it does not.
    """

    report: PocketReport
    left_out: tuple[LeftOut, ...] = ()
    late: str = ""
    turned: str = ""

    def with_picture_of(self, other: Evaluation) -> Evaluation:
        """Return this evaluation with net and minimum of another one of the same pocket."""
        figures = {name: getattr(other.report, name) for name in PICTURE}
        return replace(other, report=replace(self.report, **figures))
