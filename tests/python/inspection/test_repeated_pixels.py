"""A scan that was enlarged by repeating pixels is named as such, and one whose rows are doubled is judged."""

import numpy as np
import pytest

import debulk
from debulk.inspection.clouds.repeated_pixels import LIMITS, repeated_share


@pytest.fixture(scope="module")
def layup():
    return debulk.scenes.layup(seed=5, pixels=(960, 720))


def inspect(layup, scan):
    return debulk.inspect(
        scan, layup.reference, ply_outline=layup.ply_outline, mold_from_scanner=layup.mold_from_scanner
    )


@pytest.mark.parametrize("times", [2, 3, 4])
def test_repeated_pixels_are_named(layup, times):
    height, width = layup.scan.shape[:2]
    few = layup.scan[::times, ::times]
    report = inspect(layup, few.repeat(times, axis=0).repeat(times, axis=1)[:height, :width])
    assert report.verdict is debulk.Verdict.INVALID
    assert "enlarged by repeating pixels" in report.reason


def test_doubled_rows_do_no_harm(layup):
    plain, doubled = inspect(layup, layup.scan), inspect(layup, layup.scan[::2].repeat(2, axis=0))
    assert doubled.verdict is plain.verdict
    assert "repeating" not in doubled.reason


def test_only_points_that_were_seen_count(layup):
    assert repeated_share(layup.scan) == 0
    assert repeated_share(layup.scan.reshape(-1, 3)) == 0
    assert repeated_share(np.empty((0, 3), np.float32)) == 0
    assert repeated_share(np.full((8, 3), np.nan, np.float32)) == 0
    assert repeated_share(np.full((8, 8, 3), np.nan, np.float32)) == 0
    assert repeated_share(np.ones((8, 8, 3), np.float32)) == 1


@pytest.mark.parametrize("shape", [(481, 641), (480, 640), (960, 1280)])
@pytest.mark.parametrize("times", [2, 3, 4])
def test_it_does_not_matter_where_the_blocks_begin(shape, times):
    height, width = shape
    few = np.random.default_rng(1).random((height // times + 2, width // times + 2, 3), dtype=np.float32)
    large = few.repeat(times, axis=0).repeat(times, axis=1)
    for begin in range(times):
        assert repeated_share(large[begin : begin + height, begin : begin + width]) > LIMITS.share


@pytest.mark.parametrize("order", ["side by side", "in heaps", "mixed"])
def test_points_that_a_list_holds_five_times_are_named(layup, order):
    """It was "0.0 % of the ply was seen": the outlier filter takes heaps of points away."""
    points = layup.scan[np.isfinite(layup.scan).all(axis=2)]
    many = np.tile(points, (5, 1)) if order == "side by side" else points.repeat(5, axis=0)
    report = inspect(layup, np.random.default_rng(0).permutation(many) if order == "mixed" else many)
    assert report.verdict is debulk.Verdict.INVALID
    assert "80 % of the scan's points are copies of another point" in report.reason
    assert "about 5 times; give each point once" in report.reason
