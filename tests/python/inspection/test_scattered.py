"""A spot whose points scatter about the ply is not called CREASE; a bump with a few flying pixels still is."""

from dataclasses import replace

import numpy as np
import pytest

import laid_ply
from debulk import Verdict, inspect
from debulk.inspection.rawscan import narrow, scattered
from debulk.inspection.rawscan.narrow import Standing
from lab.varied import given_right, varied_layup

MIDDLE_MM = (60.0, 40.0)


@pytest.mark.parametrize("seed", [626769, 689855])  # layups that cease, with such spots
def test_spots_that_scatter_are_undecided_and_say_why(seed):
    g = given_right(varied_layup(seed, (1280, 960)))
    how = g.ply_outline, g.fibre_angles_deg, g.mold_from_scanner, g.camera, g.mask
    report = inspect(g.scan, g.reference, None, *how)
    told = [one for one in report.pockets if "its points scatter" in one.reason]
    assert report.verdict is Verdict.UNDECIDED
    assert told
    for one in told:
        assert one.verdict is Verdict.UNDECIDED
        assert "exceeds the limit" in one.reason  # what it would be if its points were believed
        assert one.crease_probability is None
    assert report.settle().verdict is Verdict.UNDECIDED


def test_a_bump_creases_also_where_pixels_fly_beside_it():
    pose, points = laid_ply.layup().mold_from_scanner, laid_ply.scan(laid_ply.bell(*MIDDLE_MM, 30.0, 4.0))
    x, y = np.moveaxis(points @ pose[:2, :3].T + pose[:2, 3], 2, 0)
    spot = np.hypot(x - MIDDLE_MM[0], y - MIDDLE_MM[1]) < 3.0
    points[spot] += (np.random.default_rng(1).uniform(-4, 4, (np.count_nonzero(spot), 1)) * pose[2, :3]).astype("f4")
    assert laid_ply.inspector().inspect(points).verdict is Verdict.CREASE


def test_so_many_samples_must_lie_under_the_mold(report):
    creasing = next(one for one in report.pockets if one.verdict is Verdict.CREASE)
    foot_mm = creasing.foot_or_outline_mm
    low, high = foot_mm.min(axis=0), foot_mm.max(axis=0)
    sunk_mm = np.random.default_rng(0).uniform(low, high, (400, 2))

    def verdict_with(count, sample_mm):
        (one,) = scattered.told([creasing], Standing(sample_mm=sample_mm, sunk_mm=sunk_mm[:count]))
        return one.verdict

    enough_mm = np.sqrt(np.prod(high - low) * scattered.LIMITS.least_share / 400)
    assert verdict_with(400, 1.1 * enough_mm) is not Verdict.CREASE
    assert verdict_with(400, 0.7 * enough_mm) is Verdict.CREASE
    assert verdict_with(narrow.LIMITS.fewest - 1, 100 * enough_mm) is Verdict.CREASE
    assert verdict_with(0, np.inf) is Verdict.CREASE


def test_a_part_of_a_spot_that_the_filters_left_is_not_judged(report):
    """Its foot holds no sample under the mold, but round it are some; round one as large as a bump they are too few."""
    creasing = next(one for one in report.pockets if one.verdict is Verdict.CREASE)
    round_mm = scattered.LIMITS.round_mm
    ways = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    circle = np.column_stack([np.cos(ways), np.sin(ways)])
    sunk_mm = MIDDLE_MM + (3.0 + 0.5 * round_mm) * circle

    def verdict_of(radius_mm, at_mm=(0.0, 0.0)):
        part = replace(creasing, foot_outline_mm=np.add(MIDDLE_MM, at_mm) + radius_mm * circle, promoted="a part")
        (one,) = scattered.told([part], Standing(sample_mm=1.0, sunk_mm=sunk_mm))
        return one.verdict

    assert verdict_of(3.0) is Verdict.UNDECIDED
    assert verdict_of(3.0, (30.0, 0.0)) is Verdict.CREASE
    assert verdict_of(15.0) is Verdict.CREASE
