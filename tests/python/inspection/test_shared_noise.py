"""A scan that its scanner's software has smoothed is told by its noise, and passes nothing."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

import laid_ply
from debulk import Inspector, Recipe, scenes
from debulk.inspection.evidence.cloud_image import CloudImage
from debulk.inspection.rawscan.shared_noise import noise_is_shared, squares_on
from debulk.verdict import Verdict
from stranger_scenes import bump, cloud, flat, laid

NOISE = 0.02 * np.random.default_rng(0).standard_normal((500, 700)).astype(np.float32)
FOLD = np.random.default_rng(1).standard_normal((500, 700)).astype(np.float32)


def smoothed(scan, blur):
    """Change the ranges along the rays, as a scanner's software does; what was not seen stays so."""
    z = scan[..., 2]
    seen = np.isfinite(z)
    share = np.maximum(blur(seen.astype(np.float64)), 1e-9)
    times = blur(np.where(seen, z, 0.0).astype(np.float64)) / share / np.where(seen, z, 1.0)
    return np.where(seen[..., None], scan * times[..., None], np.nan).astype(np.float32)


def gaussian(sigma):
    return lambda values: cv2.GaussianBlur(values, (0, 0), sigma)


def told(depths, step=1, slope=0.1):
    y, x = np.mgrid[: depths.shape[0], : depths.shape[1]].astype(np.float32)
    scan = np.dstack([x, y, 800 + slope * (x + x**2 / 400) + depths])
    squares = squares_on(scan, 1.0, 16.0, lambda at: np.ones(len(at), dtype=bool))
    return noise_is_shared(CloudImage(scan, scan, 1.0), squares, step)


@pytest.mark.parametrize(
    "depths",
    [
        NOISE,
        0.02 * NOISE,
        0.0 * NOISE,
        cv2.GaussianBlur(NOISE, (0, 0), 0.5),
        cv2.blur(NOISE, (3, 3)),
        np.round(NOISE, 2),
        NOISE / 2 + 0.6 * cv2.GaussianBlur(FOLD, (0, 0), 4),
        NOISE + 0.04 * np.sin(0.4 * np.arange(700)),
        NOISE * np.linspace(0.2, 3, 700),
    ],
    ids=["white", "hardly any", "none", "a little", "3 points", "rounded", "correlated", "banding", "uneven"],
)
def test_a_scanners_own_noise_is_not_shared(depths):
    assert not told(depths.astype(np.float32))


@pytest.mark.parametrize("blur", [gaussian(0.8), gaussian(1.5), gaussian(4), lambda z: cv2.blur(z, (5, 5))])
def test_smoothed_noise_is_shared(blur):
    assert told(blur(NOISE))


@pytest.mark.parametrize("missing", [0.01, 0.02, 0.05])
@pytest.mark.parametrize("blur", [gaussian(1.0), gaussian(2), lambda z: cv2.blur(z, (5, 5))])
def test_so_it_is_where_points_are_missing_one_by_one(blur, missing):
    """With 2 % of them missing hardly a square of 256 was seen as a whole."""
    holes = np.where(np.random.default_rng(2).random(NOISE.shape) < missing, np.nan, 0.0)
    assert told(blur(NOISE) + holes) and not told(NOISE + holes)


def median(size, times=1):
    def blur(z):
        for _ in range(times):
            z = cv2.medianBlur(z.astype(np.float32), size)
        return z

    return blur


@pytest.mark.parametrize(
    "blur", [median(3), median(5, 8), lambda z: np.round(z, 2), lambda z: np.round(median(5)(z), 2)]
)
def test_a_median_and_rounding_are_let_pass(blur):
    """A median leaves noise of its own."""
    assert not told(blur(NOISE), slope=0.0)


@pytest.mark.parametrize("nothing", [np.nan, np.inf])
def test_where_nothing_was_seen_nothing_is_told(nothing):
    scan = np.full((500, 700, 3), nothing, np.float32)
    squares = np.column_stack([5 * np.arange(100), 7 * np.arange(100)])
    for some in (squares, squares[:0], squares_on(scan, 1.0, 16.0, lambda at: np.ones(len(at), dtype=bool))):
        assert not noise_is_shared(CloudImage(scan, scan, 1.0), some, 1)


def test_only_points_that_far_apart_matter():
    blurred = cv2.GaussianBlur(NOISE, (0, 0), 1.0)
    assert told(blurred) and not told(blurred, 4)


