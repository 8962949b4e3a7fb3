"""Hold what a calibration says about itself against virtual cameras that are known; writes calibration*.txt.

.venv/bin/python bench/scanner/calibration.py [--sets 15] [--part scatter]
"""

import argparse
import re
import sys
from pathlib import Path

import cv2
import numpy as np

from debulk import InputError
from debulk.scanner import Board, UncertainCalibration, calibrate
from debulk.scanner.calibrate import from_pairs
from debulk.scanner.calibration_advice import height_share

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "tests" / "python"))
from boards import DISTANCE_MM, MATRICES, NINTHS, PIXELS, TRANSLATION, corner_pairs, drawn, height_errors, places  # noqa: E402

BOARD = Board((10, 7), 20.0)


def ratios(found):
    """Errors over their standard deviations: focal lengths, baseline, heights, the worst height, flatness."""
    errors, bow = height_errors(found)
    certain = found.certainty
    return (
        (found.camera_matrices[0, 0, 0] - MATRICES[0][0, 0]) / certain.focal_sd_px[0],
        (found.camera_matrices[1, 0, 0] - MATRICES[1][0, 0]) / certain.focal_sd_px[1],
        (np.linalg.norm(found.translation_mm) - np.linalg.norm(TRANSLATION)) / certain.baseline_sd_mm,
        np.sqrt(np.mean(errors**2)) / certain.height_sd_mm,
        np.abs(errors).max() / certain.worst_height_sd_mm,
        np.sqrt(np.mean(bow**2)) / certain.flatness_sd_mm,
    )


def found_in(pairs):
    try:
        return from_pairs(pairs, {}, BOARD, BOARD, PIXELS, DISTANCE_MM), ""
    except UncertainCalibration as refused:
        return refused.calibration, str(refused)


def of_images(board, count, rng):
    where = places(board, count, rng)
    left, right = ([drawn(board, place, c, rng) for place in where] for c in (0, 1))
    try:
        return calibrate(left, right, board, distance_mm=DISTANCE_MM)
    except UncertainCalibration as refused:
        return refused.calibration


def line(rows):
    scatter = np.sqrt(np.mean(np.square(rows), axis=0))
    return "  ".join(f"{value:.2f}" for value in scatter)


def middle(turn):
    return turn @ (BOARD.square_mm * np.array([*BOARD.squares, 0]) / 2)


def design(kind, rng):
    """Places of the board as somebody in a hurry might choose them."""
    count = int(rng.integers(5, 20))
    if kind == "hardly tilted":
        return places(BOARD, count, rng, rng.choice([0.0, 0.3, 0.6, 1.0]))
    where = places(BOARD, count, rng)
    if kind == "one corner only":
        return [place for k, place in enumerate(places(BOARD, 9 * count, rng)) if k % 9 == 0]
    if kind == "tilted about one axis":
        axis = np.array([1.0, 0, 0])
        turns = [cv2.Rodrigues(np.deg2rad(rng.uniform(-35, 35)) * axis)[0] for _ in where]
        return [(turn, move + middle(old) - middle(turn)) for turn, (old, move) in zip(turns, where, strict=True)]
    if kind == "shifted only":
        return [(where[4][0], where[4][1] + rng.uniform(-25, 25, 3)) for _ in where]
    if kind == "held still by hand":
        turn, move = where[4]
        return [(turn @ cv2.Rodrigues(rng.normal(0, 0.01, 3))[0], move + rng.normal(0, 2, 3)) for _ in where]
    return where


def as_advised(told, rng):
    """Add places as the message asks: the number, first where no board was, tilted by 20 to 40 degrees."""
    count = int(re.search(r"(\d+) more place", told)[1])
    names = ("upper left", "lower right", "upper right", "lower left", "middle", "left", "right", "lower middle",
             "upper middle")  # fmt: skip
    missing = re.search(r"no board reached most of the (.*) of the left image", told)
    named = re.split(r", | and ", missing[1]) if missing else []
    cells = [k for k, name in enumerate(names) if name in named] or list(range(len(NINTHS)))
    many = places(BOARD, 9 * (count + 1), rng, 35.0)
    return [many[9 * k + cells[k % len(cells)]] for k in range(count)]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=15)
    parser.add_argument("--part", choices=["scatter", "advice"])
    asked = parser.parse_args()
    for part, study, name in (("scatter", scatter, "calibration.txt"), ("advice", hurried, "calibration_advice.txt")):
        if asked.part in (None, part):
            text = "\n".join(study(asked.sets, np.random.default_rng(0))) + "\n"
            print(text)
            (HERE / name).write_text(text)


def scatter(sets, rng):
    """Errors against the standard deviations that are stated."""
    lines = [
        f"Virtual cameras of {PIXELS[0]} x {PIXELS[1]} pixels, 120 mm apart, {DISTANCE_MM:.0f} mm away.",
        "",
        "Errors over the stated standard deviations, root mean square (wanted: 0.67 to 1.5):",
        "left and right focal length, baseline, heights, worst height, flatness",
    ]
    for count, noise in ((8, 0.03), (12, 0.03), (12, 0.1), (20, 0.05)):
        rows = [ratios(found_in(corner_pairs(BOARD, places(BOARD, count, rng), noise, rng))[0]) for _ in range(sets)]
        lines.append(f"  {sets} x {count} boards, corners with noise of {noise:g} px: {line(rows)}")
    for board in (Board((8, 5), 30.0), Board((8, 6), 25.0, "charuco")):
        rows = [ratios(of_images(board, 10, rng)) for _ in range(max(2, sets // 2))]
        lines.append(f"  {len(rows)} x 10 drawn images of a {board.kind}: {line(rows)}")
    return lines


def hurried(sets, rng):
    """Which boards are accepted, and whether following the advice helps."""
    lines = ["Boards as somebody in a hurry holds them, 5 to 19 of them, noise of 0.03 to 0.1 px:"]
    followed, worst = [], 0.0
    for kind in ("hardly tilted", "one corner only", "tilted about one axis", "shifted only", "held still by hand",
                 "as wanted"):  # fmt: skip
        accepted, shares, refused = 0, [], 0
        for _ in range(sets):
            noise = rng.choice([0.03, 0.05, 0.1])
            where = design(kind, rng)
            try:
                found, told = found_in(corner_pairs(BOARD, where, noise, rng))
            except InputError:  # does not fit at all
                refused += 1
                continue
            error = np.sqrt(np.mean(height_errors(found)[0] ** 2)) / 10
            if not told:
                accepted, worst = accepted + 1, max(worst, error)
                continue
            refused += 1
            shares.append(height_share(found.certainty)[0])
            if "more places of" in told:
                again = corner_pairs(BOARD, where + as_advised(told, rng), noise, rng)
                followed.append(not found_in(again)[1])
        least = f"; the least uncertainty of a refused one is {100 * min(shares):.2g} %" if shares else ""
        lines.append(f"  {kind}: {accepted} accepted, {refused} refused{least}")
    lines += [
        f"Greatest error of heights of an accepted one, root mean square over the image: {100 * worst:.2f} % (limit of "
        "two standard deviations: 1 %)",
        f"Where the advice was followed, the calibration was accepted: {sum(followed)} of {len(followed)}",
    ]
    return lines


if __name__ == "__main__":
    main()
