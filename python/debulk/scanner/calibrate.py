"""Calibration of the two cameras from images of a board."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk.arguments import of_type, typed
from debulk.scanner.board import Board
from debulk.scanner.board_pairs import listed, seen_pairs
from debulk.scanner.board_places import board_place
from debulk.scanner.board_turn import same_way_round
from debulk.scanner.calibration import Calibration
from debulk.scanner.calibration_advice import advice, nearly_uncertain, too_uncertain
from debulk.scanner.certainty import certainty, corner_variance, information
from debulk.scanner.inputs import InputError
from debulk.scanner.stereo_fit import Pair, fit, placed

LEAST_PAIRS = 5
SPOILING_RATIO = 3.0
"""A pair spoils the fit if its error is this many times the median error ..."""
SPOILING_PX = 0.3
"""... if it is also greater than this."""
MOST_ERROR_PX = 1.0
"""A calibration with a greater error is refused."""


class UncertainCalibration(InputError):
    """Heights measured with this calibration would be too uncertain; the message says what to do.

    Attributes
    ----------
    calibration
        What was found, for a picture of where the boards were; not for measuring.
    """

    def __init__(self, message: str, calibration: Calibration) -> None:
        super().__init__(message)
        self.calibration = calibration

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (str(self), self.calibration)


@typed
def calibrate(
    left_images: Sequence[Any],
    right_images: Sequence[Any],
    board: Board,
    *,
    names: Sequence[str] | None = None,
    distance_mm: float | None = None,
) -> Calibration:
    """Calibrate two cameras from pairs of images of a board, with OpenCV.

    Each pair shows the board in one place, seen by both cameras at once. Ten to twenty places are good, tilted by 20 to
    40 degrees to all sides, near and far, and reaching into all corners of the images. Pairs that spoil the fit or
    repeat another are left out and named. The covariance of all parameters gives the uncertainty of heights.

    Parameters
    ----------
    left_images, right_images
        The same number of 8-bit images from each camera, (H, W), in the same order.
    board
        Board that they show.
    names
        Names of the pairs, for the report; None: "1", "2", ...
    distance_mm
        Distance from the left camera at which surfaces will be measured; None: the median distance of the boards.

    Returns
    -------
    Calibration
        Calibration with the reprojection error of every image, the pairs left out, where the boards were, and the
        standard deviations of focal lengths, baseline and heights.

    Raises
    ------
    debulk.InputError
        If fewer than five pairs show the board to both cameras or fit together, or the error is above 1 px.
    debulk.scanner.UncertainCalibration
        If two standard deviations of heights are more than 1 % of them over the image, or 2 % anywhere in it. The
        message says what to do.

    Examples
    --------
    >>> blank = np.full((480, 640), 200, np.uint8)
    >>> calibrate([blank] * 5, [blank - 1] * 5, Board((10, 7), 20.0))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    debulk._core.InputError: left_images, right_images: expected the board in at least 5 pairs, but found it in 0...
    """
    left, right = (
        _images(images, name) for images, name in ((left_images, "left_images"), (right_images, "right_images"))
    )
    if len(left) != len(right):
        raise InputError(f"right_images: expected {len(left)} images like the left, but got {len(right)}")
    if not isinstance(board, Board):
        raise InputError(f"board: expected a debulk.scanner.Board, but got {of_type(board)}")
    shapes = {image.shape for image in (*left, *right)}
    if len(shapes) > 1:
        raise InputError(f"left_images, right_images: expected images of one size, but got {sorted(shapes)}")
    titles = [str(k + 1) for k in range(len(left))] if names is None else [str(name) for name in names]
    if len(titles) != len(left) or len(set(titles)) != len(titles):
        raise InputError(f"names: expected {len(left)} different names, but got {len(set(titles))}")
    if distance_mm is not None and not 0 < distance_mm < 1e6:
        raise InputError(f"distance_mm: expected a distance in mm, but got {distance_mm!r}")
    pixels = left[0].shape[1], left[0].shape[0]
    pairs, spoiling, layout = seen_pairs(titles, left, right, board, LEAST_PAIRS)
    if len(pairs) < LEAST_PAIRS:
        raise InputError(
            f"left_images, right_images: expected the board in at least {LEAST_PAIRS} pairs, but found it in "
            f"{len(pairs)} of {len(left)}; {listed(spoiling)}"
        )
    return from_pairs(pairs, spoiling, board, layout, pixels, distance_mm)


def from_pairs(
    pairs: Sequence[Pair],
    spoiling: Mapping[str, str],
    board: Board,
    layout: Board,
    pixels: tuple[int, int],
    distance_mm: float | None = None,
) -> Calibration:
    """Calibrate from the corners that were found; see `calibrate` for what is raised."""
    counted = same_way_round(pairs, board, pixels)
    remarks = _remarks(layout, board, sum(a is not b for a, b in zip(pairs, counted, strict=True)))
    pairs, spoiling = counted, dict(spoiling)
    while True:
        cameras = fit(pairs, pixels)
        boards = [placed(pair, cameras) for pair in pairs]
        errors = np.array([board.errors_px for board in boards])
        worst = errors.max(axis=1)
        k = int(np.argmax(worst))
        if worst[k] <= max(SPOILING_PX, SPOILING_RATIO * float(np.median(worst))):
            break
        spoiling[pairs[k].name] = f"error {worst[k]:.2f} px, the median pair's is {np.median(worst):.2f} px"
        del pairs[k]
        if len(pairs) < LEAST_PAIRS:
            raise InputError(
                f"left_images, right_images: fewer than {LEAST_PAIRS} pairs fit together; left out: {listed(spoiling)}"
            )
    total_error = float(np.sqrt(np.mean(errors**2)))
    if total_error > MOST_ERROR_PX:
        raise InputError(
            f"left_images, right_images: expected pairs that fit within {MOST_ERROR_PX:g} px, but the error is "
            f"{total_error:.1f} px: "
            "pairs are mixed up, the cameras moved between them, or the board is another"
        )
    places = [board_place(pair, board) for pair, board in zip(pairs, boards, strict=True)]
    distance = float(np.median([place.distance_mm for place in places])) if distance_mm is None else distance_mm
    info, variance = information(boards), corner_variance(boards)
    certain = certainty(cameras, info, variance, distance, pixels)
    told = ""
    if nearly_uncertain(certain):
        told = advice(certain, cameras, info, variance, pixels, board, places)
        remarks.append(told)
    calibration = Calibration(
        cameras.matrices,
        cameras.distortions,
        cameras.rotation,
        cameras.translation,
        pixels,
        image_errors_px={
            f"{side} {pair.name}": float(value)
            for pair, both in zip(pairs, errors, strict=True)
            for side, value in zip(("left", "right"), both, strict=True)
        },
        spoiling=spoiling,
        error_px=total_error,
        certainty=certain,
        boards=places,
        remarks=remarks,
    )
    if too_uncertain(certain):
        raise UncertainCalibration(f"left_images, right_images: {told}", calibration)
    return calibration


def _remarks(layout: Board, board: Board, turned: int) -> list[str]:
    across, down = board.squares
    remarks = []
    if layout is not board:
        kind = "of OpenCV before 4.6 (legacy)" if layout.legacy else "of OpenCV since 4.6"
        remarks.append(f"the ChArUco board has the layout {kind}")
    if len(board.turns) > 1:
        anew = f"in {turned} pair{'' if turned == 1 else 's'} the right camera's corners were counted anew"
        remarks.append(
            f"a board of {across} x {down} squares looks the same when it is turned; "
            + (f"{anew}, as all pairs together want it" if turned else "both cameras counted its corners alike")
        )
    return remarks


def _images(images: Sequence[Any], name: str) -> list[NDArray[np.uint8]]:
    out = []
    for k, image in enumerate(images):
        array = np.asarray(image)
        if array.ndim != 2 or array.dtype != np.uint8:
            got = f"{array.dtype} {array.shape}" if array.ndim else of_type(image)
            raise InputError(f"{name}, image {k + 1}: expected an (H, W) array of uint8, but got {got}")
        out.append(np.ascontiguousarray(array))
    return out
