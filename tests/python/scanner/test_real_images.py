"""Real images: 8 steps of 40 and 41 periods, two rectified cameras, no calibration."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from debulk.scanner import decode, match

FOLDER = Path(__file__).resolve().parents[4] / "shared" / "data" / "two_frequency_fringes"
pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="the captures are not on this machine")


@pytest.fixture(scope="module")
def phases():
    def camera(c):
        first = [FOLDER / f"frames{c}_{i}.png" for i in range(2, 10)]
        second = [FOLDER / f"secondary_cam{c + 1}" / f"frames{c}_{i}.png" for i in range(10, 18)]
        return [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in (*first, *second)]

    return [decode(camera(c), (40, 41), 8) for c in (0, 1)]


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
