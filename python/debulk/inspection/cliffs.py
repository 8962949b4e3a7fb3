"""The mold's own edges: what lies behind a cliff is another thing, not to be fitted as one surface with the mold."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from debulk import pocket
from debulk.grid import Grid

__all__ = ["without_cliffs"]

Floats = NDArray[np.float64]

_LEAST_MM = 6.0  # of a cliff's height
_STEEP = 2.0  # no mold that a ply is draped over falls by more than this, to places that the camera sees
# Round a cliff what lies below is left out so far. The fit reaches from one side to the other over its window of 12 mm,
# and its spline swings beside a jump the more, the shorter the way is on which that is made up for.
_REACH_MM = 48.0


def without_cliffs(heights: Grid, ply_outline: Floats | None) -> Grid:
    """Leave out what lies at the foot of cliffs, and off the ply: a reference fitted to the rest goes on level there.

    Parameters
    ----------
    heights
        (ny, nx) of the reference, NaN where nothing was seen.
    ply_outline
        (M, 2), mold XY, mm: nothing on the ply is left out; None: unknown.
    """
    values, spacing = np.asarray(heights.values), heights.spacing_mm
    fall = np.maximum(_falls(values, spacing), _falls(values.T, spacing).T)
    if not fall.any():
        return heights
    reach = int(np.ceil(_REACH_MM / spacing))
    away = spacing * np.hypot(*np.meshgrid(np.arange(-reach, reach + 1), np.arange(-reach, reach + 1)))
    gentle = np.where(away <= _REACH_MM, _LEAST_MM / 2 + _STEEP * away, np.inf)
    left_out = np.zeros(values.shape, dtype=np.bool_)
    ny, nx = values.shape
    for j, i in np.argwhere(fall > 0):
        low, high = np.maximum([j - reach, i - reach], 0), np.minimum([j + reach + 1, i + reach + 1], [ny, nx])
        here = np.s_[low[0] : high[0], low[1] : high[1]]
        begin, end = low - [j - reach, i - reach], high - [j - reach, i - reach]
        near = gentle[begin[0] : end[0], begin[1] : end[1]]
        limit = np.where(np.isinf(near), np.inf, np.minimum(near, max(_LEAST_MM / 2, fall[j, i] / 2)))
        with np.errstate(invalid="ignore"):
            left_out[here] |= values[here] < values[j, i] - limit
    if ply_outline is not None:
        row, column = np.nonzero(left_out)
        xy = heights.origin_mm + spacing * np.column_stack([column, row])
        left_out[row, column] = ~pocket.inside(ply_outline, xy)
    return Grid(np.where(left_out, np.float32(np.nan), values), heights.origin_mm, spacing)


def _falls(values: NDArray[np.float32], spacing: float) -> Floats:
    """By how much the surface falls off a cliff beside each height, to the next known one along its row; 0: by none."""
    out = np.zeros(values.shape)
    row, column = np.nonzero(np.isfinite(values))
    known = values[row, column].astype(np.float64)
    apart, jump = np.diff(column) * spacing, np.diff(known)
    off = (np.diff(row) == 0) & (apart <= _REACH_MM) & (np.abs(jump) >= np.maximum(_LEAST_MM, _STEEP * apart))
    first = np.flatnonzero(off)
    upper = first + (jump[first] > 0)
    np.maximum.at(out, (row[upper], column[upper]), np.abs(jump[first]))
    return out
