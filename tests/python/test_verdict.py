"""Verdicts through Python: the table of branches is tests/cpp/verdict/judge_test.cpp."""

import math

import pytest

from debulk import InputError, Recipe, _core
from debulk.verdict import (
    Criteria,
    Judgement,
    Verdict,
    _compiled,
    criteria_of,
    excess_bounds,
    judge,
    judge_layup,
    natural_length,
)


def test_the_four_verdicts_are_words():
    assert {v.value for v in Verdict} == {"cease", "crease", "undecided", "invalid"}
    assert Verdict("cease") is Verdict.CEASE
    assert f"{Verdict.CEASE}" == str(Verdict.CEASE) == "CEASE" and f"{Verdict.CEASE:>7}" == "  CEASE"


def test_the_worst_verdict_is_the_compiled_order():
    assert [v.name for v in Verdict] == sorted(
        (v.name for v in Verdict), key=lambda n: int(getattr(_core.verdict.Verdict, n))
    )
    assert Verdict.worst([]) is Verdict.CEASE
    for k, worst in enumerate(Verdict):
        assert worst.severity == k
        assert Verdict.worst(list(Verdict)[: k + 1]) is worst


def test_verdicts_compare_by_severity():
    for k, one in enumerate(Verdict):
        for j, other in enumerate(Verdict):
            assert (one < other, one <= other, one > other, one >= other) == (k < j, k <= j, k > j, k >= j)


def test_it_is_told_which_criterion_decided():
    inside = {"certified": True, "rms_mm": 0.1, "ridge_height_mm": 0.0, "inside_ply": True}
    assert judge(**inside, excess_range_mm=(0.1, 0.2)).decided_by == "excess"
    assert judge(**inside, excess_range_mm=(0.1, 0.2), criteria=Criteria(criterion="paper")).decided_by == "paper"
    assert judge(**inside, coverage=0.1).decided_by == ""


def test_criteria_are_the_compiled_defaults_and_checked():
    assert (Criteria().max_rms_mm, Criteria().max_ridge_height_mm, Criteria().min_coverage) == (0.30, 0.60, 0.98)
    with pytest.raises(InputError, match="max_rms_mm: expected a positive limit in mm, but got -1"):
        Criteria(max_rms_mm=-1)
    with pytest.raises(InputError, match="min_coverage"):
        Criteria(min_coverage=98)
    with pytest.raises(InputError, match=r"^criterion: expected (excess or paper|paper or excess), but got 'luck'$"):
        Criteria(criterion="luck")
    assert Criteria.from_core(_core.verdict.Criteria()) == Criteria()
    other = Criteria(criterion="paper", max_rms_mm=0.2, ridge_margin_mm=0.07)
    assert Criteria.from_core(_compiled(other)) == other


def test_limits_and_criterion_come_from_the_recipe_unless_another_criterion_is_asked_for():
    recipe = Recipe(verdict={"max_ridge_mm": 0.4, "criterion": "paper"})
    assert criteria_of(recipe) == Criteria(max_ridge_height_mm=0.4, criterion="paper")
    assert criteria_of(recipe, "excess") == Criteria(max_ridge_height_mm=0.4)


@pytest.mark.parametrize(
    ("evidence", "verdict", "reason"),
    [
        ({}, Verdict.CEASE, "no ridge"),
        ({"ridge_height_mm": 1.57}, Verdict.CREASE, "ridge 1.57 mm exceeds the limit of 0.60 mm"),
        ({"bridge_height_mm": 0.9}, Verdict.CREASE, "bridge 0.90 mm"),
        ({"rms_range_mm": (0.289, 0.331)}, Verdict.UNDECIDED, "both sides"),
        ({"ridge_range_mm": (0.2, 0.8)}, Verdict.UNDECIDED, "ridge 0.20 to 0.80 mm lies on both sides"),
        ({"bridge_range_mm": (0.2, 0.8)}, Verdict.UNDECIDED, "bridge 0.20 to 0.80 mm lies on both sides"),
        ({"compliant": True}, Verdict.UNDECIDED, "strained"),
        ({"certified": False, "solve_status": "time limit"}, Verdict.UNDECIDED, "not certified (time limit)"),
        ({"certified": False, "deadline_passed": True}, Verdict.UNDECIDED, "before the solution was certified"),
        ({"deadline_passed": True}, Verdict.UNDECIDED, "before all starts that the rule asks for were tried"),
        ({"deadline_passed": True, "ridge_height_mm": 1.57}, Verdict.UNDECIDED, "before all starts"),
        ({"deadline_passed": True, "coverage": 0.5}, Verdict.INVALID, "50.0 %"),
        ({"rms_mm": math.nan}, Verdict.UNDECIDED, "no finite figures"),
        ({"refused": "no movable node"}, Verdict.INVALID, "not evaluated: no movable node"),
        ({"coverage": 0.5}, Verdict.INVALID, "50.0 %"),
        ({"closed_rim": False}, Verdict.INVALID, "rim"),
    ],
)
def test_judge(evidence, verdict, reason):
    judgement = judge(**{"certified": True, "rms_mm": 0.26, "ridge_height_mm": 0.0, **evidence})
    assert judgement.verdict is verdict
    assert reason in judgement.reason


