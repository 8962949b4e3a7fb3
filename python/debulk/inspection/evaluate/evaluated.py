"""The result of the evaluation of one pocket."""

from __future__ import annotations

from dataclasses import dataclass, replace

from debulk.results.report import LeftOut, PocketReport

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
        How the verdict by the net differs from the one by the fibre lines alone; empty: it does not.
    """

    report: PocketReport
    left_out: tuple[LeftOut, ...] = ()
    late: str = ""
    turned: str = ""

    def no_better_than(self, decided: Evaluation) -> Evaluation:
        """Return this evaluation, by the net, with the worse of its own verdict and that by the fibre lines alone."""
        mine, lines = self.report, decided.report
        if mine.verdict is lines.verdict:
            return self
        turned = (
            f"pocket {mine.id} is {lines.verdict.name} by its fibre lines ({lines.reason}), "
            f"but {mine.verdict.name} by its net ({mine.reason}); the worse of the two holds"
        )
        if lines.verdict > mine.verdict:
            said = {name: getattr(lines, name) for name in ("verdict", "reason", "remedy", "decided_by")}
            mine = replace(mine, **said)
        return replace(self, report=mine, turned=turned)
