"""`debulk scan calibrate`: which images are paired, and what is written."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from boards import PIXELS, corner_pairs, places
from debulk import InputError, scanner
from debulk.cli import app
from debulk.cli.pairing import paired
from debulk.scanner.calibrate import from_pairs

BOARD = scanner.Board((10, 7), 20.0)


def paths(folder, names):
    return [Path(folder) / name for name in names.split()]


@pytest.mark.parametrize(
    ("left", "right", "expected"),
    [
        ("left_01.png left_02.png", "right_1.png right_2.png", [(0, 0), (1, 1)]),
        ("cam0_9.png cam0_10.png", "cam1_10.png cam1_9.png", [(0, 1), (1, 0)]),
        (
            "2026-11-25_08-15.png 2026-11-25_08-16.png",
            "R_2026-11-25_08-16.png R_2026-11-25_08-15.png",
            [(0, 1), (1, 0)],
        ),
        ("near.png far.png", "far.png near.png", [(0, 1), (1, 0)]),
        ("1.png 2.png 3.png", "2.png 3.png 4.png", [(1, 0), (2, 1)]),
    ],
)
def test_images_are_paired_by_their_numbers(left, right, expected):
    lefts, rights = paths("l", left), paths("r", right)
    pairs, alone = paired(lefts, rights)
    assert pairs == [(lefts[a], rights[b]) for a, b in expected]
    assert len(alone) == len(lefts) + len(rights) - 2 * len(pairs)


@pytest.mark.parametrize(
    ("left", "right", "message"),
    [
        (
            "a1.png b1.png b2.png",
            "1.png 2.png",
            r"l: expected images of different numbers, but got a1\.png and b1\.png",
        ),
        (
            "near.png far.png",
            "one.png two.png",
            r"l, r: expected images that can be paired .* got near\.png and one\.png",
        ),
    ],
)
def test_what_cannot_be_paired_is_refused(left, right, message):
    with pytest.raises(InputError, match=message):
        paired(paths("l", left), paths("r", right))


@pytest.fixture
def folders(tmp_path):
    """Images whose grey value is their number; two have no partner, and hidden files lie about."""
    for side, numbers in (("left", (1, 2, 3, 5, 10)), ("right", (1, 2, 3, 4, 10))):
        (tmp_path / side / ".thumbnails").mkdir(parents=True)
        for number in numbers:
            cv2.imwrite(str(tmp_path / side / f"{side}{number}.png"), np.full((8, 8), number, np.uint8))
        (tmp_path / side / f"._{side}2.png").write_bytes(b"of another system")
    return tmp_path


def run(folders, *more):
    words = ["scan", "calibrate", folders / "left", folders / "right", "-o", folders / "c.json", "--squares", "10x7"]
    done = CliRunner().invoke(app, [str(word) for word in (*words, "--square-mm", "20", *more)])
    return done.exit_code, done.output


@pytest.mark.parametrize("tilt_deg", [25.0, 1.0])
def test_what_was_found_is_said_and_drawn_even_if_it_is_refused(folders, monkeypatch, tilt_deg):
    rng = np.random.default_rng(1)

    def calibrate(left, right, board, *, names, distance_mm):
        assert [int(image[0, 0]) for image in left] == [int(image[0, 0]) for image in right] == [1, 2, 3, 10]
        assert names == ["left1.png", "left2.png", "left3.png", "left10.png"]
        assert (board, distance_mm) == (BOARD, 480.0)
        return from_pairs(corner_pairs(BOARD, places(BOARD, 12, rng, tilt_deg), 0.03, rng), {}, BOARD, BOARD, PIXELS)

    monkeypatch.setattr(scanner, "calibrate", calibrate)
    code, output = run(folders, "--picture", folders / "boards.png", "--distance-mm", "480")
    assert "left out: left5.png: the right camera has no image 5" in output
    assert "left out: right4.png: the left camera has no image 4" in output
    assert cv2.imread(str(folders / "boards.png")).shape[1] == 1400
    refused = tilt_deg < 2
    assert code == (2 if refused else 0), output
    assert (folders / "c.json").exists() == (not refused)
    assert ("tilt them by 20 to 40 degrees" if refused else "have a standard deviation of 0.0") in output


def test_a_picture_needs_its_ending(folders):
    code, output = run(folders, "--picture", folders / "boards.jpg")
    assert code == 2
    assert "expected a file ending in .png" in output
