"""Pockets close to each other along a fibre are not passed one by one for what one fold may draw together."""

import re

import numpy as np
import pytest

import debulk
import laid_ply
from debulk import Recipe, Verdict, scenes
from debulk.inspection.common_fibres import friction_length

WIDE_MM, HIGH_MM = 100.0, 5.0  # a bell with 0.62 mm to spare along its middle: a ridge of 0.44 mm, two of 0.75 mm


def bells(*centres):
    shapes = [laid_ply.bell(x, y, WIDE_MM, HIGH_MM) for x, y in centres]
    return laid_ply.scan(lambda x, y: np.sum([shape(x, y) for shape in shapes], axis=0))


def inspect(scan, **changes):
    one = laid_ply.layup()
    return debulk.inspect(scan, one.reference, Recipe(**changes), one.ply_outline, (0, 90), one.mold_from_scanner)


def test_a_fold_draws_from_within_twenty_millimetres():
    assert 17 < friction_length(Recipe()) < 22  # docs/model.md, section 6
    half = friction_length(Recipe(material={"friction": 0.8}))
    assert half == pytest.approx(friction_length(Recipe()) / 2)
    assert friction_length(Recipe(material={"friction": 0.0})) == np.inf


def exact_excess_mm(centres, along):
    """Of the straight line over the middles of all bells, by the exact shapes and the mold's reference."""
    line = np.linspace(-80.0, 200.0, 20_001)[:, None] * along
    shape = sum(laid_ply.bell(x, y, WIDE_MM, HIGH_MM)(line[:, 0], line[:, 1]) for x, y in centres)
    mold = laid_ply.inspector().reference.height(line)
    step = np.linalg.norm(np.diff(line, axis=0), axis=1)
    return float(sum(np.hypot(step, np.diff(mold + shape)) - np.hypot(step, np.diff(mold))))


@pytest.mark.parametrize("along", [(1.0, 0.0), (0.0, 1.0)])
def test_two_pockets_in_a_row_are_undecided_where_friction_need_not_part_them(along):
    centres = (0.0, 0.0), (105.0 * along[0], 105.0 * along[1])
    exact_mm = exact_excess_mm(centres, along)
    report = inspect(bells(*centres))
    assert [p.excess.verdict for p in report.pockets] == [Verdict.CEASE] * 2
    assert report.verdict is Verdict.UNDECIDED
    for p, other in zip(report.pockets, (2, 1), strict=True):
        assert p.verdict is Verdict.UNDECIDED
        assert p.decided_by == ""
        said = re.match(r"a fibre over it and pocket (\d) is ([\d.]+) mm longer than the mold", p.reason)
        assert int(said[1]) == other
        assert exact_mm - 0.03 < float(said[2]) < exact_mm + 0.06
        assert p.excess.length_mm == pytest.approx(exact_mm / 2, abs=0.03)


def test_farther_apart_or_side_by_side_each_is_judged_alone():
    for centres in (((0.0, 0.0), (135.0, 0.0)), ((0.0, 0.0), (60.0, 95.0))):
        report = inspect(bells(*centres))
        assert [p.verdict for p in report.pockets] == [Verdict.CEASE] * 2
        assert all(p.reason.startswith("ridge by the excess length") for p in report.pockets)


def test_less_friction_parts_less():
    report = inspect(bells((0.0, 0.0), (135.0, 0.0)), material={"friction": 0.1})
    assert [p.verdict for p in report.pockets] == [Verdict.UNDECIDED] * 2


def test_the_papers_criterion_knows_no_excess():
    scan = bells((0.0, 0.0), (105.0, 0.0))
    assert all(p.verdict is p.paper_verdict for p in inspect(scan, verdict={"criterion": "paper"}).pockets)


def test_feet_that_merge_below_the_molds_tolerance_pass_no_pair_that_creases():
    """Between two pockets the ply comes down to 0.18 mm above the mold; 1.28 mm to spare."""
    layup = scenes.varied_layup(
        5000, (1280, 960), pockets=10, severity="any", noise=(), holes_mm=0, clamp=False, borders=0
    )
    report = debulk.inspect(
        layup.scan,
        layup.reference,
        None,
        layup.ply_outline,
        layup.fibre_angles_deg,
        layup.mold_from_scanner,
        layup.camera,
    )
    limit_mm = Recipe().verdict.max_ridge_mm
    creasing = [p for p in layup.truth.pockets if p.ridge_mm > limit_mm]
    assert len(creasing) == 4
    for true in creasing:
        away = [np.linalg.norm(p.outline_mm.mean(axis=0) - true.centre_mm) for p in report.pockets]
        assert report.pockets[int(np.argmin(away))].verdict is not Verdict.CEASE
    assert sum(p.verdict is Verdict.CEASE for p in report.pockets) == 2
