"""Finds out how a board that looks the same when it is turned is seen by two cameras: both must count alike."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats
from debulk.scanner.board import Board
from debulk.scanner.inputs import InputError
from debulk.scanner.stereo_fit import Pair

_LEAST_DEG = 5.0
"""The next best way round must fit worse than the best by more than this."""


def same_way_round(pairs: Sequence[Pair], board: Board, pixels: tuple[int, int]) -> list[Pair]:
    """Renumber the right camera's corners as the left camera numbers them.

    A detector starts at the corner that is uppermost or leftmost in its image, and the cameras do not always agree
    on it. Each way to count gives another rotation between the cameras, and the right one is the same for all pairs;
    a wrong one changes with the board's tilt. If the pairs do not tell the right one, the board is refused.
    """
    import cv2

    if len(board.turns) == 1:
        return list(pairs)
    points = board.corners_mm.astype(np.float32)
    turns = []
    for side in ("left", "right"):
        seen = [getattr(pair, side).astype(np.float32) for pair in pairs]
        found = cv2.calibrateCamera([points] * len(pairs), seen, pixels, np.eye(3), np.zeros(5))
        turns.append([cv2.Rodrigues(turn)[0] for turn in found[3]])
    about = [_about_normal(board, order) for order in board.turns]
    between = np.array(
        [[right @ turn @ left.T for turn in about] for left, right in zip(*turns, strict=True)]
    )  # (pairs, turns, 3, 3)
    # Every rotation of every pair is tried; what counts is how far the nearest one of each pair is from it.
    flat = between.reshape(-1, 3, 3)
    cosines = (np.einsum("aij,pkij->apk", flat, between) - 1) / 2
    apart = np.rad2deg(np.arccos(np.clip(cosines, -1, 1)))
    misfit = np.median(apart.min(axis=2), axis=1)
    best = int(np.argmin(misfit))
    others = misfit[np.rad2deg(np.arccos(np.clip((np.einsum("aij,ij->a", flat, flat[best]) - 1) / 2, -1, 1))) > 45]
    if others.size and others.min() < misfit[best] + _LEAST_DEG:
        across, down = board.squares
        raise InputError(
            f"board: a board of {across} x {down} squares looks the same when it is turned, and these pairs do not "
            "tell which way round each camera sees it: tilt it by 20 to 40 degrees to all sides, or take a board "
            "with an even and an odd number of squares"
        )
    choice = apart[best].argmin(axis=1)
    return [
        replace(pair, right=pair.right[board.turns[k]]) if k else pair
        for pair, k in zip(pairs, choice.tolist(), strict=True)
    ]


def _about_normal(board: Board, order: NDArray[np.int64]) -> Floats:
    """Rotation R of the board for which corner k of the turned count lies at R times corner k, up to a shift."""
    points = board.corners_mm - board.corners_mm.mean(axis=0)
    u, _, vt = np.linalg.svd((points[order].T @ points)[:2, :2])
    turn = np.eye(3)
    turn[:2, :2] = u @ vt
    return turn