@pytest.mark.parametrize("doubled", [cv2.INTER_LINEAR, cv2.INTER_CUBIC])
def test_so_is_that_of_points_between_the_scanners_own(doubled):
    assert told(cv2.resize(NOISE[:250, :350], (700, 500), interpolation=doubled))


@pytest.mark.parametrize("sigma", [2, 3, 5])  # pixels
@pytest.mark.parametrize(("wide_mm", "high_mm"), [(10, 2.5), (16, 3), (24, 3.2)])
def test_a_bump_that_creases_does_not_pass_in_a_smoothed_scan(wide_mm, high_mm, sigma):
    """By the arc of its profile a fibre over it makes a ridge of 0.64 to 0.83 mm; of the widest two thirds are left."""
    inspector, scan = laid_ply.inspector(), laid_ply.scan(laid_ply.bell(50, 30, wide_mm, high_mm))
    assert inspector.inspect(scan).verdict > Verdict.CEASE
    report = inspector.inspect(smoothed(scan, gaussian(sigma)))
    assert report.verdict is Verdict.UNDECIDED
    assert "points of the scan 1 mm apart share their measuring noise" in report.reason


@pytest.mark.parametrize("times", [1, 8])
def test_nor_does_one_in_a_scan_after_a_median(times):
    """Its noise is not shared, but patches of the scan have none, as if they had been filled in."""
    scan = laid_ply.scan(laid_ply.bell(50, 30, 16, 3))
    report = laid_ply.inspector().inspect(smoothed(scan, median(5, times)))
    assert report.verdict > Verdict.CEASE
    assert "filled" in {one.check for one in report.findings}


@pytest.mark.parametrize("step_mm", [0.0, 0.01])
@pytest.mark.parametrize("sigma", [4, 8])
def test_without_noise_and_outline_the_edge_that_is_seen_shows_it(sigma, step_mm):
    """A virtual scan has no noise either; a fibre over its bump would crease."""

    def as_given(surface, blur):
        points = cloud(surface, (220, 180), 0.7, 0, noise_mm=0.0)
        depth = blur(points[..., 2])
        return np.dstack([points[..., :2], np.round(depth / step_mm) * step_mm if step_mm else depth])

    ply = laid(flat, bump(5, 2.5), (150, 120))
    inspector = Inspector(None, as_given(flat, lambda z: z), mold_from_scanner=np.eye(4))
    assert "smoothed" not in {one.check for one in inspector.inspect(as_given(ply, lambda z: z)).findings}
    report = inspector.inspect(as_given(ply, gaussian(sigma)))
    assert report.verdict > Verdict.CEASE and "smoothed" in {one.check for one in report.findings}


def test_without_noise_and_any_edge_nothing_shows_that_a_scan_was_not_smoothed():
    """A bell whose ridge is 0.77 mm high; its ply fills the image."""
    y, x = np.mgrid[0:225:0.75, 0:300:0.75]
    mold = 20 * np.sin(x / 180) + 8 * np.cos(y / 140)
    r = np.hypot(x - 150, y - 112)
    ply = mold + 0.3 + np.where(r < 10, 3.3 * np.cos(np.pi * r / 20) ** 2, 0.0)
    inspector = Inspector(None, np.dstack([x, y, mold]), mold_from_scanner=np.eye(4))
    report = inspector.inspect(np.dstack([x, y, gaussian(5)(ply)]))
    assert report.verdict is Verdict.UNDECIDED and "no noise, and nothing in it is sharp" in report.reason


def test_the_recipe_may_allow_for_it():
    layup, scan = laid_ply.layup(), laid_ply.scan(laid_ply.bell(50, 30, 80, 2.8))
    for fine_mm, expected in ((0.5, Verdict.UNDECIDED), (2.0, Verdict.CEASE)):
        recipe = Recipe(clean={"fine_mm": fine_mm})
        inspector = Inspector(recipe, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
        assert inspector.inspect(smoothed(scan, gaussian(0.8))).verdict is expected


def test_a_creasing_layup_is_said_to_crease_all_the_same():
    layup = scenes.layup(seed=0, pixels=(640, 480))
    inspector = Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    assert inspector.inspect(smoothed(layup.scan, gaussian(1.5))).verdict is Verdict.CREASE
