"""Pixels of a coarse image that fly side by side are taken out; what a ply may be stays."""

import numpy as np
import pytest

from debulk.inspection.evidence.flying import LIMITS, flying, without_flying

PITCH_MM = 2.0
Y, X = np.mgrid[-20:21, -20:21] * PITCH_MM


def tilted(height):
    return (height + 0.3 * X - 0.2 * Y + np.random.default_rng(4).normal(0, 0.03, X.shape)).astype(np.float32)


def ridge(half_wide_mm, half_long_mm, high_mm, x_mm=0.0):
    r2 = ((X - x_mm) / half_long_mm) ** 2 + (Y / half_wide_mm) ** 2
    return high_mm * np.cos(np.pi / 2 * np.sqrt(np.minimum(r2, 1))) ** 2


def test_rows_of_pixels_that_fly_are_found_and_nothing_else():
    height = np.zeros(X.shape)
    height[4, 5:11] = [6.8, 7.3, 6.1, 5.5, 6.7, 4.7]
    height[20, 20] = 12
    height[30, 7:11], height[31, 9:14] = [5.1, 7.5, 7.3, 8.0], [9.7, 8.6, 9.7, 7.5, 9.3]  # two rows side by side
    np.testing.assert_array_equal(flying(tilted(height), PITCH_MM), height > 0)


@pytest.mark.parametrize("high_mm", [3.0, 5.0, 8.0, 12.0])
@pytest.mark.parametrize(
    ("half_wide_mm", "half_long_mm"), [(4, 4), (5, 5), (3, 12), (4, 18), (5, 10)], ids=lambda mm: f"{mm} mm"
)
def test_bumps_that_fall_off_along_their_crest_stay(half_wide_mm, half_long_mm, high_mm):
    for height in (ridge(half_wide_mm, half_long_mm, high_mm), ridge(half_wide_mm, half_long_mm, high_mm, 1.0)):
        assert not flying(tilted(height), PITCH_MM).any()


def test_wrinkles_solid_things_and_what_may_go_on_in_a_hole_stay():
    wall = np.where((Y == 0) & (np.abs(X) <= LIMITS.longest_mm / 2), 8.0, 0.0)
    block = np.where((np.abs(X) < 3) & (np.abs(Y) < 3), 8.0, 0.0)
    run = np.where((Y == 0) & (np.abs(X) < 5), 8.0, 0.0)
    for height in (wall, block, np.where((Y > 0) & (Y < 9) & (np.abs(X) < 9), np.nan, run)):
        assert not flying(tilted(height), PITCH_MM).any()
    assert flying(tilted(run), PITCH_MM).any()


def test_a_fine_image_and_a_list_are_returned_as_they_are():
    points = np.dstack([X, Y, np.where((Y == 0) & (np.abs(X) < 5), 8.0, 0.0)]).astype(np.float32)
    up = np.array([0.0, 0.0, 1.0])
    assert without_flying(points, up, 0.9) is points
    assert without_flying(points.reshape(-1, 3), up, PITCH_MM).ndim == 2
    taken = without_flying(points, up, PITCH_MM)
    np.testing.assert_array_equal(np.isnan(taken).all(axis=2), points[..., 2] > 0)
    assert np.isfinite(points).all()
