"""Calibration from drawn images of boards, whose cameras are known."""

import cv2
import numpy as np
import pytest

from debulk import InputError
from debulk.scanner import Board, Calibration, calibrate

PIXELS = 800, 600
MATRICES = [
    np.array([[900.0, 0, 405], [0, 902, 296], [0, 0, 1]]),
    np.array([[905.0, 0, 398], [0, 904, 303], [0, 0, 1]]),
]
DISTORTIONS = [np.array([-0.1, 0.05, 3e-4, -2e-4, 0.0]), np.array([-0.08, 0.03, -2e-4, 1e-4, 0.0])]
ROTATION = cv2.Rodrigues(np.array([0.01, 0.12, 0.005]))[0]
TRANSLATION = np.array([-120.0, 1.5, 8.0])
BOARDS = {"checkerboard": Board((10, 7), 20.0), "charuco": Board((9, 6), 22.0, "charuco")}


def drawn(board, turn, move, k, noise_rng):
    """What camera k sees of a board whose corner stands at `move` in the left camera's frame, mm."""
    scale = 28
    texture = board.image(scale)
    column, row = np.meshgrid(np.arange(PIXELS[0], dtype=float), np.arange(PIXELS[1], dtype=float))
    pixels = np.stack([column.ravel(), row.ravel()], 1)[:, None]
    rays = np.pad(
        cv2.undistortPoints(pixels, MATRICES[k], DISTORTIONS[k]).reshape(-1, 2), ((0, 0), (0, 1)), constant_values=1
    )
    axes, origin = (turn, move) if k == 0 else (ROTATION @ turn, ROTATION @ move + TRANSLATION)
    place = np.linalg.solve(np.column_stack([axes[:, 0], axes[:, 1], origin]), rays.T)
    xy = place[:2] / place[2]
    u, v = (xy / board.square_mm + 1) * scale - 0.5  # the margin is a square wide
    at = [values.reshape(column.shape).astype(np.float32) for values in (u, v)]
    image = cv2.remap(texture, *at, cv2.INTER_LINEAR, borderValue=128)
    soft = cv2.GaussianBlur(image, (0, 0), 0.7) * 0.8 + 20
    return np.clip(soft + noise_rng.normal(0, 1.0, soft.shape), 0, 255).astype(np.uint8)


@pytest.fixture(scope="module", params=BOARDS)
def pairs(request):
    board = BOARDS[request.param]
    rng = np.random.default_rng(4)
    middle = board.square_mm * np.array([*board.squares, 0]) / 2
    left, right = [], []
    for k in range(10):
        turn = cv2.Rodrigues(np.deg2rad([25 * np.cos(2.4 * k), 25 * np.sin(2.4 * k), rng.uniform(-8, 8)]))[0]
        centre = np.array([rng.uniform(0, 100), rng.uniform(-50, 50), rng.uniform(420, 560)])
        for c, images in enumerate((left, right)):
            images.append(drawn(board, turn, centre - turn @ middle, c, rng))
    return board, left, right


def test_the_cameras_are_found(pairs):
    board, left, right = pairs
    found = calibrate(left, right, board)
    assert found.error_px < (0.15 if board.kind == "checkerboard" else 0.35)
    assert len(found.image_errors_px) == 2 * (10 - len(found.spoiling))
    assert len(found.spoiling) <= 2
    assert found.camera_matrices == pytest.approx(np.stack(MATRICES), abs=6.0)
    assert found.translation_mm == pytest.approx(TRANSLATION, abs=1.0)
    assert np.rad2deg(np.linalg.norm(cv2.Rodrigues(found.rotation @ ROTATION.T)[0])) < 0.3
    # What counts: a point between the cameras is measured where it is.
    true = Calibration(MATRICES, DISTORTIONS, ROTATION, TRANSLATION, PIXELS)
    point = np.array([[20.0, 10.0, 480.0]])
    left_pixel, right_pixel = (
        cv2.projectPoints(point, cv2.Rodrigues(turn)[0], move, true.camera_matrices[k], true.distortions[k])[0].reshape(
            1, 1, 2
        )
        for k, (turn, move) in enumerate(((np.eye(3), np.zeros(3)), (true.rotation, true.translation_mm)))
    )
    seen = [
        cv2.undistortPoints(p, found.camera_matrices[k], found.distortions[k]).reshape(2, 1)
        for k, p in enumerate((left_pixel, right_pixel))
    ]
    first, second = np.eye(3, 4), np.column_stack([found.rotation, found.translation_mm])
    x = cv2.triangulatePoints(first, second, *seen).ravel()
    assert x[:3] / x[3] == pytest.approx(point[0], abs=1.0 if board.kind == "checkerboard" else 5.0)


def test_pairs_that_spoil_the_fit_are_named(pairs):
    board, left, right = pairs
    right = list(right)
    right[3] = np.roll(right[3], 4, axis=0)  # the camera shook
    right[6] = np.full_like(right[6], 90)
    found = calibrate(left, right, board, names=[f"pair{k}" for k in range(10)])
    assert found.spoiling["pair3"].startswith("error ")
    assert found.spoiling["pair6"] == "the board was not found in the right image"
    assert not any("pair3" in name for name in found.image_errors_px)


def test_cameras_that_moved_between_the_pairs_are_refused(pairs):
    board, left, right = pairs
    mixed = right[1:] + right[:1]
    with pytest.raises(InputError, match=r"pairs are mixed up|fewer than 5 pairs fit"):
        calibrate(left, mixed, board)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (((3, 7), 20.0), "squares: expected a whole number of 4"),
        (((10, 7), 0.0), "square_mm"),
        (((10, 7), 20.0, "dots"), "kind: expected one of"),
        (((10, 7), 20.0, "charuco", 30.0), "marker_mm: expected less"),
    ],
)
def test_bad_boards_are_named(arguments, message):
    with pytest.raises(InputError, match=message):
        Board(*arguments)


def test_bad_images_are_named():
    blank = np.zeros((100, 100), np.uint8)
    with pytest.raises(InputError, match="expected 2 images like the left"):
        calibrate([blank] * 2, [blank], BOARDS["checkerboard"])
    with pytest.raises(InputError, match="right_images, image 1: expected"):
        calibrate([blank], [blank.astype(float)], BOARDS["checkerboard"])
    with pytest.raises(InputError, match="dictionary: expected a name"):
        Board((9, 6), 22.0, "charuco", dictionary="DICT_9").image(10)
