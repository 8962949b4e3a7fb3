"""A wrinkle that stands already is found in the raw scan and decides; noise, highlights and pockets are none."""

from __future__ import annotations

import numpy as np
import pytest

import laid_ply
from debulk import _core, pocket
from debulk.inspection.rawscan import wrinkles
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
    found = laid_ply.inspector()._wrinkles.find(scan, None).wrinkles
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
    assert laid_ply.inspector()._wrinkles.find(noisy, None).wrinkles == ()


# --- where none can be looked for, and where not all can be found ---


def _says(standing, what, why):
    (entry,) = (one for one in standing.left_out if "wrinkles" in one.what)
    return what in entry.what and why in entry.why and bool(entry.bound)


def test_what_is_no_image_or_too_coarse_is_left_out_with_a_bound():
    search, scan = laid_ply.inspector()._wrinkles, laid_ply.scan(_ridge(3, 8, 200, 0))
    assert search.find(scan, None).wrinkles
    for points, why in (
        (np.ascontiguousarray(scan.reshape(-1, 3)), "no image"),
        (np.ascontiguousarray(scan[::5, ::5]), "apart"),
        (np.full_like(scan, np.nan), "pitch"),
    ):
        standing = search.find(points, None)
        assert _says(standing, "wrinkles that stand already", why)
        assert standing.wrinkles == ()
        assert standing.unknown is None


def test_the_width_that_the_pixels_resolve_is_named_where_it_is_coarse():
    search = laid_ply.inspector()._wrinkles
    coarse = laid_ply.scan(_ridge(3, 8, 200, 0))  # pixels of about 1 mm
    assert _says(search.find(coarse, None), "narrower than 3", "pixels wide")
    assert not any("wrinkles" in entry.what for entry in search.find(0.5 * coarse, None).left_out)


def test_a_scan_that_stands_out_everywhere_is_spoiled_unless_it_does_off_the_ply(monkeypatch):
    monkeypatch.setattr(wrinkles._SEARCH, "most", 2000)
    ridge = _ridge(3, 8, 200, 20)
    scan = laid_ply.scan(ridge)
    rows, columns = np.nonzero(np.isfinite(scan[..., 2]))
    off = np.zeros(scan.shape[:2], dtype=bool)
    off[rows, columns] = ~pocket.inside(laid_ply.layup().ply_outline, _in_mold(scan)[rows, columns, :2])
    wild = np.random.default_rng(2).normal(0, 3, scan.shape[:2]).astype(np.float32)
    around, on_it = scan.copy(), scan.copy()
    around[..., 2] += np.where(off, wild, 0)
    on_it[..., 2] += np.where(off, 0, wild)
    search = laid_ply.inspector()._wrinkles
    assert search.find(around, None).unknown is None
    assert search.find(around, None).wrinkles
    spoiled = search.find(on_it, None)
    assert _says(spoiled, "wrinkles that stand already", "spoiled")
    assert spoiled.unknown.at_best is Verdict.INVALID
    assert "scan again" in spoiled.unknown.reason


def _in_mold(scan):
    pose = laid_ply.layup().mold_from_scanner
    return scan @ pose[:3, :3].T + pose[:3, 3]


def test_the_search_heeds_a_stop_and_a_deadline_leaves_a_doubt():
    search, scan = laid_ply.inspector()._wrinkles, laid_ply.scan(_ridge(3, 8, 200, 0))
    late = _core.Stop()
    late.set_deadline(1e-9)
    standing = search.find(scan, None, late)
    assert standing.unknown.at_best is Verdict.UNDECIDED
    assert _says(standing, "wrinkles that stand already", "deadline")
    cancelled = _core.Stop()
    cancelled.cancel()
    with pytest.raises(_core.Stopped):
        search.find(scan, None, cancelled)


def test_a_report_lists_what_was_not_searched():
    report = laid_ply.inspector().inspect(laid_ply.scan(laid_ply.bell(50, 30, 60, 8)))
    assert any("standing wrinkles narrower than" in entry.what for entry in report.left_out)
