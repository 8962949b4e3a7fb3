"""The verdict of a layup from the findings of all checks. Nothing else makes a verdict better or worse."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeVar

from debulk.results.finding import Finding
from debulk.verdict import Judgement, Verdict

if TYPE_CHECKING:
    from debulk.results.report import ReportData

__all__ = ["compose", "with_finding"]

ReportT = TypeVar("ReportT", bound="ReportData")


def compose(findings: Sequence[Finding]) -> Judgement:
    """Return the worst verdict that the findings allow, with the reason of the first finding that allows no better.

    What is only mentioned, and is not about one pocket, is added to the reason of an INVALID layup, as it may be the
    cause. Without any finding that has a verdict the layup is INVALID: then nothing was looked at.

    Parameters
    ----------
    findings
        In the order in which the checks speak: of findings that are equally bad the first one gives the reason.

    Examples
    --------
    >>> flat = Finding("pockets", Verdict.CEASE, "no air pocket, and 99.5 % of the ply was seen")
    >>> hole = Finding("holes", Verdict.UNDECIDED, "a hole of 9 cm², where a pocket could lie unseen")
    >>> compose([flat, hole])
    Judgement(verdict=<Verdict.UNDECIDED: 'undecided'>, reason='a hole of 9 cm², where a pocket could lie unseen')
    >>> compose([]).verdict
    <Verdict.INVALID: 'invalid'>
    """
    judged = [(one.at_best, one.reason) for one in findings if one.at_best is not None]
    if not judged:
        return Judgement(Verdict.INVALID, "nothing was checked")
    verdict, reason = max(judged, key=lambda one: one[0].severity)  # the first of equals
    if verdict is Verdict.INVALID:
        mentioned = [one.reason for one in findings if one.at_best is None and one.pocket is None]
        reason = "; ".join([reason, *mentioned])
    return Judgement(verdict, reason)


def with_finding(report: ReportT, finding: Finding | None) -> ReportT:
    """Return a report with one more finding, and the verdict that all of them allow; as it is without one."""
    if finding is None:
        return report
    findings = (*report.findings, finding)
    judged = compose(findings)
    return dataclasses.replace(report, findings=findings, verdict=judged.verdict, reason=judged.reason)
