"""What is missing in a calibration whose heights are too uncertain, and how many boards would make up for it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats
from debulk.scanner.board import Board
from debulk.scanner.board_places import CELLS, BoardPlace, cell_of, covered
from debulk.scanner.certainty import BUMP_MM, Certainty, certainty, field_points
from debulk.scanner.stereo_fit import Cameras, projected

MOST_SHARE = 0.01
"""Two standard deviations of heights, over the image, may be this share of them.

A pocket is judged by the ridge that its excess length makes, half the excess, which grows as the square of the heights.
At the limit of 0.60 mm, which is an excess of 0.94 mm, 1 % of the heights is 0.01 mm of the ridge: half of the margin
of 0.02 mm within which the excess leaves a verdict UNDECIDED."""
MOST_SHARE_ANYWHERE = 0.02
"""The same where it is greatest: all of the margin."""
_WARNED = 0.5  # of the limits
_LEAST_TILT_DEG = 15.0
_FINE = 18, 12  # places at which coverage is looked at
_LEAST_COVERED = 0.5  # of a ninth of the image
_LEAST_MORE, _MOST_MORE = 3, 30
_PLANNED_SHARE = 0.7  # of the limits
_PLANNED_DEG = 30.0
_PLANNED_NEAR_FAR = 0.85, 1.15
_OUTERMOST = 0.85  # of the way from the middle of the field to its corner
_GOLDEN = 2.4  # radians: directions that never repeat


def height_share(found: Certainty) -> tuple[float, float]:
    """Two standard deviations of heights as a share of them: over the image, and where it is greatest."""
    return 2 * found.height_sd_mm / BUMP_MM, 2 * found.worst_height_sd_mm / BUMP_MM


def too_uncertain(found: Certainty) -> bool:
    """Tell whether heights are too uncertain to judge pockets."""
    return _exceeds(found, 1.0)


def nearly_uncertain(found: Certainty) -> bool:
    """Tell whether heights are so uncertain that it should be said."""
    return _exceeds(found, _WARNED)


def _exceeds(found: Certainty, part: float) -> bool:
    share, worst = height_share(found)
    return share > part * MOST_SHARE or worst > part * MOST_SHARE_ANYWHERE


def advice(
    found: Certainty,
    cameras: Cameras,
    info: Floats,
    variance: float,
    pixels: tuple[int, int],
    board: Board,
    places: Sequence[BoardPlace],
) -> str:
    """Say how uncertain heights are, why, and what to do."""
    share, worst = height_share(found)
    x, y = found.worst_at_px
    corner = CELLS[int(cell_of(np.array([[x, y]]), pixels)[0])]
    said = (
        f"heights {found.distance_mm:.0f} mm away are uncertain by {_percent(share)} %, and by {_percent(worst)} % in "
        f"the {corner} of the left image (two standard deviations; at most {100 * MOST_SHARE:g} % and "
        f"{100 * MOST_SHARE_ANYWHERE:g} %)"
    )
    missing = _missing_cells(cameras, found.distance_mm, pixels, places)
    parts = [said, _tilts(places)]
    if missing:
        parts.append(f"no board reached most of the {_joined([CELLS[c] for c in missing])} of the left image")
    more = boards_needed(cameras, info, variance, found.distance_mm, pixels, board, missing)
    if more is None:
        parts.append(
            f"the corners scatter by {np.sqrt(variance):.2f} px, and even {_MOST_MORE} more places would hardly make "
            "up for that: take sharper images, or a larger or flatter board"
        )
    else:
        where = ", there above all" if missing else ""
        parts.append(
            f"{more} more place{'s' if more > 1 else ''} of the board would do, tilted by {_PLANNED_DEG:.0f} degrees "
            f"to different sides, near and far, up to the edges of the images{where}"
        )
    return "; ".join(part for part in parts if part)


def boards_needed(
    cameras: Cameras,
    info: Floats,
    variance: float,
    distance_mm: float,
    pixels: tuple[int, int],
    board: Board,
    missing: Sequence[int] = (),
) -> int | None:
    """Count the places to add, one in each missing ninth first, to reach a share of the limits; None: too many.

    A share, and a few at least, because nobody holds a board exactly where it is planned here.
    """
    order = [*missing, *(c for c in (0, 8, 2, 6, 4, 1, 7, 3, 5) if c not in missing)]
    for k in range(_MOST_MORE):
        info = info + _planned(cameras, distance_mm, pixels, board, order[k % 9], k)
        if k + 1 < max(_LEAST_MORE, len(missing)):
            continue
        reached = certainty(cameras, info, variance, distance_mm, pixels)
        if not _exceeds(reached, _PLANNED_SHARE):
            return k + 1
    return None


def _planned(cameras: Cameras, distance_mm: float, pixels: tuple[int, int], board: Board, cell: int, k: int) -> Floats:
    """Return what a board in this ninth of the left image would say, moved inwards until both cameras see it whole."""
    points = board.corners_mm - board.corners_mm.mean(axis=0)
    rim = points * (np.array([*board.squares, 1]) + 0.5) / (np.array([*board.squares, 1]) - 2.0)
    turn = np.deg2rad(_PLANNED_DEG) * np.array([np.cos(_GOLDEN * k), np.sin(_GOLDEN * k), 0.0])
    at, *_ = field_points(cameras, distance_mm, pixels)
    middle = at.mean(axis=0)
    half = np.abs(at - middle).max(axis=0)
    offset = half * [cell % 3 - 1, cell // 3 - 1, 0]
    size = np.array(pixels) - 1
    for inwards in np.linspace(_OUTERMOST, 0.0, 11):
        place = np.concatenate([turn, (middle + inwards * offset) * _PLANNED_NEAR_FAR[k % 2]])
        if _inside(projected(rim, place, cameras)[0], size).all():
            break
    seen, of_cameras, of_place = projected(points, place, cameras)
    inside = _inside(seen, size)
    rows = np.repeat(np.tile(inside, 2), 2)
    if inside.sum() < 4:
        return np.zeros_like(of_cameras.T @ of_cameras)
    across = np.linalg.qr(of_place[rows])[0]
    slopes = of_cameras[rows] - across @ (across.T @ of_cameras[rows])
    return np.asarray(slopes.T @ slopes)


def _inside(seen: Floats, size: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Tell which points both cameras see."""
    at = seen.reshape(-1, 2)
    return np.asarray(((at >= 0) & (at <= size)).all(axis=1).reshape(2, -1).all(axis=0))


