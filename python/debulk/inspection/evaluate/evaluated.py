"""The result of the evaluation of one pocket."""

from __future__ import annotations

from dataclasses import dataclass

from debulk.results.report import LeftOut, PocketReport

__all__ = ["Evaluation"]


@dataclass(frozen=True)
class Evaluation:
    """A pocket's part of the report, what it leaves out, and what a deadline cut off (empty: nothing)."""

    report: PocketReport
    left_out: tuple[LeftOut, ...] = ()
    late: str = ""

    @property
    def unsolved(self) -> bool:
        """Whether the excess decided before there was a minimum."""
        return self.report.solve is None and self.report.decided_by == "excess"
