"""Calibration of the two cameras from images of a board."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk.arguments import of_type
from debulk.scanner.board import Board
from debulk.scanner.calibration import Calibration
from debulk.scanner.inputs import InputError

F64 = NDArray[np.float64]

LEAST_PAIRS = 5
SPOILING_RATIO = 3.0
"""A pair spoils the fit if its error is this many times the median error ..."""
SPOILING_PX = 0.3
"""... if it is also greater than this."""
MOST_ERROR_PX = 1.0
"""A calibration with a greater error is refused."""


@dataclass(frozen=True, eq=False)
class _Pair:
    name: str
    board: F64  # (K, 3) corners that both cameras see
    left: F64  # (K, 2)
    right: F64


@dataclass(frozen=True, eq=False)
class _Cameras:
    matrices: list[F64]
    distortions: list[F64]
    rotation: F64
    translation: F64


def calibrate(
    left_images: Sequence[Any],
    right_images: Sequence[Any],
    board: Board,
    *,
    names: Sequence[str] | None = None,
) -> Calibration:
    """Calibrate two cameras from pairs of images of a board, with OpenCV.

    Each pair shows the board in one place, seen by both cameras at once. Ten to twenty places are good, tilted by 20 to
    40 degrees to all sides, near and far, and reaching into all corners of the images. Pairs that spoil the fit are
    left out and named.

    Parameters
    ----------
    left_images, right_images
        The same number of 8-bit images from each camera, (H, W), in the same order.
    board
        Board that they show.
    names
        Names of the pairs, for the report; None: "1", "2", ...

    Returns
    -------
    Calibration
        Calibration with the reprojection error of every image, the images left out, and the overall error.

    Raises
    ------
    debulk.InputError
        If fewer than five pairs show the board to both cameras or fit together, or the error is above 1 px.

    Examples
    --------
    >>> blank = np.full((480, 640), 200, np.uint8)
    >>> calibrate([blank] * 6, [blank] * 6, Board((10, 7), 20.0))
    Traceback (most recent call last):
    ...
    debulk._core.InputError: left_images, right_images: expected the board in at least 5 pairs, but found it in 0 of 6
    """
    left, right = (
        _images(images, name) for images, name in ((left_images, "left_images"), (right_images, "right_images"))
    )
    if len(left) != len(right):
        raise InputError(f"right_images: expected {len(left)} images like the left, but got {len(right)}")
    shapes = {image.shape for image in (*left, *right)}
    if len(shapes) > 1:
        raise InputError(f"left_images, right_images: expected images of one size, but got {sorted(shapes)}")
    titles = [str(k + 1) for k in range(len(left))] if names is None else [str(name) for name in names]
    if len(titles) != len(left):
        raise InputError(f"names: expected {len(left)} names, but got {len(titles)}")
    spoiling: dict[str, str] = {}
    pairs = []
    for name, one, other in zip(titles, left, right, strict=True):
        pair = _seen(name, one, other, board)
        if isinstance(pair, str):
            spoiling[name] = pair
        else:
            pairs.append(pair)
    total = len(left)
    if len(pairs) < LEAST_PAIRS:
        raise InputError(
            f"left_images, right_images: expected the board in at least {LEAST_PAIRS} pairs, but found it in "
            f"{len(pairs)} of {total}"
        )
    pixels = left[0].shape[1], left[0].shape[0]
    while True:
        cameras = _fit(pairs, pixels)
        errors = np.array([_errors(pair, cameras) for pair in pairs])
        worst = errors.max(axis=1)
        k = int(np.argmax(worst))
        if worst[k] <= max(SPOILING_PX, SPOILING_RATIO * float(np.median(worst))):
            break
        spoiling[pairs[k].name] = f"error {worst[k]:.2f} px, the median pair's is {np.median(worst):.2f} px"
        del pairs[k]
        if len(pairs) < LEAST_PAIRS:
            raise InputError(
                "left_images, right_images: fewer than 5 pairs fit together; left out: "
                + "; ".join(f"{name} ({why})" for name, why in spoiling.items())
            )
    total_error = float(np.sqrt(np.mean(errors**2)))
    if total_error > MOST_ERROR_PX:
        raise InputError(
            f"left_images, right_images: expected pairs that fit within {MOST_ERROR_PX:g} px, but the error is "
            f"{total_error:.1f} px: "
            "pairs are mixed up, the cameras moved between them, or the board is another"
        )
    image_errors = {
        f"{side} {pair.name}": float(value)
        for pair, both in zip(pairs, errors, strict=True)
        for side, value in zip(("left", "right"), both, strict=True)
    }
    return Calibration(
        cameras.matrices,
        cameras.distortions,
        cameras.rotation,
        cameras.translation,
        pixels,
        image_errors_px=image_errors,
        spoiling=spoiling,
        error_px=total_error,
    )


def _images(images: Sequence[Any], name: str) -> list[NDArray[np.uint8]]:
    out = []
    for k, image in enumerate(images):
        array = np.asarray(image)
        if array.ndim != 2 or array.dtype != np.uint8:
            got = f"{array.dtype} {array.shape}" if array.ndim else of_type(image)
            raise InputError(f"{name}, image {k + 1}: expected an (H, W) array of uint8, but got {got}")
        out.append(np.ascontiguousarray(array))
    return out


def _seen(name: str, left: NDArray[np.uint8], right: NDArray[np.uint8], board: Board) -> _Pair | str:
    """Find the part of the board that both cameras see, or say why it is too little."""
    found = [board.find(image) for image in (left, right)]
    for side, (ids, _) in zip(("left", "right"), found, strict=True):
        if len(ids) == 0:
            return f"the board was not found in the {side} image"
    (left_ids, left_at), (right_ids, right_at) = found
    both, of_left, of_right = np.intersect1d(left_ids, right_ids, return_indices=True)
    if len(both) < 8:
        return f"only {len(both)} corners are seen by both cameras"
    return _Pair(name, board.corners_mm[both], left_at[of_left], right_at[of_right])


def _fit(pairs: list[_Pair], pixels: tuple[int, int]) -> _Cameras:
    import cv2

    points = [pair.board.astype(np.float32) for pair in pairs]
    left, right = ([getattr(pair, side).astype(np.float32) for pair in pairs] for side in ("left", "right"))
    (_, k1, d1, *_), (_, k2, d2, *_) = (
        cv2.calibrateCamera(points, seen, pixels, np.eye(3), np.zeros(5)) for seen in (left, right)
    )
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-9)
    flags = cv2.CALIB_USE_INTRINSIC_GUESS
    found = cv2.stereoCalibrate(points, left, right, k1, d1, k2, d2, pixels, flags=flags, criteria=criteria)
    _, k1, d1, k2, d2, rotation, translation = found[:7]
    matrices, distortions = ([np.asarray(part, np.float64) for part in both] for both in ((k1, k2), (d1, d2)))
    turn, way = (np.asarray(part, np.float64) for part in (rotation, translation))
    return _Cameras(matrices, [np.ravel(d)[:5] for d in distortions], turn, np.ravel(way))


def _errors(pair: _Pair, cameras: _Cameras) -> tuple[float, float]:
    """Root mean square error in both images, for the one position of the board that fits both best."""
    import cv2

    _, turn, move = cv2.solvePnP(pair.board, pair.left, cameras.matrices[0], cameras.distortions[0])
    place = np.concatenate([np.ravel(turn), np.ravel(move)])
    steps = np.array([1e-6] * 3 + [1e-4] * 3)
    for _ in range(5):  # Gauss-Newton over both images
        residual = _residual(place, pair, cameras)
        moved = [
            (_residual(place + step * axis, pair, cameras) - residual) / step
            for step, axis in zip(steps, np.eye(6), strict=True)
        ]
        place = place - np.linalg.lstsq(np.stack(moved, axis=1), residual, rcond=None)[0]
    left, right = _residual(place, pair, cameras).reshape(2, -1, 2)
    return float(np.sqrt(np.mean((left**2).sum(axis=1)))), float(np.sqrt(np.mean((right**2).sum(axis=1))))


def _residual(place: F64, pair: _Pair, cameras: _Cameras) -> F64:
    """Distance of the corners from where they should be seen, for a place of the board in the left camera's frame."""
    import cv2

    turn = cameras.rotation @ cv2.Rodrigues(place[:3])[0]
    there = np.concatenate([np.ravel(cv2.Rodrigues(turn)[0]), cameras.rotation @ place[3:] + cameras.translation])
    seen = [
        cv2.projectPoints(pair.board, at[:3], at[3:], cameras.matrices[k], cameras.distortions[k])[0].reshape(-1, 2)
        - want
        for k, (at, want) in enumerate(((place, pair.left), (there, pair.right)))
    ]
    return np.concatenate(seen).ravel()
