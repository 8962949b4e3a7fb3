"""Calibration from drawn images of boards, whose cameras are known."""

import json

import cv2
import numpy as np
import pytest

from boards import DISTANCE_MM, MATRICES, PIXELS, ROTATION, TRANSLATION, corner_pairs, drawn, height_errors, places
from debulk import InputError
from debulk.scanner import (
    Board,
    Calibration,
    UncertainCalibration,
    calibrate,
    calibration_picture,
)
from debulk.scanner.board_pairs import seen_pairs
from debulk.scanner.board_reason import why_not_found
from debulk.scanner.calibrate import from_pairs

CHECKERBOARD = Board((10, 7), 20.0)
# Drawn as OpenCV drew boards before 4.6; that has to be found out.
BOARDS = {"checkerboard": CHECKERBOARD, "charuco": Board((8, 6), 25.0, "charuco", legacy=True)}


@pytest.fixture(scope="module", params=BOARDS)
def pairs(request):
    board = BOARDS[request.param]
    rng = np.random.default_rng(4)
    where = places(board, 10, rng)
    left, right = ([drawn(board, place, c, rng) for place in where] for c in (0, 1))
    return Board(board.squares, board.square_mm, board.kind), left, right


def from_corners(where, board=CHECKERBOARD, noise_px=0.1, seed=0, more=()):
    pairs = corner_pairs(board, where, noise_px, np.random.default_rng(seed))
    return from_pairs([*pairs, *more], {}, board, board, PIXELS, DISTANCE_MM)


@pytest.fixture(scope="module")
def good():
    return from_corners(places(CHECKERBOARD, 14, np.random.default_rng(1)), noise_px=0.03)


def test_the_cameras_are_found_from_images(pairs):
    board, left, right = pairs
    found = calibrate(left, right, board, distance_mm=DISTANCE_MM)
    print(found.text(), found.certainty, np.abs(height_errors(found)[0]).max())
    assert found.error_px < 0.15
