"""A picture of where the boards of a calibration were: in both images, and how they were tilted."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk.arguments import typed, whole
from debulk.scanner.board_places import BoardPlace, covered
from debulk.scanner.calibration import Calibration
from debulk.scanner.inputs import InputError

Picture = NDArray[np.uint8]

_INK, _RULE, _LINE = (60, 60, 60), (190, 190, 190), (140, 90, 30)
_NOBODY, _FEW, _MANY = (200, 205, 245), (250, 235, 215), (205, 150, 90)
"""Colours, blue first: no board was there, one was, `_ENOUGH` or more were."""
_ENOUGH = 6
_ALONE = (225, 225, 225)
_GRID = 96, 72  # places at which it is asked whether both cameras see them
_TITLE_PIXELS = 26
_RINGS_DEG = 10, 20, 30, 40


@typed
def calibration_picture(calibration: Calibration, width: int = 1400) -> Picture:
    """Draw where the boards were.

    To the left and in the middle the two images, divided into ninths: the outlines of the boards, the area the bluer
    the more boards were there, red where none was, and grey where the other camera sees nothing at the boards' median
    distance. To the right the tilt of each board, as a point in the direction of its nearer side.

    Parameters
    ----------
    calibration
        Calibration by `calibrate`, or the one in its error `UncertainCalibration`.
    width
        Width of the picture in pixels, 600 or more.

    Returns
    -------
    NDArray[np.uint8]
        (height, width, 3), blue, green, red as OpenCV writes them.

    Raises
    ------
    debulk.InputError
        If the calibration does not say where its boards were.

    Examples
    --------
    >>> square = np.array([[100.0, 100], [500, 100], [500, 400], [100, 400]])
    >>> matrix = [[1000.0, 0, 639.5], [0, 1000.0, 479.5], [0, 0, 1]]
    >>> cameras = [matrix, matrix], np.zeros((2, 5)), np.eye(3), (-200.0, 0, 0), (1280, 960)
    >>> boards = [BoardPlace("1", square, square - 50, 25.0, 90.0, 800.0)]
    >>> calibration_picture(Calibration(*cameras, boards=boards)).shape
    (446, 1400, 3)
    """
    whole("width", width, 600, 20000)
    if not calibration.boards:
        raise InputError(
            "calibration: expected one that says where its boards were, but it does not: calibrate with this version"
        )
    size = calibration.pixels
    image_width = round(0.4 * width)
    height = round(image_width * size[1] / size[0])
    sides = [_seen(calibration, k, side, image_width) for k, side in enumerate(("left", "right"))]
    return np.hstack([*sides, _tilted(calibration.boards, width - 2 * image_width, height)])


def _seen(calibration: Calibration, k: int, side: str, width: int) -> Picture:
    import cv2

    pixels = calibration.pixels
    outlines = [getattr(board, f"{side}_px") for board in calibration.boards]
    scale = width / pixels[0]
    height = round(pixels[1] * scale)
    count = np.zeros((height, width), np.uint8)
    shapes = [np.rint(outline * scale).astype(np.int32) for outline in outlines]
    for shape in shapes:
        one = np.zeros_like(count)
        cv2.fillConvexPoly(one, shape, 1)
        count += one
    deep = np.clip((count.astype(np.float64) - 1) / (_ENOUGH - 1), 0, 1)[..., None]
    out = np.where(count[..., None] == 0, np.array(_NOBODY), np.array(_FEW) * (1 - deep) + np.array(_MANY) * deep)
    places = np.stack(np.meshgrid(*(np.arange(n) + 0.5 for n in _GRID)), -1).reshape(-1, 2) / _GRID * pixels
    both = _seen_by_both(calibration, k, places)
    inside = covered(outlines, places)
    alone = cv2.resize((~both & ~inside).reshape(_GRID[::-1]).astype(np.uint8), (width, height), interpolation=0)
    out = np.ascontiguousarray(np.where((alone > 0)[..., None], _ALONE, out).astype(np.uint8))
    for k in (1, 2):
        cv2.line(out, (width * k // 3, 0), (width * k // 3, height), (255, 255, 255), 2)
        cv2.line(out, (0, height * k // 3), (width, height * k // 3), (255, 255, 255), 2)
    cv2.polylines(out, shapes, True, _LINE, 1, cv2.LINE_AA)
    out[0] = out[-1] = out[:, 0] = out[:, -1] = _RULE
    share = inside[both].mean() if both.any() else 0.0
    return _titled(out, f"{side} image: {len(outlines)} boards, {100 * share:.0f} % of what both see reached")


def _seen_by_both(calibration: Calibration, k: int, places: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell which (N, 2) pixels of camera k the other one sees too, at the boards' median distance."""
    import cv2

    matrices, distortions = calibration.camera_matrices, calibration.distortions
    turn, move = calibration.rotation, calibration.translation_mm
    if k == 1:
        turn, move = turn.T, -turn.T @ move
    distance = float(np.median([board.distance_mm for board in calibration.boards]))
    rays = cv2.undistortPoints(places[:, None], matrices[k], distortions[k]).reshape(-1, 2)
    at = np.column_stack([rays, np.ones(len(rays))]) * distance
    there, *_ = cv2.projectPoints(at, cv2.Rodrigues(turn)[0], move, matrices[1 - k], distortions[1 - k])
    there = there.reshape(-1, 2)
    return np.asarray(((there >= 0) & (there <= np.array(calibration.pixels) - 1)).all(axis=1))


def _tilted(boards: tuple[BoardPlace, ...], width: int, height: int) -> Picture:
    import cv2

    out = np.full((height, width, 3), 255, np.uint8)
    most = max(_RINGS_DEG[-1], *(board.tilt_deg for board in boards))
    centre, reach = (width // 2, height // 2), 0.46 * min(width, height)
    for ring in _RINGS_DEG:
        radius = round(reach * ring / most)
        cv2.circle(out, centre, radius, _RULE, 1, cv2.LINE_AA)
        _write(out, f"{ring}", (centre[0] + 3, centre[1] - radius + 12), 0.35)
    cv2.line(out, (centre[0] - round(reach), centre[1]), (centre[0] + round(reach), centre[1]), _RULE, 1)
    cv2.line(out, (centre[0], centre[1] - round(reach)), (centre[0], centre[1] + round(reach)), _RULE, 1)
    for board in boards:
        angle, radius_px = np.deg2rad(board.towards_deg), reach * board.tilt_deg / most
        at = round(centre[0] + radius_px * np.cos(angle)), round(centre[1] + radius_px * np.sin(angle))
        cv2.circle(out, at, 5, _LINE, -1, cv2.LINE_AA)
    low, high = (f(board.distance_mm for board in boards) for f in (min, max))
    return _titled(out, f"tilt, degrees; {low:.0f} to {high:.0f} mm away")


def _titled(picture: Picture, title: str) -> Picture:
    head = np.full((_TITLE_PIXELS, picture.shape[1], 3), 255, np.uint8)
    _write(head, title, (6, 18), min(0.5, picture.shape[1] / 520))
    return np.asarray(np.vstack([head, picture]), np.uint8)


def _write(picture: Any, text: str, at: tuple[int, int], size: float) -> None:
    import cv2

    cv2.putText(picture, text, at, cv2.FONT_HERSHEY_SIMPLEX, size, _INK, 1, cv2.LINE_AA)
