"""Registration: by markers, and by the mold's shape."""

import importlib.util

import cv2
import numpy as np
import pytest

from debulk import InputError, scenes
from debulk.scanner import register


@pytest.fixture
def markers():
    rng = np.random.default_rng(2)
    turn, _ = cv2.Rodrigues(np.array([2.7, 0.4, 0.2]))
    motion = np.vstack([np.c_[turn, [120.0, -60.0, 2400.0]], [0, 0, 0, 1]])
    measured = rng.uniform([-500, -400, 2300], [500, 400, 2450], (6, 3))
    return measured, measured @ motion[:3, :3].T + motion[:3, 3], motion


def test_markers_give_the_motion(markers):
    measured, wanted, motion = markers
    found = register(markers_mm=(measured, wanted + np.random.default_rng(0).normal(0, 0.05, wanted.shape)))
    assert found.mold_from_scanner == pytest.approx(motion, abs=0.15)
    assert found.mold_from_scanner[:3, :3] == pytest.approx(motion[:3, :3], abs=3e-4)
    assert 0.02 < found.rms_mm < 0.12
    assert found.residuals_mm.shape == (6,)
    assert np.linalg.det(found.mold_from_scanner[:3, :3]) == pytest.approx(1)


def test_a_wrong_marker_is_named(markers):
    measured, wanted, _ = markers
    wanted = wanted.copy()
    wanted[3] += [0, 8, 0]
    with pytest.raises(InputError, match=r"miss by \d.\d\d mm; without marker 4 it would be 0.00 mm"):
        register(markers_mm=(measured, wanted))


def test_bad_markers_are_named(markers):
    measured, wanted, _ = markers
    line = np.outer(np.arange(5.0), [1, 2, 3])
    for given, message in (
        ((measured[:2], wanted[:2]), "at least 3 markers"),
        ((measured, wanted[:5]), "as many markers"),
        ((line, line), "off one line"),
        ((measured, np.where(np.arange(6)[:, None] == 2, np.nan, wanted)), r"markers_mm\[1\].*marker 3"),
        ((measured[:, :2], wanted), "shape \\(N, 3\\)"),
    ):
        with pytest.raises(InputError, match=message):
            register(markers_mm=given)
    with pytest.raises(InputError, match="expected one of both"):
        register()
    with pytest.raises(InputError, match="scan: expected"):
        register(mold=wanted)


@pytest.mark.skipif(importlib.util.find_spec("open3d") is not None, reason="Open3D is here")
def test_without_open3d_the_remedy_is_named(markers):
    with pytest.raises(InputError, match="needs Open3D: pip install"):
        register(markers[0], mold=markers[1])


@pytest.mark.skipif(importlib.util.find_spec("open3d") is None, reason="Open3D, the extra view, is not installed")
@pytest.mark.parametrize(("move_mm", "turn_deg"), [((8, -6, 5), 0.0), ((-20, 15, -12), 1.5)])
def test_the_molds_shape_gives_the_motion(move_mm, turn_deg):
    scene = scenes.layup(seed=0, pixels=(640, 480), flying_share=0, dropout_share=0)
    x, y = np.meshgrid(np.arange(-600, 601, 3.0), np.arange(-450, 451, 3.0))
    mold = np.dstack([x, y, scene.truth.mold_height(np.dstack([x, y]))])
    off = np.eye(4)
    off[:3, :3] = cv2.Rodrigues(np.deg2rad(turn_deg) * np.array([0.5, 0.3, 0.8]))[0]
    off[:3, 3] = move_mm
    found = register(scene.reference, mold=mold, start=off @ scene.mold_from_scanner)
    there = [scene.reference.reshape(-1, 3) @ pose[:3, :3].T + pose[:3, 3]
             for pose in (found.mold_from_scanner, scene.mold_from_scanner)]  # fmt: skip
    assert np.nanmax(np.linalg.norm(there[0] - there[1], axis=1)) < 0.5
    assert found.rms_mm < 0.2


@pytest.mark.skipif(importlib.util.find_spec("open3d") is None, reason="Open3D, the extra view, is not installed")
def test_a_scan_that_does_not_fit_the_mold_is_refused():
    scene = scenes.layup(seed=0, pixels=(640, 480), flying_share=0, dropout_share=0)
    x, y = np.meshgrid(np.arange(-600, 601, 3.0), np.arange(-450, 451, 3.0))
    mold = np.dstack([x, y, scene.truth.mold_height(np.dstack([x, y]))])
    with pytest.raises(InputError, match="mold: expected a scan that covers"):
        register(scene.reference, mold=mold)  # 2.4 m away
    mold[..., 2] += 5 * np.sin(x / 60)
    with pytest.raises(InputError, match="mold: expected a scan that"):
        register(scene.reference, mold=mold, start=scene.mold_from_scanner)
