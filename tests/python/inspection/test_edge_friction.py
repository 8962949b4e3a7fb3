"""A pocket at the ply's edge ceases only if it does so with its rim slipping and with its rim held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import laid_ply
from debulk import _core, inspect
from debulk.inspection.evaluate.evaluation import evaluate
from debulk.page.report import page
from debulk.recipe import Recipe
from debulk.report import Report
from debulk.results.edge_friction import EdgeEnd, EdgeFriction, edge_friction_line
from debulk.results.finding import Finding
from debulk.results.report_text import table
from debulk.verdict import Verdict
from lab.third.scene import scene as third_scene

HELD_RIM = "a held rim of pockets at the ply's edge"


def _found(high_mm):
    """A pocket of 50 mm that the ply's upper edge cuts 8 mm from its middle."""
    corners = laid_ply.layup().ply_outline
    top = corners[np.argmin(np.abs(corners[:, 0]) + 1e3 * (corners[:, 1] < 0)), 1]
    (found,) = laid_ply.inspector().find(laid_ply.scan(laid_ply.bell(0, top - 8, 50, high_mm))).pockets
    return found


@pytest.fixture(scope="module")
def slipping_or_not():
    return _found(7)


def _ply(turn_deg, **recipe):
    """The mold, with fibres at an angle to the edge: cut at one end, and many hang on friction at the other."""
    return replace(laid_ply.inspector().ply, fibre_angles_deg=(turn_deg, turn_deg + 90.0), recipe=Recipe(**recipe))


def _evaluated(found, ply):
    """Evaluate a pocket with the fibres of this ply, not of the one in which it was found."""
    runs = ply.fibres.over(found.segmentation, found.feet, _core.Stop(), whole=False, threads=1)
    return evaluate(replace(found, runs=runs), ply, _core.Stop())


def test_a_pocket_that_closes_only_if_it_slips_is_undecided(slipping_or_not):
    done = _evaluated(slipping_or_not, _ply(30.0))
    one = done.report
    assert one.verdict is Verdict.UNDECIDED
    both = one.edge_friction
    assert both.slipping.verdict is Verdict.CEASE
    assert both.held.verdict is Verdict.CREASE
    assert both.held_nodes > 2
    assert "friction at the ply's edge decides" in one.reason
    assert "treat it as CREASE, or smooth it" in one.reason
    # The minima of both ends make the range. Where a ridge stands at the ply's edge is not known.
    assert one.ridge_range_mm == (both.slipping.ridge_range_mm[0], both.held.ridge_range_mm[1])
    assert one.ridge_height_mm == both.slipping.ridge_range_mm[1] == 0
    assert one.ridges == ()
    assert one.paper_verdict is Verdict.CEASE
    report = Report(verdict=one.verdict, reason=one.reason, pockets=(replace(one, id=1),))
    assert edge_friction_line(both) in table(report)
    assert "free nodes of its rim" in page(report)


def test_a_pocket_that_closes_either_way_ceases(slipping_or_not):
    one = _evaluated(slipping_or_not, _ply(45.0)).report
    assert one.verdict is Verdict.CEASE, one.reason
    assert one.edge_friction.held.verdict is Verdict.CEASE


def test_the_papers_loads_know_both_ends_too(slipping_or_not):
    one = _evaluated(slipping_or_not, _ply(30.0, loads={"lumping": "paper"})).report
    assert one.verdict is Verdict.UNDECIDED
    assert one.edge_friction.held.verdict is Verdict.CREASE


def test_the_papers_criterion_judges_as_before_and_says_what_it_leaves_out(slipping_or_not):
    done = _evaluated(slipping_or_not, _ply(30.0, verdict={"criterion": "paper"}))
    assert done.report.verdict is Verdict.CEASE
    assert done.report.edge_friction is None
    assert [entry.why for entry in done.left_out if entry.what == HELD_RIM] == ['verdict.criterion is "paper"']


def test_without_friction_nothing_can_hold(slipping_or_not):
    done = _evaluated(slipping_or_not, _ply(30.0, material={"friction": 0.0}))
    assert done.report.edge_friction is None
    assert not [entry for entry in done.left_out if entry.what == HELD_RIM]


def test_a_pocket_that_does_not_cease_anyway_is_not_settled_again():
    done = _evaluated(_found(9), _ply(15.0))
    assert done.report.verdict is not Verdict.CEASE
    assert done.report.edge_friction is None
    assert [entry for entry in done.left_out if entry.what == HELD_RIM]


def test_an_edited_report_does_not_pass(slipping_or_not, tmp_path):
    """The figures of CEASE with the other end still in the file."""
    one = _evaluated(slipping_or_not, _ply(30.0)).report
    both = one.edge_friction
    passed = replace(
        one, id=1, verdict=Verdict.CEASE,
        ridge_range_mm=both.slipping.ridge_range_mm, rms_range_mm=both.slipping.rms_range_mm,
    )  # fmt: skip
    report = Report(verdict=Verdict.CEASE, reason="", pockets=(passed,), coverage=1.0)
    report.save(tmp_path / "edited.json")
    with pytest.raises(_core.InputError, match=r"pockets\[0\].verdict: CEASE does not fit: it lies at the ply's edge"):
        Report.load(tmp_path / "edited.json")


def test_a_report_that_ceases_at_the_edge_needs_the_other_end(slipping_or_not, tmp_path):
    one = _evaluated(slipping_or_not, _ply(45.0)).report
    for both in (one.edge_friction, None):
        pockets = (replace(one, id=1, edge_friction=both),)
        findings = (Finding("pockets", one.verdict, ""),)
        report = Report(verdict=one.verdict, reason="", pockets=pockets, coverage=1.0, findings=findings)
        report.save(tmp_path / f"{both is None}.json")
    assert Report.load(tmp_path / "False.json").passed
    with pytest.raises(_core.InputError, match=r"pockets\[0\].verdict: CEASE does not fit: .* its rim held is missing"):
        Report.load(tmp_path / "True.json")


def test_an_end_without_a_certified_minimum_is_said():
    slipping = EdgeEnd(verdict=Verdict.CEASE, reason="", ridge_range_mm=(0.1, 0.25))
    both = EdgeFriction(slipping=slipping, held=EdgeEnd(verdict=Verdict.UNDECIDED, reason=""), held_nodes=1)
    assert edge_friction_line(both) == (
        "lies at the ply's edge: with 1 free node of its rim slipping CEASE, ridge 0.10 to 0.25 mm, with them held "
        "UNDECIDED, no certified minimum"
    )


def test_a_fibre_whose_end_was_not_seen_may_be_held_though_the_net_at_the_edge_passes_it():
    given = third_scene(8248)  # a bump 7 mm wide along the edge: a fibre that is held makes a ridge of 0.74 mm
    assert given.kind == "at the edge" and given.truth.held_mm > 0.7
    recipe = Recipe(material={"thickness_mm": given.thickness_mm})
    angles = (given.fibre_deg, given.fibre_deg + 90)
    report = inspect(given.scan, given.reference, recipe, given.outline, angles, given.mold_from_scanner)
    assert report.verdict is Verdict.UNDECIDED
    assert "a fibre that may be held at both ends" in report.reason
