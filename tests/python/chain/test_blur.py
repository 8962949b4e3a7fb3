"""What a blur leaves of narrow bumps, and a strip that shows the blur and the gain of heights."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from debulk import InputError
from debulk.chain.blur import excess_left, strip_of, transfer


@pytest.mark.parametrize("sigma_mm", [0.5, 1.5, 3.0])
def test_transfer_agrees_with_a_filter(sigma_mm):
    x = np.arange(-60, 60, 0.02)
    for one in transfer(sigma_mm):
        bump = np.where(np.abs(x) < one.width_mm / 2, np.cos(np.pi * x / one.width_mm) ** 2, 0.0)
        blurred = gaussian_filter1d(bump, sigma_mm / 0.02, truncate=8.0)
        assert one.height == pytest.approx(blurred.max(), abs=1e-4)
        assert one.excess == pytest.approx(np.sum(np.diff(blurred) ** 2) / np.sum(np.diff(bump) ** 2), abs=1e-4)


def strip(gain, sigma_mm, seed=0):
    rng = np.random.default_rng(seed)
    fine = np.arange(-30, 30, 0.01)
    profile = gaussian_filter1d(np.where(np.abs(fine - 0.7) < 5, 0.5 * gain, 0.0), sigma_mm / 0.01)
    across = rng.uniform(-25, 25, 4000)
    return across, 0.3 + 0.001 * across + np.interp(across, fine, profile) + rng.normal(0, 0.03, len(across))


@pytest.mark.parametrize(("gain", "sigma_mm"), [(1.0, 0.8), (0.93, 1.6), (1.05, 2.5)])
def test_a_strip_shows_gain_and_blur(gain, sigma_mm):
    found = strip_of(*strip(gain, sigma_mm), known_height_mm=0.5, width_mm=10.0)
    assert found[0] == pytest.approx(gain, abs=0.01)
    assert found[1] == pytest.approx(sigma_mm, abs=0.2)


@pytest.mark.parametrize(("gain", "sigma_mm"), [(1.0, 0.8), (0.95, 2.0)])
def test_a_printed_ridge_shows_gain_blur_and_what_is_left_of_its_excess(gain, sigma_mm):
    rng = np.random.default_rng(1)
    fine = np.arange(-40, 40, 0.01)
    ridge = np.where(np.abs(fine) < 6, 0.8 * np.cos(np.pi * fine / 12) ** 2, 0.0)
    came = gain * gaussian_filter1d(ridge, sigma_mm / 0.01, truncate=8.0)
    across = rng.uniform(-30, 30, 4000)
    height = np.interp(across, fine, came) + rng.normal(0, 0.02, len(across))
    found = strip_of(across, height, 0.8, 12.0, "ridge")
    assert found == pytest.approx((gain, sigma_mm), abs=0.15)
    left = np.sum(np.diff(came) ** 2) / np.sum(np.diff(ridge) ** 2)
    assert excess_left(*found, 12.0) == pytest.approx(left, abs=0.02)
    assert excess_left(gain, sigma_mm, 12.0) == pytest.approx(left, abs=1e-3)


def test_no_strip_is_named():
    across, height = strip(0.0, 1.0)
    with pytest.raises(InputError, match="strip"):
        strip_of(across, height, 0.5, 10.0)
    with pytest.raises(InputError, match="points on and beside it"):
        strip_of(across[:50], height[:50], 0.5, 10.0)
