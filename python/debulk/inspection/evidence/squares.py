"""Squares of pixels, spread over a scan's image, from which its noise is read."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from debulk.arrays import Bools, Cloud, Whole
from debulk.inspection.clouds.thinning import complete

OnPly = Callable[[Cloud], Bools]

SIDE = 12  # pixels along the side of a square


@dataclass(frozen=True)
class Limits:
    """Of squares from which the noise is read; `tests/python/inspection/test_shared_noise.py` smooths scans."""

    across: float = 3.0  # squares that begin within the width of the smallest pocket that is looked for
    most_squares: int = 1000  # spread over the image


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


def squares_of(shape: tuple[int, ...], pitch_mm: float, wide_mm: float) -> Squares | None:
    """Lay squares on a cloud's image so that a place of this width holds some; None: no image, or one too small."""
    if len(shape) != 3 or min(shape[:2]) < SIDE or not np.isfinite(pitch_mm):
        return None
    step = int(np.clip(wide_mm / (LIMITS.across * pitch_mm), 4, 2 * SIDE))
    rows, columns = (np.arange(0, n - SIDE + 1, step, dtype=np.int64) for n in shape[:2])
    return Squares(rows, columns, step)


def some_on_ply(scan: Cloud, squares: Squares, on_ply: OnPly) -> Whole:
    """Return at most a thousand squares, spread over the image, whose middles were seen and lie on the ply."""
    count = len(squares.rows) * len(squares.columns)
    index = np.arange(0, count, -(-count // LIMITS.most_squares))
    middles = squares.middles(scan, index)
    seen = complete(np.isfinite(middles))
    index = index[seen]
    return index[on_ply(middles[seen])] if len(index) else index
