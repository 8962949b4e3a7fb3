"""Patches of an organised scan that carry no measuring noise, as a scanner's own software fills or clips them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk import _core

__all__ = ["SIDE", "Squares", "quiet_squares", "squares_of", "touching"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
Whole = NDArray[np.int64]
Cloud = NDArray[np.float32]
OnPly = Callable[[Cloud], Bools]

SIDE = 12  # pixels, of a square
_ROWS = np.arange(0, SIDE, 3)  # of a square, that are looked at
_ORDER = 4  # of the differences: a crown filled in by a thin plate is curved, and has second ones of its own
_ACROSS = 3.0  # squares begin so many times in the width of the smallest patch that is asked for
_QUIET = 0.1  # of the scan's median: a lower difference carries no noise of this scan
_SHARE = 0.7  # of a square's differences: of noise 0.05 are as low, of quantised noise half in the worst of squares
_SHARE_OF_ROW = 0.5  # of one row's; noise alone has it in one square of 2000
_STEPS = 0.25  # share of second differences that are alike: 0.11 of noise, 0.29 where heights come in steps as high
_ALIKE = 0.2  # of their median
_LEAST_SEEN = 0.5  # of a square's differences
_FOR_MEDIAN = 4000  # squares, over all of the image
_ULPS = 4.0  # what rounding to single precision leaves of a smooth surface's differences
_LEVEL = 0.01  # of the mold's z along the scanner's XY: with less both z have the same differences
_BAND = 1 << 14  # squares, a few milliseconds: so soon a raised stop is heeded


@dataclass(frozen=True, eq=False)
class Squares:
    """A lattice of squares of pixels, which may overlap.

    Attributes
    ----------
    rows, columns
        Of their first pixels.
    step
        Pixels from one to the next, along rows and columns.
    """

    rows: Whole
    columns: Whole
    step: int

    def corners(self, index: Whole) -> Whole:
        """Return the (N, 2) row and column of the first pixel of squares, counted row by row."""
        return np.stack([self.rows[index // len(self.columns)], self.columns[index % len(self.columns)]], axis=1)


def squares_of(shape: tuple[int, ...], pitch_mm: float, wide_mm: float) -> Squares | None:
    """Lay squares on a cloud's image such that a patch so wide holds some; None: it is no image, or too small."""
    if len(shape) != 3 or min(shape[:2]) < SIDE or not np.isfinite(pitch_mm):
        return None
    step = int(np.clip(wide_mm / (_ACROSS * pitch_mm), 4, 2 * SIDE))
    rows, columns = (np.arange(0, n - SIDE + 1, step, dtype=np.int64) for n in shape[:2])
    return Squares(rows, columns, step)


