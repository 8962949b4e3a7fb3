"""The fit of two cameras to the corners of boards, and what the corners say about each of its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from debulk.arrays import Floats

LENS = 9
"""Parameters of a camera: fx, fy, cx, cy and five coefficients of distortion."""
CAMERAS = 2 * LENS + 6
"""Parameters of both cameras: left lens, right lens, rotation vector and translation."""
_ROUNDS = 5


@dataclass(frozen=True, eq=False)
class Pair:
    """The corners of one board that both cameras see."""

    name: str
    board: Floats
    """(K, 3) corners in the board's frame, mm."""
    left: Floats
    """(K, 2) where the left camera sees them, pixels."""
    right: Floats


@dataclass(frozen=True, eq=False)
class Cameras:
    """Two cameras: x_right = rotation @ x_left + translation."""

    matrices: list[Floats]
    distortions: list[Floats]
    rotation: Floats
    translation: Floats


@dataclass(frozen=True, eq=False)
class Placed:
    """A board at the place that fits both images best."""

    place: Floats
    """(6,) rotation vector and translation, x_left = rotation @ x_board + translation."""
    residual: Floats
    """(4 K,) pixels: left x, y of each corner, then right."""
    slopes: Floats
    """(4 K, CAMERAS) derivative of the residual with respect to the cameras, the board moving along."""

    @property
    def errors_px(self) -> tuple[float, float]:
        """Root mean square distance in each image, pixels."""
        left, right = (self.residual**2).reshape(2, -1, 2).sum(axis=2).mean(axis=1)
        return float(np.sqrt(left)), float(np.sqrt(right))


def fit(pairs: Sequence[Pair], pixels: tuple[int, int]) -> Cameras:
    """Fit both cameras with OpenCV: each by itself first, then both together with one place for each board."""
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
    return Cameras(matrices, [np.ravel(d)[:5] for d in distortions], turn, np.ravel(way))


def placed(pair: Pair, cameras: Cameras) -> Placed:
    """Place a board where it fits both images best."""
    import cv2

    _, turn, move = cv2.solvePnP(pair.board, pair.left, cameras.matrices[0], cameras.distortions[0])
    place = np.concatenate([np.ravel(turn), np.ravel(move)])
    seen = np.concatenate([pair.left, pair.right]).ravel()
    for _ in range(_ROUNDS):  # Gauss-Newton
        predicted, _, of_place = projected(pair.board, place, cameras)
        place = place - np.linalg.lstsq(of_place, predicted - seen, rcond=None)[0]
    predicted, of_cameras, of_place = projected(pair.board, place, cameras)
    across = np.linalg.qr(of_place)[0]
    return Placed(place, predicted - seen, of_cameras - across @ (across.T @ of_cameras))


def projected(points: Floats, place: Floats, cameras: Cameras) -> tuple[Floats, Floats, Floats]:
    """Project (K, 3) points of a board into both images.

    Returns the (4 K,) pixels and their derivatives with respect to the cameras, (4 K, CAMERAS), and the place, (4 K,
    6).
    """
    import cv2

    turn, move = place[:3, None], place[3:, None]
    between = cv2.Rodrigues(cameras.rotation)[0]
    there, way, *slopes = cv2.composeRT(turn, move, between, cameras.translation[:, None])
    of_turn, of_move, of_between, of_way = (
        np.concatenate(pair) for pair in zip(slopes[:4], slopes[4:], strict=True)
    )  # each (6, 3): of the composed rotation vector and translation
    seen, left = cv2.projectPoints(points, turn, move, cameras.matrices[0], cameras.distortions[0])
    seen_there, right = cv2.projectPoints(points, there, way, cameras.matrices[1], cameras.distortions[1])
    rows = 2 * len(points)
    of_cameras, of_place = np.zeros((2 * rows, CAMERAS)), np.zeros((2 * rows, 6))
    of_cameras[:rows, :LENS] = left[:, 6 : 6 + LENS]
    of_cameras[rows:, LENS : 2 * LENS] = right[:, 6 : 6 + LENS]
    of_cameras[rows:, 2 * LENS :] = right[:, :6] @ np.column_stack([of_between, of_way])
    of_place[:rows] = left[:, :6]
    of_place[rows:] = right[:, :6] @ np.column_stack([of_turn, of_move])
    return np.concatenate([np.ravel(seen), np.ravel(seen_there)]), of_cameras, of_place
