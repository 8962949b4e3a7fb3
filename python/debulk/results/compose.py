"""The verdict of a layup from the findings of all checks. Nothing else makes a verdict better or worse."""

from __future__ import annotations

from collections.abc import Sequence

from debulk.results.finding import Finding
from debulk.verdict import Judgement, Verdict


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
