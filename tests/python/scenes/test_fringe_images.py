"""The virtual scanner: geometry, light and repeatability."""

import cv2
import numpy as np
import pytest

from debulk import InputError, scenes
from debulk.scenes.fringe_light import Texture


@pytest.fixture(scope="module")
def layup():
    return scenes.layup(seed=5, pixels=(64, 48))


@pytest.fixture(scope="module")
def images(layup):
    return scenes.fringe_images(layup, pixels=(320, 240))


def test_the_same_seed_gives_the_same_bits_and_a_repeat_others(layup, images):
    again = scenes.fringe_images(layup, pixels=(320, 240))
    assert np.array_equal(images.left, again.left)
    other = scenes.fringe_images(layup, pixels=(320, 240), repeat=1)
    assert not np.array_equal(images.left, other.left)
    assert np.array_equal(images.truth.points_mm, other.truth.points_mm)
    assert abs(images.left.astype(float) - other.left).mean() < 3


def test_true_points_are_seen_where_the_calibration_says(layup, images):
    """A point's true phases in both raw images agree where the calibration projects it."""
    truth, calibration = images.truth, images.calibration
    rows, columns = np.nonzero(truth.seen)
    pick = np.random.default_rng(0).choice(rows.size, 500, replace=False)
    points = truth.points_mm[rows[pick], columns[pick]].astype(np.float64) @ calibration.rectified.rotation
    values = []
    for k, phase in enumerate((truth.left_phase_rad, truth.right_phase_rad)):
        local = points if k == 0 else points @ calibration.rotation.T + calibration.translation_mm
        pixel = cv2.projectPoints(
            local, np.zeros(3), np.zeros(3), calibration.camera_matrices[k], calibration.distortions[k]
        )[0]
        at = pixel.reshape(-1, 1, 2).astype(np.float32)
        values.append(cv2.remap(phase, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderValue=float("nan")).ravel())
    off = values[0] - values[1]
    assert np.isfinite(off).mean() > 0.9
    assert np.nanmedian(np.abs(off)) < 1e-3


def test_true_points_lie_on_the_ply(layup, images):
    pose = images.mold_from_scanner
    points = images.truth.points_mm.reshape(-1, 3).astype(np.float64) @ pose[:3, :3].T + pose[:3, 3]
    inside = layup._scanner.ply.inside(points[:, 0], points[:, 1])
    height = layup.truth.mold_height(points[:, :2]) + layup.truth.ply_height_above_mold(points[:, :2])
    assert np.abs(points[inside, 2] - height[inside]).max() < 0.01
    bare = scenes.fringe_images(layup, pixels=(320, 240), exposures=(4.0,), bare=True)
    mold = bare.truth.points_mm.reshape(-1, 3).astype(np.float64) @ pose[:3, :3].T + pose[:3, 3]
    assert np.abs(mold[inside, 2] - layup.truth.mold_height(mold[:, :2])[inside]).max() < 0.01


def test_reflectances_spread_widely_and_highlights_move(images):
    """Dark in one exposure, saturated in another, and not the same places in both cameras."""
    longest = images.left[2].max(axis=0)
    shortest = images.left[0].astype(float)
    ply = images.truth.seen[60:180, 60:260]
    assert (longest == 255).mean() > 0.2
    swing = (shortest.max(axis=0) - shortest.min(axis=0))[60:180, 60:260]
    assert (swing[ply] < 12).mean() > 0.1  # too dark in the shortest
    assert (images.left[1].max(axis=0) == 255).mean() > 0.01
    both = [side[1].max(axis=0)[60:180, 60:260].astype(float) for side in (images.left, images.right)]
    assert np.corrcoef(both[0].ravel(), both[1].ravel())[0, 1] < 0.9


def test_the_darkest_stain_reflects_nothing_and_not_less(layup, monkeypatch):
    darkest = Texture(np.tile([0.0, 0.0, np.pi], (16, 1)))  # 5.7 deviations below the mean
    monkeypatch.setattr(Texture, "drawn", lambda rng: darkest)
    dark = scenes.fringe_images(layup, pixels=(160, 120))
    assert np.mean(dark.left[0] <= 1) > 0.2  # and no noise was drawn from less than no light, a warning of NumPy


def test_twelve_bits(layup):
    images = scenes.fringe_images(layup, pixels=(160, 120), exposures=(2.0,), bits=12)
    assert images.left.dtype == np.uint16
    assert 255 < images.left.max() <= 4095


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"bits": 9}, "bits"),
        ({"exposures": ()}, "exposures"),
        ({"exposures": (4, 1)}, "exposures"),
        ({"pixels": (10, 10)}, "pixels"),
    ],
)
def test_bad_arguments_are_named(layup, change, message):
    with pytest.raises(InputError, match=message):
        scenes.fringe_images(layup, **{"pixels": (160, 120), "exposures": (1.0,), **change})
