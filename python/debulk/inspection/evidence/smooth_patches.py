"""Patches of an organised scan without measuring noise, where a scanner's own software filled or clipped the scan."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

from debulk import _core
from debulk.arrays import Bools, Cloud, Floats, Whole
from debulk.inspection.clouds.thinning import complete

OnPly = Callable[[Cloud], Bools]

SIDE = _core.rawscan.square_side  # pixels along the side of a square


@dataclass(frozen=True)
class Limits:
    """Of places without noise; `tests/python/inspection/test_filled.py` fills, clips and rounds scans."""

    across: float = 3.0  # squares that begin within the width of the smallest patch that is looked for
    most_squares: int = 1000  # spread over the image, from which the scan's noise is read
    level: float = 0.01  # of the mold's z in the scanner's XY: if smaller, depths along both z axes differ alike


LIMITS = Limits()


@dataclass(frozen=True, eq=False)
class Squares:
    """A lattice of squares of pixels, which may overlap."""

    rows: Whole
    columns: Whole
    """`rows`, `columns`: rows and columns of the squares' first pixels."""
    step: int
    """Pixels from one square to the next, along rows and columns."""

    def middles(self, scan: Cloud, index: Whole) -> Cloud:
        """Return the (N, 3) points in the middle of the squares with these numbers, counted row by row."""
        half, wide = SIDE // 2, len(self.columns)
        return np.asarray(scan[self.rows[index // wide] + half, self.columns[index % wide] + half])


@dataclass(frozen=True, eq=False)
class QuietSquares:
    """Which squares of a scan carry no noise."""

    squares: Bools
    """(R, C) True for the squares without noise."""
    unknown: str = ""
    """Why a lack of noise would go undetected in other squares; empty: it would be detected."""


def squares_of(shape: tuple[int, ...], pitch_mm: float, wide_mm: float) -> Squares | None:
    """Lay squares on a cloud's image so that a patch of this width holds some; None: no image, or one too small."""
    if len(shape) != 3 or min(shape[:2]) < SIDE or not np.isfinite(pitch_mm):
        return None
    step = int(np.clip(wide_mm / (LIMITS.across * pitch_mm), 4, 2 * SIDE))
    rows, columns = (np.arange(0, n - SIDE + 1, step, dtype=np.int64) for n in shape[:2])
    return Squares(rows, columns, step)


def some_on_ply(scan: Cloud, squares: Squares, on_ply: OnPly) -> Whole:
    """Return at most a thousand squares, spread over the image, whose middles were seen and lie on the ply."""
    count = len(squares.rows) * len(squares.columns)
    return _those_on_ply(scan, squares, np.arange(0, count, -(-count // LIMITS.most_squares)), on_ply)


def quiet_squares(
    scan: Cloud, squares: Squares, some: Whole, on_ply: OnPly, up: Floats, stop: _core.Stop, threads: int = 0
) -> QuietSquares:
    """Find the squares on the ply that carry none of the scan's noise, which is read from `some` of them.

    `up` (3,) is the mold's z in the scanner's frame: heights may have been clipped along it, not along the scanner's z.
    """
    shape = len(squares.rows), len(squares.columns)
    count = shape[0] * shape[1]
    if not len(some):
        return QuietSquares(np.zeros(shape, dtype=np.bool_))
    axes = [(0.0, 0.0, 1.0), tuple(up)] if np.hypot(*up[:2]) > LIMITS.level else [(0.0, 0.0, 1.0)]
    limits = _core.rawscan.quiet_limits(scan, squares.step, some, axes, threads, stop)
    maybe = np.flatnonzero(_core.rawscan.quiet_squares(scan, squares.step, limits, threads, stop))
    quiet = np.zeros(count, dtype=np.bool_)
    quiet[_those_on_ply(scan, squares, maybe, on_ply)] = True
    return QuietSquares(quiet.reshape(shape), _unknown(limits))


def steps_hide(step_mm: float) -> str:
    """Say why a lack of noise goes undetected in depths that were rounded."""
    return (
        f"the scan's depths are rounded to steps of {step_mm:.2g} mm, which hide its noise: what was filled in "
        "before that looks like the rest"
    )


def touching(quiet: Bools) -> list[Whole]:
    """Return the (N, 2) rows and columns of quiet squares, in groups of squares that touch along a side."""
    count, labels = cv2.connectedComponents(quiet.astype(np.uint8), connectivity=4)
    return [np.argwhere(labels == label) for label in range(1, count)]


def _unknown(limits: list[_core.rawscan.QuietLimits]) -> str:
    if all(along.told for along in limits):
        return ""
    step_mm = max(along.step_mm for along in limits if not along.told)
    if any(along.stepped for along in limits):
        return steps_hide(step_mm)
    return "the scan has too little noise, or is rounded too coarsely, to miss noise in a patch"


def _those_on_ply(scan: Cloud, squares: Squares, index: Whole, on_ply: OnPly) -> Whole:
    """Return those of the squares whose middles were seen and lie on the ply."""
    middles = squares.middles(scan, index)
    seen = complete(np.isfinite(middles))
    index = index[seen]
    return index[on_ply(middles[seen])] if len(index) else index
