"""Calibration from drawn images of boards, whose cameras are known."""

import json
import pickle
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest

from boards import (
    DISTANCE_MM,
    DISTORTIONS,
    MATRICES,
    PIXELS,
    ROTATION,
    TRANSLATION,
    corner_pairs,
    drawn,
    height_errors,
    places,
    seen,
)
from debulk import InputError
from debulk.scanner import (
    Board,
    Calibration,
    UncertainCalibration,
    calibrate,
    calibration_picture,
)
from debulk.scanner.board_pairs import repeated_images, seen_pairs
from debulk.scanner.board_reason import why_not_found
from debulk.scanner.calibrate import from_pairs
from debulk.scanner.calibration_advice import height_share
from debulk.scanner.certainty import certainty, information
from debulk.scanner.stereo_fit import Cameras, placed

CHECKERBOARD = Board((10, 7), 20.0)
# Drawn as OpenCV drew boards before 4.6; that has to be found out.
BOARDS = {"checkerboard": Board((8, 5), 30.0), "charuco": Board((8, 6), 25.0, "charuco", legacy=True)}


def images(board, where, rng):
    return tuple([drawn(board, place, c, rng) for place in where] for c in (0, 1))


def from_corners(where, board=CHECKERBOARD, noise_px=0.03, seed=0):
    pairs = corner_pairs(board, where, noise_px, np.random.default_rng(seed))
    return from_pairs(pairs, {}, board, board, PIXELS, DISTANCE_MM)


@pytest.fixture(scope="module")
def good():
    return from_corners(places(CHECKERBOARD, 14, np.random.default_rng(1)))


@pytest.mark.slow
@pytest.mark.parametrize("kind", BOARDS)
def test_the_cameras_are_found_from_images(kind):
    board = BOARDS[kind]
    rng = np.random.default_rng(4)
    left, right = images(board, places(board, 9, rng), rng)
    right[6] = np.full_like(right[6], 90)
    try:
        found = calibrate(left, right, Board(board.squares, board.square_mm, kind), distance_mm=DISTANCE_MM)
    except UncertainCalibration as refused:  # too few places of the ChArUco board, whose corners scatter more
        assert kind == "charuco"
        found = refused.calibration
    assert found.spoiling == {
        "7": "the board was not found in the right image, only in the other: the image is flat, with grey values of "
        "90 to 90"
    }
    assert found.error_px < 0.2
    assert len(found.image_errors_px) == 16
    assert found.camera_matrices == pytest.approx(np.stack(MATRICES), abs=6.0)
    assert found.translation_mm == pytest.approx(TRANSLATION, abs=0.5)
    assert np.rad2deg(np.linalg.norm(cv2.Rodrigues(found.rotation @ ROTATION.T)[0])) < 0.2
    certain = found.certainty
    errors, bow = height_errors(found)
    assert np.abs(errors).max() < 4 * certain.worst_height_sd_mm < 1.0
    assert np.sqrt(np.mean(bow**2)) < 4 * certain.flatness_sd_mm < 1.0
    legacy = "the ChArUco board has the layout of OpenCV before 4.6 (legacy)"
    assert found.remarks[:1] == ((legacy,) if kind == "charuco" else found.remarks[:1])
    assert legacy not in found.remarks[1:]


@pytest.mark.slow
def test_standard_deviations_are_those_of_many_calibrations():
    rng = np.random.default_rng(2)
    ratios = []
    for _ in range(12):
        pairs = corner_pairs(CHECKERBOARD, places(CHECKERBOARD, 12, rng), 0.03, rng)
        found = from_pairs(pairs, {}, CHECKERBOARD, CHECKERBOARD, PIXELS, DISTANCE_MM)
        errors, bow = height_errors(found)
        certain = found.certainty
        ratios.append(
            [
                (found.camera_matrices[0, 0, 0] - MATRICES[0][0, 0]) / certain.focal_sd_px[0],
                (found.camera_matrices[1, 0, 0] - MATRICES[1][0, 0]) / certain.focal_sd_px[1],
                (np.linalg.norm(found.translation_mm) - np.linalg.norm(TRANSLATION)) / certain.baseline_sd_mm,
                np.sqrt(np.mean(errors**2)) / certain.height_sd_mm,
                np.abs(errors).max() / certain.worst_height_sd_mm,
                np.sqrt(np.mean(bow**2)) / certain.flatness_sd_mm,
            ]
        )
    scatter = np.sqrt(np.mean(np.square(ratios), axis=0))
    assert (scatter > 1 / 1.5).all() and (scatter < 1.5).all()


