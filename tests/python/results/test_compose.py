"""The layup's verdict follows from the findings alone: the worst one decides, the first of equals speaks."""

import itertools

import pytest

from debulk import Verdict
from debulk.results.compose import compose
from debulk.results.finding import Finding
from debulk.verdict import Judgement

GOOD = Finding("pockets", Verdict.CEASE, "no air pocket")


@pytest.mark.parametrize("verdicts", list(itertools.product(Verdict, repeat=3)))
def test_the_worst_decides_wherever_it_stands(verdicts):
    findings = [Finding(f"check {k}", verdict, f"reason {k}") for k, verdict in enumerate(verdicts)]
    judged = compose(findings)
    assert judged.verdict is Verdict.worst(verdicts)
    assert judged.reason == f"reason {verdicts.index(judged.verdict)}"


def test_nothing_checked_is_invalid():
    assert compose([]) == Judgement(Verdict.INVALID, "nothing was checked")
    assert compose([Finding("outline", None, "not given")]).verdict is Verdict.INVALID


def test_what_is_only_mentioned_speaks_where_the_layup_is_invalid():
    mentioned = [Finding("outline", None, "not given"), Finding("deadline", None, "cut off", pocket=3)]
    assert compose([*mentioned, GOOD]) == compose([GOOD])
    bad = Finding("coverage", Verdict.INVALID, "too little")
    assert compose([GOOD, *mentioned, bad]).reason == "too little; not given"