def test_a_certificate_alone_is_no_evidence():
    assert judge(certified=True).verdict is Verdict.UNDECIDED


def test_judge_takes_criteria():
    strict = Criteria(max_ridge_height_mm=0.4)
    assert judge(certified=True, rms_mm=0.26, ridge_height_mm=0.5).verdict is Verdict.CEASE
    assert judge(certified=True, rms_mm=0.26, ridge_height_mm=0.5, criteria=strict).verdict is Verdict.CREASE


def test_judge_names_what_is_wrong():
    with pytest.raises(InputError, match="rms_range_mm"):
        judge(certified=True, rms_range_mm=(0.4, 0.3), ridge_height_mm=0.0)
    with pytest.raises(InputError, match="coverage"):
        judge(certified=True, rms_mm=0.26, ridge_height_mm=0.0, coverage=95)


def test_the_layup_takes_the_worst():
    one = {v: Judgement(v, "why") for v in Verdict}
    order = [Verdict.CEASE, Verdict.UNDECIDED, Verdict.CREASE, Verdict.INVALID]
    for k, worst in enumerate(order):
        pockets = [(n, one[v]) for n, v in enumerate(order[: k + 1], start=1)]
        for each in (pockets, pockets[::-1]):
            judgement = judge_layup(each, 1.0)
            assert judgement.verdict is worst
            assert f"pocket {k + 1}: why" in judgement.reason


def test_the_layup_needs_coverage():
    assert judge_layup([], 0.98).verdict is Verdict.CEASE
    assert judge_layup([], 0.97).verdict is Verdict.INVALID
    assert judge_layup([(1, Judgement(Verdict.CREASE, "high"))], 0.97).verdict is Verdict.INVALID
    with pytest.raises(InputError, match="coverage"):
        judge_layup([], math.nan)


def test_excess_bounds():
    ply = {"thickness_mm": 0.3, "bulk_factor": 1.2, "modulus_mpa": 360.0, "pressure_mpa": 0.1}
    bounds = excess_bounds(2.0, **ply)
    assert bounds.least_mm == 0
    assert bounds.geometric_mm == pytest.approx(1.0 + (2 - math.pi / 2) * 0.3)
    assert bounds.elastic_mm > bounds.geometric_mm
    assert excess_bounds(0.108, **ply).elastic_mm == pytest.approx(0.5, abs=2e-3)  # docs/model.md, section 6
    assert natural_length(360.0, 0.3, 0.1) == pytest.approx((360 * 0.3**3 / 12 / 0.1) ** (1 / 3))
    with pytest.raises(InputError, match="excess_length_mm"):
        excess_bounds(math.inf, **ply)
    with pytest.raises(InputError, match="modulus_mpa"):
        excess_bounds(1.0, **{**ply, "modulus_mpa": 0})


def test_verdicts_compare_by_severity_and_with_nothing_else():
    order = [Verdict.CEASE, Verdict.UNDECIDED, Verdict.CREASE, Verdict.INVALID]
    assert sorted(reversed(order)) == order and max(order) is Verdict.INVALID
    assert Verdict.CEASE < Verdict.CREASE <= Verdict.CREASE and Verdict.INVALID > Verdict.UNDECIDED >= Verdict.CEASE
    with pytest.raises(TypeError, match="not with a str"):
        assert Verdict.CEASE < "crease"
