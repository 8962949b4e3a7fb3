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
    # Of the median, which is 5.6 sigma: noise has 0.13 of its fourth differences below, a linear fill 0.55 to 0.8, and
    # coarser steps leave smooth stretches between them.
    quiet_share: float = 0.25
    window_pixels: int = 7  # along the side of the window in which low differences are counted
    # Differences that must be known, of the window's 98 along both axes or 49 along one, and least shares of low ones:
    # half of the noise leaves 0.26. The noise of eight layups reached it by chance in no window, and linear fills over
    # bells of 16 mm in 28 windows and more.
    least_known: int = 30
    low_share: float = 0.55
    low_along_share: float = 0.7
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


def quiet_pixels(height: Cloud, step_mm: float) -> tuple[Bools, str]:
    """Return the mask of the pixels round which heights (H, W) carry no noise, and why none can be missed, if so.

    A list of points gives coarse pixels, of which a filled-in pocket may hold no whole square. Within two pixels of a
    patch's rim the noise from outside prevails: patches come out smaller by so much. Between two of the steps to which
    the scan's depths were rounded, heights are smooth without having been filled.
    """
    fourths = [np.abs(np.diff(height.astype(np.float64), 4, axis=axis)) for axis in (0, 1)]
    known = np.concatenate([fourth[np.isfinite(fourth)] for fourth in fourths])
    middle = float(np.median(known)) if len(known) else 0.0
    if not middle > 0 or step_mm > LIMITS.quiet_share * middle:
        return np.zeros(height.shape, dtype=np.bool_), steps_hide(
            step_mm
        ) if step_mm else "the scan has too little noise to miss it in a patch"
    window = (LIMITS.window_pixels, LIMITS.window_pixels)
    counts = []
    for fourth, part in zip(fourths, (np.s_[2:-2, :], np.s_[:, 2:-2]), strict=True):
        low, counted = np.zeros(height.shape, np.float32), np.zeros(height.shape, np.float32)
        with np.errstate(invalid="ignore"):  # NaN is not low
            low[part] = fourth <= LIMITS.quiet_share * middle
        counted[part] = np.isfinite(fourth)
        counts.append(np.stack([cv2.boxFilter(of, -1, window, normalize=False) for of in (low, counted)]))
    # A fill that runs from rim to rim along rows or columns lacks noise along these alone.
    quiet = np.zeros(height.shape, dtype=np.bool_)
    for (few, number), share in (
        (counts[0] + counts[1], LIMITS.low_share),
        (counts[0], LIMITS.low_along_share),
        (counts[1], LIMITS.low_along_share),
    ):
        quiet |= few >= share * np.maximum(number, LIMITS.least_known)
    return quiet, ""


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
