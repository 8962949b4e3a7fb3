"""Real images: 8 steps of 40 and 41 periods, two rectified cameras, no calibration."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from debulk.scanner import Calibration, Scanner, decode, match

FOLDER = Path(__file__).resolve().parents[4] / "shared" / "data" / "two_frequency_fringes"
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="the captures are not on this machine")


@pytest.fixture(scope="module")
def images():
    def camera(c):
        first = [FOLDER / f"frames{c}_{i}.png" for i in range(2, 10)]
        second = [FOLDER / f"secondary_cam{c + 1}" / f"frames{c}_{i}.png" for i in range(10, 18)]
        return [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in (*first, *second)]

    return camera(0), camera(1)


@pytest.fixture(scope="module")
def phases(images):
    return [decode(one, (40, 41), 8) for one in images]


def test_images_that_arrive_give_the_bits_of_a_scan(images):
    height, width = images[0][0].shape
    matrix = [[1800.0, 0, (width - 1) / 2], [0, 1800.0, (height - 1) / 2], [0, 0, 1]]  # its depths have no unit
    lenses = Calibration([matrix, matrix], np.zeros((2, 5)), np.eye(3), (-200.0, 0, 0), (width, height))
    scanner = Scanner(lenses, (40, 41), 8)
    scan, arriving = scanner.scan(*images), scanner.arriving()
    for left, right in zip(*images, strict=True):
        arriving.add(left, right)
    found = arriving.cloud()
    assert found.counts["matched"] > 160_000
    assert found.points_mm.tobytes() == scan.points_mm.tobytes()
    assert found.uncertainty_mm.tobytes() == scan.uncertainty_mm.tobytes()


def test_orders_are_whole(phases):
    for phase in phases:
        residual = phase.order_residual[np.isfinite(phase.order_residual)]
        assert residual.size >= 175_000
        assert (residual < 0.4).mean() >= 0.994
        assert np.median(residual) < 0.09


def test_the_cameras_match(phases):
    disparity, sigma = match(*phases)
    assert np.isfinite(disparity).sum() >= 160_000
    low, high = np.nanpercentile(disparity, [0.5, 99.5])
    assert 370 < low < high < 470
    # Noise along the rows: what second differences leave, their median and without a tenth at folds and edges.
    bend = disparity[:, 2:] - 2 * disparity[:, 1:-1] + disparity[:, :-2]
    bend = np.sort(np.abs(bend[np.isfinite(bend)]))
    noise = np.sqrt(np.mean(bend[: int(0.9 * bend.size)] ** 2) / 6)
    assert 1.4826 * np.median(bend) / np.sqrt(6) < 0.08
    assert noise < 0.08
    assert np.nanmedian(sigma) < 0.08


def test_the_disparity_is_a_surface(phases):
    disparity, _ = match(*phases)
    known = np.isfinite(disparity)
    filled = cv2.medianBlur(np.where(known, disparity, 0).astype(np.float32), 5)
    off = np.abs(disparity - filled)[known & (filled > 0)]
    assert (off > 2).mean() < 0.01
