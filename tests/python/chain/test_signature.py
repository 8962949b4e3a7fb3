"""The signature of a scan, measured on windows whose noise, pitch, rounding and filters are known."""

import cv2
import numpy as np
import pytest

from debulk.chain.signature import signature_of
from debulk.chain.windows import windows_of

NOISE_MM = 0.05
PITCH_MM = 1.3


def scan(seed=0, noise_mm=NOISE_MM, change=lambda depth: depth):
    """Return a (240, 320, 3) image of a curved ply, 600 mm below the scanner, with filtered depths."""
    x, y = np.meshgrid(PITCH_MM * np.arange(320.0), PITCH_MM * np.arange(240.0))
    depth = 600 + 0.1 * x + 20 * np.sin(x / 150) * np.cos(y / 180)
    depth = change((depth + np.random.default_rng(seed).normal(0, noise_mm, depth.shape)).astype(np.float32))
    return np.dstack([x, y, depth]).astype(np.float32)


def everywhere(points):
    return np.ones(len(points), dtype=bool)


def signature(cloud):
    return signature_of(windows_of(cloud, everywhere, PITCH_MM), PITCH_MM, image=cloud.ndim == 3)


def test_white_noise_is_measured_as_it_is():
    found = signature(scan())
    assert found.noise_mm == pytest.approx(NOISE_MM, rel=0.05)
    assert all(abs(value) < 0.07 for value in (found.near, found.middle, found.far))
    assert found.repeated < 0.005
    assert found.step_mm == 0
    assert found.missing == 0


def test_a_list_of_points_has_the_signature_of_its_image():
    cloud = scan()
    image, points = signature(cloud), signature(np.random.default_rng(1).permutation(cloud.reshape(-1, 3)))
    assert points.noise_mm == pytest.approx(image.noise_mm, rel=0.05)
    assert points.near == pytest.approx(image.near, abs=0.02)
    assert np.isnan(points.missing)


@pytest.mark.parametrize(
    "change", [lambda depth: cv2.blur(depth, (3, 3)), lambda depth: cv2.GaussianBlur(depth, (0, 0), 1.0)]
)
def test_a_mean_shares_noise(change):
    """Expected from the filter's weights: the covariance of a window's noise without what the polynomial takes."""
    single = np.zeros((41, 41), np.float32)
    single[20, 20] = 1
    weights = change(single)
    of_lag = cv2.filter2D(weights, -1, weights, borderType=cv2.BORDER_CONSTANT)
    x, y = (axis.ravel() for axis in np.meshgrid(np.arange(16), np.arange(16)))
    dx, dy = x[:, None] - x, y[:, None] - y
    covariance = of_lag[20 + dy, 20 + dx]
    powers = [(x / 8 - 1) ** i * (y / 8 - 1) ** j for i in range(5) for j in range(5 - i)]
    basis = np.linalg.qr(np.stack(powers, axis=1))[0]
    rest = np.eye(256) - basis @ basis.T
    covariance = rest @ covariance @ rest
    variance = np.diag(covariance).mean()
    apart = np.hypot(dx, dy)
    found = signature(scan(change=change))
    assert found.near == pytest.approx(covariance[(apart > 0) & (apart < 1.5)].mean() / variance, abs=0.03)
    assert found.middle == pytest.approx(covariance[(apart > 1.5) & (apart < 2.5)].mean() / variance, abs=0.03)
    assert found.noise_mm == pytest.approx(NOISE_MM * np.sqrt(variance), rel=0.05)
    assert found.near > 0.3


def test_a_median_repeats_depths():
    assert signature(scan(change=lambda depth: cv2.medianBlur(depth, 3))).repeated > 0.03


@pytest.mark.parametrize("step_mm", [0.01, 0.05, 0.2])
def test_rounding_is_measured(step_mm):
    rounded = (np.round(scan().astype(float) / step_mm) * step_mm).astype(np.float32)
    assert signature(rounded).step_mm == pytest.approx(step_mm, rel=0.02)


def test_what_was_not_seen_is_counted():
    cloud = scan()
    cloud[np.random.default_rng(2).random(cloud.shape[:2]) < 0.03] = np.nan
    assert signature(cloud).missing == pytest.approx(0.03, abs=0.006)


def test_points_far_off_and_points_on_a_line_do_no_harm():
    cloud = scan()
    cloud[np.random.default_rng(2).random(cloud.shape[:2]) < 0.01] += np.float32([0, 0, 15])
    assert signature(cloud).noise_mm == pytest.approx(NOISE_MM, rel=0.05)
    line = np.zeros((20, 200, 3), np.float32)
    line[..., 0] = np.linspace(0, 10, 200)
    assert signature_of(list(line), 1.0, image=True).noise_mm < 1e-6


def test_too_few_windows_tell_nothing():
    assert np.isnan(signature_of(windows_of(scan()[:40, :40], everywhere, PITCH_MM), PITCH_MM, image=True).noise_mm)
    assert windows_of(scan(), everywhere, np.inf) == []
    assert windows_of(scan().reshape(-1, 3), lambda points: ~everywhere(points), PITCH_MM) == []
