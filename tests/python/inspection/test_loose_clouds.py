"""Lists of points that a scanner's software filtered, filled or thinned: a pocket that creases does not pass."""

from __future__ import annotations

import functools
import re

import cv2
import numpy as np
import pytest

from debulk import Inspector, Verdict
from debulk.inspection.evidence.cloud_image import laid_out
from debulk.surface import Reference

PITCH, THICK, NOISE = 0.9, 0.3, 0.02
OUTLINE = np.array([[-95.0, -75.0], [95.0, -75.0], [95.0, 75.0], [-95.0, 75.0]])
X, Y = np.meshgrid(np.arange(-125.0, 125.0, PITCH), np.arange(-105.0, 105.0, PITCH))


def mold(x, y):
    return 1e-4 * x * x + 0.5e-4 * x * y - 8e-5 * y * y + 0.05 * x


def image(wide_mm=0.0, high_mm=0.0, seed=1):
    """The ply with a bell of this width and height, or flat; each pixel has a place in mold XY of its own."""
    u, v = (np.clip((w - at) / max(wide_mm, 1e-9), -0.5, 0.5) for w, at in ((X, 10.3), (Y, 5.7)))
    bell = high_mm * (np.cos(np.pi * u) * np.cos(np.pi * v)) ** 2 if high_mm else 0.0
    on = (np.abs(X) < 95) & (np.abs(Y) < 75)
    noise = np.random.default_rng(seed).normal(0, NOISE, X.shape)
    return np.dstack([X, Y, mold(X, Y) + np.where(on, THICK + bell, 0.0) + noise])


def loose(cloud):
    return np.random.default_rng(3).permutation(cloud.reshape(-1, 3)).astype(np.float32)


@functools.cache
def inspector(outlined=True):
    bare = np.dstack([X, Y, mold(X, Y) + np.random.default_rng(0).normal(0, NOISE, X.shape)])
    return Inspector(None, loose(bare), OUTLINE if outlined else None, (0, 90))


def voxel_mean(cloud, side_mm):
    points = cloud.reshape(-1, 3)
    _, of, count = np.unique(np.floor(points / side_mm), axis=0, return_inverse=True, return_counts=True)
    return np.stack([np.bincount(of.ravel(), points[:, k]) / count for k in range(3)], axis=1).astype(np.float32)


def smoothed(cloud, sigma_mm):
    above = cloud[..., 2] - mold(X, Y)
    return np.dstack([X, Y, cv2.GaussianBlur(above, (0, 0), sigma_mm / PITCH) + mold(X, Y)])


def filled(cloud, radius_mm):
    """Bridge a disc by straight lines along x from rim to rim."""
    out = cloud.copy()
    for row in out:
        inside = np.flatnonzero(np.hypot(row[:, 0] - 10.3, row[:, 1] - 5.7) < radius_mm)
        if len(inside):
            ends = [inside[0] - 1, inside[-1] + 1]
            row[inside, 2] = np.interp(inside, ends, row[ends, 2])
    return out


# Width and height of bells whose ridge by the arc of their profile is 0.78 mm.
BELLS = [(16.0, 3.1), (24.0, 3.55)]


@pytest.mark.parametrize(("wide", "high"), BELLS)
def test_means_over_voxels_do_not_hide_a_pocket(wide, high):
    """It was CEASE, "a ridge of 0.45 mm at most": the bound took the grid's spacing for that of the points."""
    report = inspector(outlined=False).inspect(voxel_mean(image(wide, high), 3.0))
    assert report.verdict in (Verdict.UNDECIDED, Verdict.CREASE)
    (bound,) = (
        found[1] for one in report.left_out if (found := re.match(r"bumps narrower than ([\d.]+) mm", one.what))
    )
    assert float(bound) > 5 * 2.9  # five points


@pytest.mark.parametrize(("wide", "high"), BELLS)
def test_a_smoothed_list_of_points_is_recognised(wide, high):
    report = inspector().inspect(loose(smoothed(image(wide, high), 3.5)))
    assert report.verdict is Verdict.UNDECIDED
    assert "share their measuring noise" in report.reason


@pytest.mark.parametrize(("wide", "high"), BELLS)
def test_a_pocket_that_was_filled_in_is_found_in_a_list_of_points(wide, high):
    report = inspector().inspect(loose(filled(image(wide, high), wide / 2)))
    assert report.verdict in (Verdict.UNDECIDED, Verdict.INVALID)
    assert "carry no measuring noise" in report.reason


@pytest.mark.parametrize("outlined", [True, False], ids=["outline", "no outline"])
def test_a_right_list_of_points_raises_no_alarm(outlined):
    scan = loose(image(seed=5))
    for given in (scan, np.round(scan, 3), scan[::2]):
        report = inspector(outlined).inspect(given)
        assert report.passed, report.reason


def test_rounded_depths_are_said_to_hide_what_was_filled():
    report = inspector().inspect(np.round(loose(image(seed=5)) / 0.05).astype(np.float32) * np.float32(0.05))
    assert report.verdict is not Verdict.INVALID
    assert any("rounded to steps of 0.05 mm" in one.why for one in report.left_out)


def test_points_are_moved_to_the_middle_of_their_pixel_along_the_slope():
    flat = Reference(np.zeros((9, 9)), (-40.0, -40.0), 10.0)
    rng = np.random.default_rng(2)
    xy = rng.uniform(-30, 30, (4000, 2))
    points = np.column_stack([xy, 0.2 * xy[:, 0] - 0.1 * xy[:, 1]]).astype(np.float32)
    laid = laid_out(points, None, flat, np.array([[-25.0, -25.0], [25.0, 25.0]]), 60 / np.sqrt(4000), 1)
    assert laid is not None
    seen = np.isfinite(laid.heights[..., 2])
    assert seen.mean() > 0.88
    inner = seen & (np.abs(laid.heights[..., :2]).max(axis=-1) < 20)
    x, y, z = laid.heights[inner].T.astype(float)
    assert np.std(z - 0.2 * x + 0.1 * y) < 0.3 * np.std(laid.points[inner][:, 2] - 0.2 * x + 0.1 * y)
    assert laid_out(points, None, flat, np.array([[90.0, 90.0], [99.0, 99.0]]), 1.0, 1) is None


def test_an_upper_end_that_bounds_nothing_is_said_in_words():
    """Where one point in twenty is left on flat ply, its distance to the next is half of the bell's width."""
    scan = image(20.0, 3.0)
    near = np.hypot(X - 10.3, Y - 5.7) < 15
    report = inspector().inspect(loose(scan[near | (np.random.default_rng(1).random(X.shape) < 1 / 20)]))
    assert report.verdict is Verdict.UNDECIDED
    assert report.pockets[0].excess.range_mm[1] > 1000
    assert "0.00 mm or more (nothing bounds it)" in report.reason
    assert report.pockets[0].deciding_ridge.spread == "(0.00 or more)"
    said = [
        report.reason,
        *(one.reason for one in report.pockets),
        *(f"{one.why} {one.bound}" for one in report.left_out),
    ]
    assert not re.findall(r"\d{3,}\.\d+ mm", " ".join(said))