@pytest.mark.parametrize(("tilt_deg", "said"), [(0.0, "0 degrees"), (1.0, "1 degree"), (3.0, "3 degrees")])
def test_boards_that_are_hardly_tilted_are_refused_with_advice(tilt_deg, said):
    rng = np.random.default_rng(3)
    with pytest.raises(UncertainCalibration, match=f"tilted by {said} at most: tilt them by 20 to 40") as refused:
        from_corners(places(CHECKERBOARD, 10, rng, tilt_deg), noise_px=0.03)
    assert "more places of the board would do" in str(refused.value)
    found = pickle.loads(pickle.dumps(refused.value)).calibration
    assert height_share(found.certainty)[0] > 0.01 or height_share(found.certainty)[1] > 0.02
    assert str(refused.value).endswith(found.remarks[-1])
    assert max(board.tilt_deg for board in found.boards) == pytest.approx(tilt_deg, abs=1.0)


@pytest.mark.parametrize("said", ["nothing", "nonsense", "one board", "one board eight times"])
def test_what_the_corners_do_not_say_is_a_huge_number(said):
    true = Cameras(MATRICES, DISTORTIONS, ROTATION, TRANSLATION)
    pairs = corner_pairs(CHECKERBOARD, places(CHECKERBOARD, 1, np.random.default_rng(0)), 0.0, np.random.default_rng(0))
    info = information([placed(pairs[0], true)] * (8 if said == "one board eight times" else 1))
    info = {"nothing": np.zeros_like(info), "nonsense": np.full_like(info, np.nan)}.get(said, info)
    found = certainty(true, info, 0.05**2, DISTANCE_MM, PIXELS)
    assert min(found.focal_sd_px) > 50.0
    assert 1.0 < found.height_sd_mm <= found.worst_height_sd_mm <= 1e9


def test_boards_in_the_middle_alone_are_refused_and_the_advice_holds():
    where = places(CHECKERBOARD, 54, np.random.default_rng(5), 30.0)
    middle = [place for k, place in enumerate(where) if k % 9 == 4]
    with pytest.raises(UncertainCalibration, match=r"no board reached most of the upper left, upper middle, .*") as e:
        from_corners(middle, noise_px=0.03)
    more = int(re.search(r"(\d+) more places", str(e.value))[1])
    assert 5 <= more <= 20
    elsewhere = [place for k, place in enumerate(where) if k % 9 != 4]
    found = from_corners(middle + elsewhere[:more], noise_px=0.03)
    assert np.abs(height_errors(found)[0]).max() < 4 * found.certainty.worst_height_sd_mm


def test_pairs_that_spoil_the_fit_are_named():
    rng = np.random.default_rng(1)
    pairs = corner_pairs(CHECKERBOARD, places(CHECKERBOARD, 14, rng), 0.03, rng)
    pairs[3].right[:, 1] += 4.0  # the camera shook
    found = from_pairs(pairs, {"x": "dark"}, CHECKERBOARD, CHECKERBOARD, PIXELS)
    assert set(found.spoiling) == {"x", "4"}
    assert found.spoiling["4"].startswith("error ")
    assert not any(name.endswith(" 4") for name in found.image_errors_px)
    assert len(found.boards) == 13


def test_cameras_that_moved_between_the_pairs_are_refused():
    rng = np.random.default_rng(1)
    pairs = corner_pairs(CHECKERBOARD, places(CHECKERBOARD, 6, rng), 0.03, rng)
    mixed = [replace(pair, right=other.right) for pair, other in zip(pairs, pairs[1:] + pairs[:1], strict=True)]
    with pytest.raises(InputError, match=r"pairs are mixed up|fewer than 5 pairs fit"):
        from_pairs(mixed, {}, CHECKERBOARD, CHECKERBOARD, PIXELS)


