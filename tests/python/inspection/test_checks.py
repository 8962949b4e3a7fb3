"""The list of checks: every finding belongs to one, and the runner fails closed."""

import dataclasses
import re
from pathlib import Path
from types import SimpleNamespace

import pytest

import debulk
from debulk import Verdict, _core
from debulk.inspection.checks.check import Check, findings_of
from debulk.inspection.checks.listed import CHECKS
from debulk.inspection.checks.pockets import pockets
from debulk.results.check_texts import CHECK_TEXTS
from debulk.results.compose import compose
from debulk.results.finding import Finding

NAMES = [check.name for check in CHECKS]


def check(name, look):
    return Check(name, look)


def fails(error):
    def look(seen):
        raise error
        yield

    return look


def test_each_check_has_a_name_of_its_own_and_says_what_to_do():
    assert len(set(NAMES)) == len(NAMES)
    assert [text.name for text in CHECK_TEXTS] == NAMES
    for one in CHECK_TEXTS:
        assert one.title and one.sees and one.limit and one.remedy and one.at_best


def test_every_finding_that_the_inspection_makes_is_of_a_listed_check():
    folder = Path(debulk.__file__).parent
    files = [path for room in ("inspection", "chain") for path in (folder / room).rglob("*.py")]
    made = {name for path in files for name in re.findall(r'Finding\(\s*"(\w+)"', path.read_text())}
    assert made == set(NAMES)


@pytest.mark.parametrize("limits", [one for check in CHECKS for one in check.limits], ids=lambda one: one.__module__)
def test_thresholds_are_frozen_and_name_what_tries_them(limits):
    top = Path(__file__).parents[3]
    assert type(limits).__dataclass_params__.frozen
    named = re.findall(r"(?:bench|tests)/[\w/]+\.py", limits.__doc__)
    assert named and all((top / name).exists() for name in named)


def test_the_findings_come_in_the_order_of_the_checks():
    first = Finding("a", Verdict.UNDECIDED, "first")
    second = Finding("b", Verdict.UNDECIDED, "second")
    found = findings_of([check("a", lambda seen: [first]), check("b", lambda seen: [second])], None)
    assert found == (first, second)
    assert compose(found).reason == "first"


def test_a_check_that_fails_makes_the_layup_invalid_and_the_others_speak():
    good = Finding("pockets", Verdict.CEASE, "no air pocket")
    broken = check("broken", fails(ValueError("what\nhappened")))
    found = findings_of([broken, check("pockets", lambda seen: [good])], None)
    assert [one.check for one in found] == ["broken", "pockets"]
    assert compose(found).verdict is Verdict.INVALID
    assert found[0].reason == "the check broken failed: ValueError: what happened; please report it"


def test_a_check_that_runs_out_of_time_leaves_the_layup_undecided():
    (found,) = findings_of([check("slow", fails(_core.Stopped()))], None)
    assert (found.check, found.at_best) == ("deadline", Verdict.UNDECIDED)
    assert "slow" in found.reason


@pytest.mark.parametrize("verdict", [Verdict.CEASE, Verdict.CREASE])
def test_the_layup_s_reason_is_that_of_the_worst_pocket_not_of_the_largest(report, verdict):
    """The largest comes first in a report, and is often flat."""
    ridges = [pocket for pocket in report.pockets if pocket.deciding_ridge]
    flat, high = (pick(ridges, key=lambda one: one.deciding_ridge.height_mm) for pick in (min, max))
    both = [dataclasses.replace(flat, verdict=verdict, id=1), dataclasses.replace(high, verdict=verdict, id=2)]
    found = SimpleNamespace(unseen=SimpleNamespace(coverage=1.0))
    ply = SimpleNamespace(recipe=debulk.Recipe())
    (finding,) = pockets(SimpleNamespace(found=found, ply=ply, judged=SimpleNamespace(reports=both)))
    assert finding.pocket == 2 and finding.reason.endswith(high.reason)
