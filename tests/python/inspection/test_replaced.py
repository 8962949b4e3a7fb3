"""What a filter put in place of a bump lies inside a closed line of jumps, and passes no pocket."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import median_filter

import debulk
from debulk.inspection.rawscan.replaced import replaced
from debulk.verdict import Verdict
from stranger_scenes import bump, cloud, flat, laid, outline

SIZE, PLY, PITCH = (200.0, 180.0), (160.0, 140.0), 0.9
TOLD = "inside a closed line along which the heights jump"


def _image(surface, noise_mm=0.02, seed=1):
    """Heights, and their places, at samples a millimetre apart."""
    y, x = np.mgrid[-80.0:80.0, -90.0:90.0]
    z = surface(x, y) + np.random.default_rng(seed).normal(0, noise_mm, x.shape)
    return z.astype(np.float32), np.dstack([x, y]).astype(np.float32)


def _found(height, xy_mm, sample_mm=1.0, step_mm=0.0, mold=None):
    mold = np.zeros_like(height) if mold is None else mold
    return replaced(height, mold, xy_mm, sample_mm, 11.3, lambda: step_mm)


def _cut(height, least_mm=0.4, wide=33):
    """Set what stands out of a median over so many samples to that median."""
    middle = median_filter(height, wide)
    return np.where(height - middle > least_mm, middle, height)


def _bell(high, radius, slope=0.0):
    return lambda x, y: slope * x + high * np.cos(np.pi / 2 * np.minimum(np.hypot(x, y) / radius, 1)) ** 2


@pytest.mark.parametrize("slope", [0.0, 0.1, 0.2])
@pytest.mark.parametrize("wide", [21, 33, 41])
def test_a_bump_set_to_a_median_is_found_with_its_place_and_width(slope, wide):
    height, xy = _image(_bell(3.5, 10.0, slope))
    cut = _cut(height, wide=wide)
    inner = np.s_[wide:-wide, wide:-wide]
    (one,) = _found((cut - np.float32(slope) * xy[..., 0])[inner], xy[inner])
    made = np.count_nonzero((cut != height)[inner])
    assert np.hypot(*one.centre_mm) < 2.0
    assert 0.9 < one.area_mm2 / made < 1.7
    assert 0.95 < one.thickness_mm / np.sqrt(4 / np.pi * made) < 1.3
    assert (one.box_mm[0] < -4.0).all()
    assert (one.box_mm[1] > 4.0).all()


@pytest.mark.parametrize("sigma", [0.005, 0.02, 0.05])
def test_what_a_ply_does_is_no_patch(sigma):
    """Bells, caps with a kink at their foot, steps, a corner of a ply, and level ply."""
    cap = lambda x, y: 3.0 * np.maximum(1 - (x**2 + y**2) / 100, 0)  # noqa: E731
    step = lambda x, y: 0.5 * (x > 3.2)  # noqa: E731
    corner = lambda x, y: 0.5 * ((x > 3.2) & (y > -10))  # noqa: E731
    for surface in (_bell(3.5, 10.0), _bell(2.0, 6.0), cap, step, corner, _bell(0.0, 1.0)):
        assert not _found(*_image(surface, sigma))


def test_flying_pixels_and_uneven_noise_make_no_patch():
    rng = np.random.default_rng(2)
    for share in (0.005, 0.02, 0.05, 0.1):
        height, xy = _image(_bell(2.0, 12.0))
        flies = rng.random(height.shape) < share
        height[flies] += rng.normal(0, 5, flies.sum())
        assert not _found(height, xy), share
    height, xy = _image(_bell(2.0, 12.0))
    height += (np.hypot(*np.moveaxis(xy, 2, 0)) < 30) * rng.normal(0, 0.1, height.shape)
    assert not _found(height.astype(np.float32), xy)


def test_it_is_found_among_flying_pixels():
    height, xy = _image(_bell(3.5, 10.0))
    height = _cut(height)
    flies = np.random.default_rng(3).random(height.shape) < 0.01
    height[flies] += 4.0
    assert len(_found(height, xy)) == 1


def test_contour_lines_of_rounded_depths_are_no_patch():
    height, xy = _image(_bell(0.6, 30.0), 0.0)
    height = np.round(height / 0.5) * np.float32(0.5)
    assert _found(height, xy)
    assert not _found(height, xy, step_mm=0.5)


def test_a_ply_may_seem_to_jump_where_the_mold_does():
    """The reference rounds the wall of a pad, as its grid does, and the ply's heights above it jump."""
    pad = lambda x, y: 2.0 * (np.hypot(x, y) < 12)  # noqa: E731
    height, xy = _image(lambda x, y: pad(x, y) - pad(x + 0.6, y + 0.4))
    mold = pad(*np.moveaxis(xy, 2, 0)).astype(np.float32)
    assert _found(height + mold, xy)
    assert not _found(height + mold - mold, xy, mold=mold)


def test_an_unseen_sample_is_no_jump():
    height, xy = _image(_bell(3.5, 10.0))
    height[np.hypot(*np.moveaxis(xy, 2, 0)) < 8] = np.nan
    assert not _found(height, xy)


@pytest.mark.layup
@pytest.mark.parametrize("listed", [False, True])
def test_a_layup_whose_bump_was_replaced_is_undecided(listed):
    scan, reference = (cloud(one, SIZE, PITCH, n) for n, one in enumerate((laid(flat, bump(9.5, 3.6), PLY), flat)))
    whole = scan.copy()
    scan[..., 2] = _cut(scan[..., 2], least_mm=0.6, wide=25)
    if listed:
        scan = scan.reshape(-1, 3)
    before, after = (
        debulk.inspect(points, reference, None, outline(*PLY), mold_from_scanner=np.eye(4)) for points in (whole, scan)
    )
    assert before.verdict is Verdict.CREASE
    assert after.verdict is Verdict.UNDECIDED
    assert any(one.check == "filled" and TOLD in one.reason for one in after.findings)