def test_a_pair_that_is_given_again_counts_once():
    rng = np.random.default_rng(1)
    where = places(CHECKERBOARD, 1, rng)
    (left,), (right,) = images(CHECKERBOARD, where, rng)
    with pytest.raises(InputError, match=r"found it in 1 of 8; 2, 3, 4, 5, 6, 7 and 1 more: the same images as 1$"):
        calibrate([left] * 8, [right] * 8, CHECKERBOARD)
    (again,), (there,) = images(CHECKERBOARD, where, rng)  # other noise
    pairs, left_out, _ = seen_pairs(["a", "b"], [left, again], [right, there], CHECKERBOARD, 1)
    assert [pair.name for pair in pairs] == ["a"]
    assert left_out == {"b": "the board stands as in a, to 0.5 px"}


@pytest.mark.parametrize(
    ("left", "right", "expected"),
    [
        ("abc", "xyz", {}),
        ("aba", "xyx", {"3": "the same images as 1"}),
        ("aba", "xyz", {name: f"the same left image as {other}, but not the other" for name, other in ("13", "31")}),
        ("abc", "xyx", {name: f"the same right image as {other}, but not the other" for name, other in ("13", "31")}),
        ("abc", "xby", {"2": "the same image for both cameras"}),
    ],
)
def test_images_that_repeat_are_named(left, right, expected):
    sides = [[np.full((2, 2), ord(letter), np.uint8) for letter in side] for side in (left, right)]
    assert repeated_images("123", *sides) == expected


def turned(pairs, board, order):
    """The pairs with every second right image counted in another order."""
    return [replace(pair, right=pair.right[order]) if k % 2 else pair for k, pair in enumerate(pairs)]


@pytest.mark.parametrize(
    ("squares", "turns"), [((10, 7), 1), ((9, 8), 1), ((10, 8), 2), ((9, 7), 2), ((8, 8), 2), ((9, 9), 4)]
)
def test_a_board_that_looks_the_same_when_turned_is_counted_alike(squares, turns):
    board = Board(squares, 16.0)
    assert len(board.turns) == turns
    if turns == 1:
        return
    where = places(board, 12, np.random.default_rng(1))
    pairs = corner_pairs(board, where, 0.03, np.random.default_rng(0))
    found = from_pairs(turned(pairs, board, board.turns[-1]), {}, board, board, PIXELS)
    assert found.translation_mm == pytest.approx(TRANSLATION, abs=0.5)
    assert "in 6 pairs the right camera's corners were counted anew" in found.remarks[0]
    flat = corner_pairs(board, places(board, 12, np.random.default_rng(1), 0.5), 0.03, np.random.default_rng(0))
    with pytest.raises(InputError, match=rf"board: a board of {squares[0]} x {squares[1]} squares looks the same"):
        from_pairs(turned(flat, board, board.turns[-1]), {}, board, board, PIXELS)


def test_opencv_counts_such_boards_from_another_corner_in_each_image():
    """Why the orders have to be sought: without this there would be nothing to mend."""
    board = Board((8, 6), 25.0)
    rng = np.random.default_rng(0)
    turn = cv2.Rodrigues(np.deg2rad([15, -12, 0]))[0] @ cv2.Rodrigues(np.deg2rad([0, 0, 80]))[0]
    place = turn, np.array([45, 0, 480.0]) - turn @ [100, 75, 0]
    orders = []
    for c in (0, 1):
        _, at = board.find(drawn(board, place, c, rng))
        true = seen(board.corners_mm, *place, c)
        off = [np.abs(at - true[order]).max() for order in board.turns]
        assert min(off) < 1.0
        orders.append(int(np.argmin(off)))
    assert orders[0] != orders[1]


def moved(x_mm=0.0, y_mm=0.0):
    turn = cv2.Rodrigues(np.deg2rad([15, -12, 5]))[0]
    return turn, np.array([45 + x_mm, y_mm, 480.0]) - turn @ [100, 70, 0]


