"""What the evaluation of one pocket gives."""

from __future__ import annotations

from dataclasses import dataclass

from debulk.results.report import LeftOut, PocketReport

__all__ = ["Evaluation"]


@dataclass(frozen=True)
class Evaluation:
    """A pocket's part of the report, what was left out for it, and what of it a deadline cut off; empty: nothing."""

    report: PocketReport
    left_out: tuple[LeftOut, ...] = ()
    late: str = ""
