"""A wrinkle that stands already is found in the raw scan and decides; noise, highlights and pockets are none."""

from __future__ import annotations

import numpy as np
import pytest

import laid_ply
from debulk.verdict import Verdict


def _ridge(wide_mm, high_mm, long_mm, turned_deg):
    """Return a wrinkle of one height with its middle at (50, 30) mm, a square of a cosine across."""
    turn = np.radians(turned_deg)

    def height(x, y):
        along = np.cos(turn) * (x - 50) + np.sin(turn) * (y - 30)
        across = np.cos(turn) * (y - 30) - np.sin(turn) * (x - 50)
        profile = high_mm * np.cos(np.pi * np.clip(across / wide_mm, -0.5, 0.5)) ** 2
        return np.where(np.abs(along) < long_mm / 2, profile, 0.0)

    return height


@pytest.mark.parametrize("turned_deg", [0, 30, 45, 90, 140])
@pytest.mark.parametrize(("wide_mm", "high_mm"), [(3, 8), (6, 3)])
def test_a_wrinkle_is_found_with_its_place_and_height(wide_mm, high_mm, turned_deg):
    scan = laid_ply.scan(_ridge(wide_mm, high_mm, 200, turned_deg), noise_mm=0.05)
    found = laid_ply.inspector()._wrinkles.find(scan, None)
    assert found
    turn = np.radians(turned_deg)
    for wrinkle in found:
        ends = np.array([wrinkle.start_mm, wrinkle.end_mm]) - (50, 30)
        across = np.cos(turn) * ends[:, 1] - np.sin(turn) * ends[:, 0]
        along = np.cos(turn) * ends[:, 0] + np.sin(turn) * ends[:, 1]
        assert np.abs(across).max() < 3
        assert np.abs(along).max() < 103
    assert sum(wrinkle.length_mm for wrinkle in found) > 120
    # Pixels of 1 mm do not all meet the crest, and what they show of it is never higher.
    assert 0.5 * high_mm < found[0].height_mm < high_mm + 0.5


@pytest.mark.parametrize("regions", [True, False], ids=["regions", "whole scan"])
def test_a_wrinkle_of_3_by_8_mm_decides(regions):
    report = laid_ply.inspector(regions).inspect(laid_ply.scan(_ridge(3, 8, 200, 0), noise_mm=0.05))
    assert report.verdict is Verdict.CREASE
    assert "a wrinkle stands already" in report.reason
    assert report.wrinkles


def test_noise_flying_pixels_highlights_and_pockets_are_no_wrinkles():
    rng = np.random.default_rng(5)
    pockets = laid_ply.bell(50, 30, 60, 8), laid_ply.bell(-200, -100, 200, 8, 30)
    scan = laid_ply.scan(lambda x, y: pockets[0](x, y) + pockets[1](x, y), noise_mm=0.15)
    depth = np.linalg.norm(scan, axis=2, keepdims=True)
    off = np.where(rng.random(depth.shape) < 0.02, rng.normal(0, 6, depth.shape), 0)
    rows, columns = np.mgrid[: scan.shape[0], : scan.shape[1]]
    for _ in range(20):  # streaks in which every depth is wild
        turn, row, column = rng.uniform(0, np.pi), rng.uniform(200, 760), rng.uniform(200, 1080)
        along = np.cos(turn) * (columns - column) + np.sin(turn) * (rows - row)
        across = np.cos(turn) * (rows - row) - np.sin(turn) * (columns - column)
        streak = (np.abs(along) < 40) & (np.abs(across) < rng.uniform(1, 4))
        off = np.where(streak[..., None], rng.normal(0, 5, depth.shape), off)
    noisy = (scan * (1 + off / depth)).astype(np.float32)
    assert laid_ply.inspector()._wrinkles.find(noisy, None) == ()


def test_beside_the_reference_nothing_is_known():
    """Points half a spacing outside its grid, as a scan that is larger than the reference has them."""
    search = laid_ply.inspector()._wrinkles
    grid = search._seen
    low = np.asarray(grid.origin_mm)
    high = low + grid.spacing_mm * (np.array(grid.values.shape)[::-1] - 1)
    outside = np.array([[*(low - 0.4 * grid.spacing_mm), 5.0], [*(high + 0.4 * grid.spacing_mm), 5.0]])
    assert np.isnan(search._above(outside)).all()
    assert np.isfinite(search._above(np.array([[*(0.5 * (low + high)), 5.0]]))).all()