REASONS = {
    "cut off at the right": (dict(place=moved(200)), "up to the right edge of the image: it is cut off there"),
    "cut off at the top": (dict(place=moved(0, -150)), "up to the upper edge of the image: it is cut off there"),
    "covered": (dict(cover=True), "it is covered in part, glares, or has other numbers of squares"),
    "blurred": (dict(blur_px=18.0), "the image is blurred: its sharpest edges are"),
    "corners for squares": (dict(board=Board((9, 6), 20.0)), "as a board of 10 x 7 squares has: give its squares"),
    "dark": (dict(factor=0.0), "the image is too dark, with grey values of 0 to 0"),
    "markers wanted": (dict(board=Board((9, 6), 20.0, "charuco")), "no marker of DICT_5X5_250 is seen"),
}


@pytest.mark.parametrize("case", REASONS)
def test_an_image_without_the_board_says_why(case):
    change, message = REASONS[case]
    rng = np.random.default_rng(0)
    image = drawn(CHECKERBOARD, change.get("place", moved()), 0, rng, change.get("blur_px", 0.7))
    image = (image * change.get("factor", 1.0)).astype(np.uint8)
    if "cover" in change:
        image[170:230, 280:350] = 180
    board = change.get("board", CHECKERBOARD)
    assert len(board.find(image)[0]) == 0
    assert message in why_not_found(image, board)


def test_it_survives_its_file_and_old_files_say_what_they_lack(good, tmp_path):
    path = tmp_path / "c.json"
    good.save(path)
    again = Calibration.load(path)
    assert again.certainty == good.certainty
    assert again.text() == good.text()
    assert "have a standard deviation of 0.0" in again.text()
    assert [board.name for board in again.boards] == [board.name for board in good.boards]
    data = json.loads(path.read_text())
    old = {name: value for name, value in data.items() if name not in ("certainty", "boards", "remarks")}
    path.write_text(json.dumps(old))
    again = Calibration.load(path)
    assert again.certainty is None and again.boards == ()
    assert "how certain heights are is not known" in again.text()
    with pytest.raises(InputError, match="does not: calibrate with this version"):
        calibration_picture(again)
    for name, spoilt in (
        ("certainty", {**data["certainty"], "height_sd_mm": None}),
        ("certainty", [1]),
        ("boards", [{**data["boards"][0], "tilt_deg": "steep"}]),
        ("boards", 3),
        ("remarks", "none"),
    ):
        path.write_text(json.dumps({**data, name: spoilt}))
        with pytest.raises(InputError, match=rf"c\.json: {name}: expected"):
            Calibration.load(path)


def test_the_picture_shows_what_was_reached(good):
    picture = calibration_picture(good, 1000)
    assert picture.shape == (326, 1000, 3)
    left = picture[26:, :400].astype(int)
    for x, y, sign in ((200, 150, 1), (50, 150, -1), (3, 150, 0)):  # reached, not reached, not seen by the other camera
        blue, _, red = left[y, x]
        assert np.sign(blue - red) == sign
    outline = good.boards[0].left_px * 400 / PIXELS[0]
    x, y = np.rint(outline[0]).astype(int)
    assert np.abs(left[y - 1 : y + 2, x - 1 : x + 2] - [140, 90, 30]).sum(axis=2).min() < 60


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
    for change, message in (
        ({"board": (10, 7)}, "board: expected a debulk.scanner.Board, but got a tuple"),
        ({"distance_mm": -1.0}, "distance_mm: expected a distance in mm, but got -1.0"),
        ({"distance_mm": "far"}, "distance_mm: expected a number or None, but got 'far'"),
        ({"names": ["a", "a"]}, "names: expected 2 different names, but got 1"),
    ):
        with pytest.raises(InputError, match=re.escape(message)):
            calibrate(**{"left_images": [blank] * 2, "right_images": [blank] * 2, "board": CHECKERBOARD, **change})
    with pytest.raises(InputError, match="dictionary: expected a name"):
        Board((9, 6), 22.0, "charuco", dictionary="DICT_9").image(10)