def _missing_cells(
    cameras: Cameras, distance_mm: float, pixels: tuple[int, int], places: Sequence[BoardPlace]
) -> list[int]:
    _, seen, _ = field_points(cameras, distance_mm, pixels, _FINE)
    inside, cell = covered([place.left_px for place in places], seen), cell_of(seen, pixels)
    return [c for c in range(9) if (cell == c).any() and inside[cell == c].mean() < _LEAST_COVERED]


def _tilts(places: Sequence[BoardPlace]) -> str:
    most = max(place.tilt_deg for place in places)
    if most < _LEAST_TILT_DEG:
        degrees = "1 degree" if round(most) == 1 else f"{most:.0f} degrees"
        return f"the boards were tilted by {degrees} at most: tilt them by 20 to 40 degrees to all sides"
    angles = np.deg2rad([place.towards_deg for place in places])
    slopes = np.tan(np.deg2rad([place.tilt_deg for place in places]))[:, None] * np.column_stack(
        [np.cos(angles), np.sin(angles)]
    )
    least = np.sqrt(np.linalg.eigvalsh(slopes.T @ slopes / len(slopes))[0])
    if least < np.tan(np.deg2rad(_LEAST_TILT_DEG)) / 2:
        return "the boards were tilted about one axis only: tilt them to all sides"
    return ""


def _percent(share: float) -> str:
    return "more than 100" if share > 1 else f"{100 * share:.2g}"


def _joined(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"
