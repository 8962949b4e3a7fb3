"""Faults of images and of the set-up: each planted, each named, and no cloud."""

import cv2
import numpy as np
import pytest

from debulk import InputError
from debulk.scanner import Calibration, Scanner, decode


def exchanged(i, j):
    def spoil(images, rng):
        images[[i, j]] = images[[j, i]]

    return spoil


def repeated(k):
    def spoil(images, rng):  # taken twice: the same pattern, other noise
        again = images[k - 1].astype(float) + rng.normal(0, 1, images[k].shape)
        images[k] = np.clip(np.rint(again), 0, 254)

    return spoil


def exposed(k, factor):
    def spoil(images, rng):
        images[k] = np.clip(np.rint(images[k] * factor), 0, 255)

    return spoil


def flicker(share):
    def spoil(images, rng):
        for image in images:
            image[:] = np.clip(np.rint(image * (1 - share * rng.random())), 0, 255)

    return spoil


def dark(k):
    def spoil(images, rng):
        images[k] = rng.integers(0, 4, images[k].shape)

    return spoil


def rolled(images, rng):
    images[:] = np.roll(images, 1, axis=0)


FAULTS = [
    (exchanged(2, 3), "images 3 and 4 are exchanged"),
    (exchanged(0, 5), "images 1 and 6 are exchanged"),
    (exchanged(1, 9), "images 2 and 10 are exchanged"),
    (exchanged(10, 11), "images 11 and 12 are exchanged"),
    (repeated(3), "images 3 and 4 show the same pattern"),
    (repeated(8), "images 8 and 9 show the same pattern"),
    (exposed(4, 0.95), "image 5 is differently exposed: 0.9"),
    (exposed(7, 0.7), "image 8 is differently exposed"),
    (flicker(0.06), "the light flickers"),
    (dark(6), "image 7 is dark"),
    (rolled, "begin with the last pattern"),
]


@pytest.mark.parametrize("gamma", [1.0, 2.2])
@pytest.mark.parametrize(("spoil", "message"), FAULTS)
def test_a_spoilt_image_is_named(formula, spoil, message, gamma):
    images = formula(gamma=gamma)
    decode(images)  # fine before
    spoil(images, np.random.default_rng(5))
    with pytest.raises(InputError, match=message):
        decode(images)


@pytest.mark.parametrize("exposure", [1, 2])
def test_a_fault_in_one_exposure_is_named_with_it(fringes, exposure):
    images = fringes.left.copy()
    images[exposure, [2, 3]] = images[exposure, [3, 2]]
    with pytest.raises(InputError, match=f"left_images: images 3 and 4 of exposure {exposure + 1} are exchanged"):
        Scanner(fringes.calibration).scan(images, fringes.right)


def test_exposures_in_the_wrong_order_are_named(fringes):
    with pytest.raises(
        InputError, match="right_images: expected the shortest exposure first, but exposure 2 is darker"
    ):
        Scanner(fringes.calibration).scan(fringes.left, fringes.right[::-1])


def test_a_wrong_number_of_steps_is_refused(formula):
    with pytest.raises(InputError, match=r"expected 10 images .* got 12"):
        decode(formula(), (50, 51), 5)
    with pytest.raises(InputError, match=r"do not follow the fringes of 4 steps|flickers"):
        decode(formula(), (50, 51, 52), 4)  # as many images by chance
    with pytest.raises(InputError, match="do not follow the fringes of 6 steps"):
        decode(formula((47, 48)), (50, 51), 6)


def test_exchanged_cameras_are_named(fringes):
    with pytest.raises(InputError, match="the two cameras' images are exchanged"):
        Scanner(fringes.calibration).scan(fringes.right, fringes.left)


@pytest.mark.parametrize(("axis", "degrees"), [(0, 0.1), (0, -0.5), (2, 0.3), (0, 3.0)])
def test_a_moved_camera_is_named(fringes, scanned, axis, degrees):
    assert scanned[0].epipolar.error_px < 0.4
    assert scanned[0].epipolar.patches >= 20
    turn = cv2.Rodrigues(np.deg2rad(degrees) * np.eye(3)[axis])[0]
    old = fringes.calibration
    moved = Calibration(
        old.camera_matrices, old.distortions, turn @ old.rotation, turn @ old.translation_mm, old.pixels
    )
    with pytest.raises(InputError, match="a camera was moved"):
        Scanner(moved).scan(fringes.left, fringes.right)


def test_another_scene_in_the_right_camera_is_refused(fringes, formula):
    wall = np.kron(formula(), np.ones((1, 8, 1), np.uint8))
    with pytest.raises(InputError, match="left, right: "):
        Scanner(fringes.calibration).scan(fringes.left, np.stack([wall // 8, wall // 4, wall]))
