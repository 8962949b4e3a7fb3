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
    assert report.verdict is Verdict.UNDECIDED
    places = [one for one in report.pockets if one.promoted]
    assert places
    for one in places:  # what the filters left of the spots
        assert one.verdict is Verdict.UNDECIDED
        assert "of the pocket was measured" in one.reason
        assert one.crease_probability is None
    assert report.settle().verdict is Verdict.UNDECIDED


def spoiled(high_mm: float, lost_share: float, seed: int) -> np.ndarray:
    """A ply (H, W, 3) on a plane, 2 mm from pixel to pixel, with a bump of which so many pixels are lost."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[-130.0:131.0:2.0, -130.0:131.0:2.0]
    away = np.hypot(x, y) / 9.0
    on_ply = np.maximum(np.abs(x), np.abs(y)) <= 100
    z = 0.3 * on_ply + high_mm * np.cos(np.pi / 2 * np.minimum(away, 1)) ** 2
    z[(away < 1) & (rng.random(z.shape) < lost_share)] = np.nan
    z += rng.normal(0, 0.01, z.shape)
    return np.dstack([np.where(np.isnan(z), np.nan, x), np.where(np.isnan(z), np.nan, y), z])


def verdict_and_reasons(scan: np.ndarray) -> tuple[Verdict, str]:
    mold = spoiled(0.0, 0.0, 1)
    mold[..., 2] = np.random.default_rng(2).normal(0, 0.01, mold.shape[:2])
    square = np.array([(-100.0, -100.0), (100.0, -100.0), (100.0, 100.0), (-100.0, 100.0)])
    report = inspect(scan, mold, None, square, (0.0, 90.0))
    return report.verdict, " ".join(one.reason for one in report.findings)


@pytest.mark.parametrize("seed", range(3))
def test_a_bump_of_which_a_quarter_was_seen_is_not_measured(seed):
    """It is seen too low, as the filters leave it where points scatter; a bump so low, seen whole, ceases."""
    verdict, why = verdict_and_reasons(spoiled(1.4, 0.75, seed))
    assert verdict is Verdict.UNDECIDED, why
    assert verdict_and_reasons(spoiled(1.4, 0.0, seed))[0] is Verdict.CEASE


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
    round_mm = 1.0 * narrow.LIMITS.near_samples
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