def quiet_squares(scan: Cloud, squares: Squares, on_ply: OnPly, up: Floats, stop: _core.Stop) -> Bools | None:
    """Tell which squares on the ply hold differences far below the scan's; None: its noise does not allow to tell.

    Parameters
    ----------
    scan
        (H, W, 3), scanner frame.
    squares
        On its image.
    on_ply
        Tells which (N, 3) points lie on the ply.
    up
        (3,) the mold's z in the scanner's frame: heights may have been clipped along it, and not along the scanner's.
    stop
        Heeded.

    Returns
    -------
    NDArray[np.bool_]
        (R, C), or None where the noise is no more than what rounding leaves, or is quantised too coarsely.
    """
    count = len(squares.rows) * len(squares.columns)
    quiet = np.zeros(count, dtype=np.bool_)
    some = _those_on_ply(scan, squares, np.arange(0, count, -(-count // _FOR_MEDIAN)), on_ply)
    if not len(some):
        return quiet.reshape(len(squares.rows), -1)
    least = _ULPS * float(np.spacing(np.nanmax(np.abs(scan[tuple((squares.corners(some) + SIDE // 2).T)]))))
    axes = [np.array([0.0, 0.0, 1.0]), up] if np.hypot(*up[:2]) > _LEVEL else [np.array([0.0, 0.0, 1.0])]
    limits = [_limit(_differences(scan, squares.corners(some), axis, 2)) for axis in axes]
    if any(limit is None or limit < least for limit in limits):
        return None
    known = [(axis, limit) for axis, limit in zip(axes, limits, strict=True) if limit is not None]
    maybe = _those_on_ply(scan, squares, np.flatnonzero(_quiet_in_a_row(scan, squares, known, stop)), on_ply)
    for first in range(0, len(maybe), _BAND):
        _heed(stop)
        part = maybe[first : first + _BAND]
        shares = [_share(_differences(scan, squares.corners(part), axis, _ORDER), limit) for axis, limit in known]
        quiet[part] = np.max(shares, axis=0) >= _SHARE
    return quiet.reshape(len(squares.rows), -1)


def touching(quiet: Bools) -> list[Whole]:
    """Return the (N, 2) rows and columns of quiet squares, piece by piece of those that touch along a side."""
    left = {(int(row), int(column)) for row, column in np.argwhere(quiet)}
    pieces = []
    for start in sorted(left):
        if start not in left:
            continue
        left.remove(start)
        piece = [start]
        for row, column in piece:  # which grows meanwhile
            beside = {(row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)} & left
            left -= beside
            piece += sorted(beside)
        pieces.append(np.array(piece))
    return pieces


def _those_on_ply(scan: Cloud, squares: Squares, index: Whole, on_ply: OnPly) -> Whole:
    """Return those of the squares whose middles were seen, and lie on the ply."""
    middles = scan[tuple((squares.corners(index) + SIDE // 2).T)]
    seen = np.isfinite(middles).all(axis=1)
    index = index[seen]
    return index[on_ply(middles[seen])] if len(index) else index


def _quiet_in_a_row(scan: Cloud, squares: Squares, known: list[tuple[Floats, float]], stop: _core.Stop) -> Bools:
    """Tell which squares may be quiet, by one row of each: that costs a fraction of all, and leaves hardly any."""
    wide, out = len(squares.columns), []
    for first in range(0, len(squares.rows), max(1, _BAND // wide)):
        _heed(stop)
        rows = scan[squares.rows[first : first + max(1, _BAND // wide)] + SIDE // 2]
        reach = squares.step * (wide - 1) + 1
        pixels = np.stack([rows[:, k : k + reach : squares.step] for k in range(SIDE)])
        differences = np.diff(pixels, n=_ORDER, axis=0)
        quiet = np.zeros(differences.shape[1:3], dtype=np.bool_)
        for axis, limit in known:
            low = np.abs(_along(differences, axis)) <= limit
            quiet |= np.count_nonzero(low, axis=0) >= _SHARE_OF_ROW * len(differences)
        out.append(quiet)
    return np.concatenate(out).ravel()


def _differences(scan: Cloud, corners: Whole, axis: Floats, order: int) -> Cloud:
    """(N, rows, SIDE - order) differences along the rows of squares, of what lies along an axis of the scanner's.

    They are taken before the axis is: those of single-precision neighbours are exact.
    """
    rows = corners[:, 0, None, None] + _ROWS[:, None]
    columns = corners[:, 1, None, None] + np.arange(SIDE)
    return _along(np.diff(scan[rows, columns], n=order, axis=2), axis)


def _along(points: Cloud, axis: Floats) -> Cloud:
    """Last axis of (..., 3) numbers, as far as it lies along an axis."""
    parts = [np.float32(axis[k]) * points[..., k] for k in np.flatnonzero(axis)]
    return np.asarray(sum(parts[1:], start=parts[0]))


def _limit(second: Cloud) -> float | None:
    """Height below which a fourth difference is quiet, from (N, rows, n) second ones; None: too coarsely quantised.

    Squares that are all but free of noise do not count for the latter: they are what is looked for.
    """
    fourth = np.diff(second, n=_ORDER - 2)
    limit = _QUIET * _median(np.abs(fourth))
    sizes = np.abs(second[_share(fourth, limit) < _SHARE])
    sizes = np.sort(sizes[np.isfinite(sizes)])
    if not len(sizes):
        return None
    alike = np.searchsorted(sizes, sizes + _ALIKE * np.median(sizes), side="right") - np.arange(len(sizes))
    return None if alike.max() > _STEPS * len(sizes) else limit


def _median(sizes: Cloud) -> float:
    seen = sizes[np.isfinite(sizes)]
    return float(np.median(seen)) if len(seen) else 0.0


def _share(differences: Cloud, limit: float) -> Floats:
    """(N,) share of each square's differences below the limit; 0 where too few were seen."""
    size = np.abs(differences).reshape(len(differences), differences.shape[1] * differences.shape[2])
    seen = np.count_nonzero(np.isfinite(size), axis=1)
    share = np.count_nonzero(size <= limit, axis=1) / np.maximum(seen, 1)
    return np.where(seen >= _LEAST_SEEN * size.shape[1], share, 0.0)


def _heed(stop: _core.Stop) -> None:
    if stop.now():
        raise _core.Stopped("the search for filled patches was stopped")
