"""A bump too narrow for the filters is found in the raw scan and never passes; good layups raise no such alarm."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import laid_ply
from debulk import Inspector, Recipe, Verdict, _core, scenes
from debulk.inspection.rawscan import narrow_bumps
from lab.varied import given_right, varied_layup

BELLS = [  # x, y, width at the foot, height, mm
    (60, 40, 5, 2),
    (-140.5, 80.3, 7, 2),
    (10.2, -120.7, 9, 2),
    (0.4, 100.6, 6, 3),
    (-80.7, -60.2, 8, 3),
    (100.1, -40.5, 5, 6),
    (-30.6, 20.9, 6, 6),
]
THICKNESS_SHARE = 0.43  # of the thickness, in a ridge without excess length


def _true_ridge_mm(wide_mm, high_mm):
    """By Simpson's rule over the arc of a squared cosine."""
    x = np.linspace(0, wide_mm, 2001)
    arc = np.sqrt(1 + (high_mm * np.pi / wide_mm * np.sin(2 * np.pi * x / wide_mm)) ** 2)
    weights = np.r_[1, np.tile([4, 2], 1000)[:-1], 1] * wide_mm / 2000 / 3
    return (weights @ arc - wide_mm) / 2 + THICKNESS_SHARE * laid_ply.THICKNESS_MM


def _bells(*bells):
    shapes = [laid_ply.bell(*bell) for bell in bells]
    return lambda x, y: sum(shape(x, y) for shape in shapes)


@functools.cache
def _scan(count=None):
    return laid_ply.scan(_bells(*BELLS[:count]), noise_mm=0.05)


def _quantised(scan, step_mm, seed=1):
    depth = np.linalg.norm(scan, axis=2, keepdims=True)
    noisy = depth + np.random.default_rng(seed).normal(0, 0.05, depth.shape)
    return (scan * (np.round(noisy / step_mm) * step_mm / depth)).astype(np.float32)


@pytest.mark.parametrize("step_mm", [0, 0.12], ids=["white", "quantised"])
def test_bells_that_the_filters_take_away_are_found_with_place_height_and_ridge(step_mm):
    scan = _quantised(_scan(), step_mm) if step_mm else _scan()
    found = laid_ply.inspector()._wrinkles.find(scan, None).bumps
    assert len(found) == len(BELLS)
    for x, y, wide_mm, high_mm in BELLS:
        bump = min(found, key=lambda one: np.linalg.norm(np.subtract(one.top_mm, (x, y))))
        assert np.linalg.norm(np.subtract(bump.top_mm, (x, y))) < 2
        assert bump.height_mm == pytest.approx(high_mm, rel=0.3)
        assert _true_ridge_mm(wide_mm, high_mm) > laid_ply.inspector().recipe.verdict.max_ridge_mm
        assert bump.ridge_mm == pytest.approx(_true_ridge_mm(wide_mm, high_mm), rel=0.4)


@pytest.mark.parametrize("pixels", [(640, 480), (1280, 960)], ids=["640", "1280"])
@pytest.mark.parametrize("seed", [0, 111])
def test_flying_points_side_by_side_are_none(seed, pixels):
    """Two or three of them, 3 to 35 mm high, stand out as a bump does; the first family has dozens a scan."""
    layup = scenes.layup(seed, pixels)
    inspector = Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    assert inspector._wrinkles.find(layup.scan, None).bumps == ()


@pytest.mark.parametrize("regions", [True, False], ids=["regions", "whole scan"])
def test_they_leave_the_layup_undecided_and_the_report_says_where(regions):
    report = laid_ply.inspector(regions).inspect(_scan(3))
    assert report.pockets == ()
    assert report.verdict is Verdict.UNDECIDED
    assert "narrower than what the height map resolves" in report.reason
    assert sum(one.what.startswith("a bump about") for one in report.left_out) == 3


def test_one_too_low_for_a_ridge_passes():
    assert _true_ridge_mm(9, 1) < 0.5 * laid_ply.inspector().recipe.verdict.max_ridge_mm
    assert laid_ply.inspector().inspect(laid_ply.scan(_bells((60, 40, 9, 1)))).verdict is Verdict.CEASE


def test_flying_pixels_highlights_and_pockets_are_no_bumps():
    pockets = laid_ply.bell(50, 30, 30, 8), laid_ply.bell(-200, -100, 200, 8, 16)
    scan = laid_ply.scan(lambda x, y: pockets[0](x, y) + pockets[1](x, y), noise_mm=0.1)
    rng = np.random.default_rng(5)
    depth = np.linalg.norm(scan, axis=2, keepdims=True)
    off = np.where(rng.random(depth.shape) < 0.01, rng.normal(0, 6, depth.shape), 0)
    rows, columns = np.mgrid[: scan.shape[0], : scan.shape[1]]
    for _ in range(30):  # spots in which every depth is wild
        row, column, radius = rng.uniform(200, 760), rng.uniform(200, 1080), rng.uniform(3, 12)
        spot = np.hypot(rows - row, columns - column) < radius
        off = np.where(spot[..., None], rng.normal(0, 2, depth.shape), off)
    noisy = (scan * (1 + off / depth)).astype(np.float32)
    assert laid_ply.inspector()._wrinkles.find(noisy, None).bumps == ()


@pytest.mark.parametrize("seed", [1201, 1202, 1203, 1204])
def test_good_layups_with_holes_clamps_and_all_noise_raise_no_alarm(seed):
    noise = ["correlated", "quantised", "highlights", "flying"]
    given = given_right(varied_layup(seed, (800, 600), noise=noise, holes_mm=[6, 15, 40], clamp=True))
    ply = Inspector(None, given.reference, given.ply_outline, mold_from_scanner=given.mold_from_scanner)
    assert ply._wrinkles.find(given.scan, given.mask).bumps == ()


def test_the_search_is_the_same_on_any_number_of_threads():
    scan = _scan()
    one, many = (
        Inspector(
            Recipe(run={"threads": threads}),
            laid_ply.inspector().prepared,
            laid_ply.layup().ply_outline,
            mold_from_scanner=laid_ply.layup().mold_from_scanner,
        )._wrinkles.find(scan, None)
        for threads in (1, 3)
    )
    assert one.bumps == many.bumps
    assert one.bumps


def test_where_it_was_not_looked_for_the_class_is_named():
    search = laid_ply.inspector()._wrinkles
    scan = _scan()
    late = _core.Stop()
    late.set_deadline(1e-9)
    assert search.find(scan, None, late).bumps is None
    assert search.find(np.ascontiguousarray(scan.reshape(-1, 3)), None).bumps is None
    entry = narrow_bumps.not_looked_for(1.0)
    assert "9 mm" in entry.what
    assert entry.bound.startswith("none")
    (unseen,) = (one for one in search.find(scan, None).left_out if "at their foot, and" in one.what)
    assert unseen.what.startswith("bumps narrower than 5 mm")
