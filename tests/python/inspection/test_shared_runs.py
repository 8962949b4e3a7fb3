"""Pockets close to each other along a fibre are not passed one by one for what one fold may draw together."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

import debulk
import laid_ply
from debulk import Inspector, Recipe, Verdict
from debulk.inspection.checks import shared_runs
from debulk.inspection.ply.fibre_runs import friction_length
from lab.varied import varied_layup

WIDE_MM, HIGH_MM = 100.0, 5.0  # a bell with 0.62 mm to spare along its middle: a ridge of 0.44 mm, two of 0.75 mm


def bells(*centres):
    shapes = [laid_ply.bell(x, y, WIDE_MM, HIGH_MM) for x, y in centres]
    return laid_ply.scan(lambda x, y: np.sum([shape(x, y) for shape in shapes], axis=0))


def inspect(scan, **changes):
    of = laid_ply.inspector()
    if changes:
        of = Inspector(Recipe(**changes), of.prepared, of.ply_outline, (0, 90), of.mold_from_scanner)
    return of.inspect(scan)


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
    assert report.verdict is Verdict.UNDECIDED
    for p, other in zip(report.pockets, (2, 1), strict=True):
        assert p.verdict is Verdict.UNDECIDED
        assert p.decided_by == ""
        assert p.excess.alone_mm < 0.6 < p.excess.range_mm[1]
        said = re.match(r"a fibre over it and pocket (\d) is up to ([\d.]+) mm longer than the mold", p.reason)
        assert int(said[1]) == other
        assert exact_mm - 0.03 < float(said[2]) < exact_mm + 0.06
        assert p.excess.length_mm == pytest.approx(exact_mm / 2, abs=0.03)


def test_farther_apart_or_side_by_side_each_is_judged_alone():
    for centres in (((0.0, 0.0), (135.0, 0.0)), ((0.0, 0.0), (60.0, 95.0))):
        report = inspect(bells(*centres))
        assert [p.verdict for p in report.pockets] == [Verdict.CEASE] * 2
        assert all(p.reason.startswith("ridge by the excess length") for p in report.pockets)


def test_ply_that_does_not_come_down_all_the_way_parts_nothing():
    """The bells end 15 mm from each other; their feet, cut where the ply is 0.2 mm off the mold, nearly 30 mm."""
    report = inspect(bells((0.0, 0.0), (115.0, 0.0)))
    left, right = sorted((p.foot_outline_mm[:, 0] for p in report.pockets), key=np.mean)
    assert right.min() - left.max() > 1.2 * friction_length(Recipe()) > 1.5 * 15.0
    assert [p.verdict for p in report.pockets] == [Verdict.UNDECIDED] * 2


def test_less_friction_parts_less():
    report = inspect(bells((0.0, 0.0), (135.0, 0.0)), material={"friction": 0.1})
    assert [p.verdict for p in report.pockets] == [Verdict.UNDECIDED] * 2


@pytest.mark.parametrize(
    "wrong", [{"material": {"young_mpa": 3.6}}, {"loads": {"pressure_mpa": 1.0}}, {"material": {"friction": 4.0}}]
)  # two points too far left, bar, a point too far right
def test_no_unit_of_the_recipe_parts_what_an_edge_would_let_go(wrong):
    assert friction_length(Recipe(**wrong)) < 10.0
    report = inspect(bells((0.0, 0.0), (105.0, 0.0)), **wrong)
    assert [p.verdict for p in report.pockets] == [Verdict.UNDECIDED] * 2
    assert "more than 20 mm of flat ply" in report.pockets[0].reason


def test_the_papers_criterion_knows_no_excess():
    scan = bells((0.0, 0.0), (105.0, 0.0))
    assert all(p.verdict is p.paper_verdict for p in inspect(scan, verdict={"criterion": "paper"}).pockets)


def test_feet_that_merge_below_the_molds_tolerance_pass_no_pair_that_creases():
    """Between two pockets the ply comes down to 0.18 mm above the mold; 1.28 mm to spare."""
    layup = varied_layup(5000, (1280, 960), pockets=10, severity="any", noise=(), holes_mm=0, clamp=False, borders=0)
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


BELL = (0.0, 0.0, WIDE_MM, 5.3)  # 0.70 mm to spare: a ridge of 0.48 mm
BUMP = (30.0, 2.3)  # width and height: 0.42 mm to spare, below the tolerances on area and peak


def beside_a_bump(x, y, wide_mm, high_mm):
    bell, bump = laid_ply.bell(*BELL), laid_ply.bell(x, y, wide_mm, high_mm)
    return inspect(laid_ply.scan(lambda x, y: bell(x, y) + bump(x, y)))


def exact_arc_mm(wide_mm, high_mm):
    """Excess of the straight line over the middle of a squared cosine."""
    x = np.linspace(0.0, wide_mm, 20_001)
    return float(np.hypot(np.diff(x), np.diff(high_mm * np.sin(np.pi * x / wide_mm) ** 2)).sum()) - wide_mm


def test_a_bump_below_the_tolerances_counts_where_it_makes_a_pocket_crease():
    limit_mm = 2 * (Recipe().verdict.max_ridge_mm - 0.43 * laid_ply.THICKNESS_MM)
    singly = exact_arc_mm(WIDE_MM, 5.3), exact_arc_mm(*BUMP)
    assert max(singly) < 0.8 * limit_mm < limit_mm < sum(singly)
    report = beside_a_bump(71.0, 0.0, *BUMP)
    (p,) = report.pockets
    assert p.excess.alone_mm < 0.6
    assert p.verdict is report.verdict is Verdict.UNDECIDED
    said = re.match(r"a fibre over it and the bump at \(7[012], -?0\) mm is up to ([\d.]+) mm longer", p.reason)
    assert sum(singly) - 0.08 < float(said[1]) < sum(singly) + 0.12  # with all that the filters may have taken


@pytest.mark.parametrize(
    "bump",
    [(71.0, 0.0, 30.0, 1.3), (108.0, 0.0, *BUMP), (50.0, 65.0, *BUMP)],
    ids=["tiny", "40 mm away", "not on its fibres"],
)
def test_a_bump_that_cannot_add_enough_changes_nothing(bump):
    report = beside_a_bump(*bump)
    assert [p.verdict for p in report.pockets] == [Verdict.CEASE]


ROW_MM = (22.0, 2.3)  # width and height of bumps without a pocket: 0.58 mm to spare each


def bumps_alone(*centres):
    shapes = [laid_ply.bell(x, y, *ROW_MM) for x, y in centres]
    return inspect(laid_ply.scan(lambda x, y: np.sum([shape(x, y) for shape in shapes], axis=0)))


@pytest.mark.parametrize("along", [(1.0, 0.0), (0.0, 1.0)])
def test_two_bumps_in_a_row_are_undecided_without_a_pocket_between_them(along):
    limit_mm = 2 * (Recipe().verdict.max_ridge_mm - 0.43 * laid_ply.THICKNESS_MM)
    one_mm = exact_arc_mm(*ROW_MM)
    assert one_mm < 0.8 * limit_mm < limit_mm < 2 * one_mm
    report = bumps_alone((0.0, 0.0), (30.0 * along[0], 30.0 * along[1]))
    assert report.pockets == ()
    assert report.verdict is Verdict.UNDECIDED
    said = re.match(r"a fibre over the ply from .*, where no pocket is, is up to ([\d.]+) mm longer", report.reason)
    assert 2 * one_mm - 0.08 < float(said[1]) < 2 * one_mm + 0.25  # with all that the filters may have taken


def test_a_row_along_the_plys_edge_is_held_at_its_ends():
    """Its net slides there, for the edge is near; but along the fibres the ply goes on."""
    x = laid_ply.layup().ply_outline[:, 0].max() - 14.0
    report = bumps_alone((x, -15.0), (x, 15.0))
    assert report.pockets == ()
    assert report.verdict is Verdict.UNDECIDED
    assert report.reason.startswith("a fibre over the ply from ")


def test_a_row_beside_what_nobody_saw_may_be_held_there():
    """Without an outline nobody knows whether the ply ends in the strip that was not seen."""
    of, layup = laid_ply.inspector(), laid_ply.layup()
    x = layup.ply_outline[:, 0].max() - 13.0
    scan = laid_ply.scan(lambda u, v: sum(laid_ply.bell(x0, 0.0, *ROW_MM)(u, v) for x0 in (x - 30.0, x)))
    pose = layup.mold_from_scanner
    at = scan @ pose[:3, :3].T.astype(np.float32) + pose[:3, 3]
    scan[(at[..., 0] > x + 10.0) & (np.abs(at[..., 1]) < 8.0)] = np.nan
    report = Inspector(Recipe(), of.prepared, None, (0, 90), of.mold_from_scanner).inspect(scan)
    assert report.verdict is Verdict.UNDECIDED
    assert re.match(r"a fibre over the ply from .*, where no pocket is, is up to 1\.\d\d mm longer", report.reason)


@pytest.mark.parametrize("other", [(55.0, 0.0), (20.0, 24.0)], ids=["33 mm away", "not on its fibres"])
def test_bumps_apart_are_passed(other):
    report = bumps_alone((0.0, 0.0), other)
    assert report.pockets == ()
    assert report.verdict is Verdict.CEASE


def bumps_in_field(places):
    def shape(x, y):
        x0, y0 = (places[np.argmin(np.abs(v[..., None] - places), axis=-1)] for v in (x, y))
        return laid_ply.bell(0.0, 0.0, 30.0, 2.0)(x - x0, y - y0)

    return inspect(laid_ply.scan(shape))


def test_a_field_of_low_bumps_is_undecided():
    """Sixty-four of 0.33 mm to spare each, in eight rows: every choice of a row's bumps is a chain of its own."""
    places = 34.0 * (np.arange(8) - 3.5)
    report = bumps_in_field(places)
    assert report.verdict is Verdict.UNDECIDED
    assert any("where no pocket is" in one.reason for one in report.findings)


def test_what_nothing_bounds_is_said_in_words():
    ply = SimpleNamespace(recipe=Recipe())
    assert shared_runs._reason("it", 2e3, 1e3, ply).startswith(
        "nothing bounds how much longer than the mold a fibre over it"
    )
    assert shared_runs._reason("it", 2.0, 1.13, ply).startswith("a fibre over it is up to 2.00 mm longer")
