"""`verdict.max_risk`: a guard on top of the margins, which makes verdicts worse and never better."""

import pytest

import debulk
from debulk import Recipe, Verdict
from laid_ply import bell, inspector, layup, scan

pytestmark = pytest.mark.layup


def inspected(shape, **verdict):
    one = layup()
    recipe, pose = Recipe(verdict=verdict), one.mold_from_scanner
    return debulk.Inspector(recipe, inspector().prepared, one.ply_outline, mold_from_scanner=pose).inspect(scan(shape))


def test_a_layup_that_is_likelier_to_crease_than_allowed_is_undecided():
    shape = bell(0.0, 0.0, 90.0, 5.5)
    free = inspected(shape)
    assert free.verdict is Verdict.CEASE and 0 < free.crease_probability < 0.5
    assert not any(finding.check == "false_acceptance" for finding in free.findings)
    assert inspected(shape, max_risk=2 * free.crease_probability).verdict is Verdict.CEASE
    strict = inspected(shape, max_risk=free.crease_probability / 2)
    assert strict.verdict is Verdict.UNDECIDED
    (finding,) = (one for one in strict.findings if one.check == "false_acceptance")
    assert finding.measured == free.crease_probability and "most likely that of pocket 1" in strict.reason


def test_no_risk_makes_a_crease_anything_else():
    report = inspected(bell(0.0, 0.0, 60.0, 8.0), max_risk=0.99)
    assert report.verdict is Verdict.CREASE and report.crease_probability > 0.9
