"""Small windows of a scan's own points on the ply, before any filter; the cloud may be an image or a list of points."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from debulk.arrays import Bools, Cloud
from debulk.inspection.clouds.thinning import complete, thinned
from debulk.inspection.rawscan.shared_noise import spread_over

_SIDE = 16  # points along the side of a window
_WINDOWS = 64  # at most
_MOST_POINTS = 320  # of a window of a list of points; of more, every second is taken, or every third, and so on


def windows_of(scan: Cloud, on_ply: Callable[[Cloud], Bools], pitch_mm: float) -> list[Cloud]:
    """Return the points of some windows of 16 by 16 points, (M, 3): squares of an image, or cells of a list in its XY.

    Points that an image did not see are kept, as NaN. `on_ply` tells which of (N, 3) finite points lie on the ply.
    Without a known pitch there are no windows.
    """
    if not np.isfinite(pitch_mm):
        return []
    return _squares(scan, on_ply) if scan.ndim == 3 else _cells(scan, on_ply, _SIDE * pitch_mm)


def _squares(scan: Cloud, on_ply: Callable[[Cloud], Bools]) -> list[Cloud]:
    rows, columns = (np.arange(0, n - _SIDE + 1, _SIDE) for n in scan.shape[:2])
    at = np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=-1).reshape(-1, 2)
    middles = scan[at[:, 0] + _SIDE // 2, at[:, 1] + _SIDE // 2]
    seen = complete(np.isfinite(middles))
    at = at[seen][on_ply(middles[seen])]
    return [scan[i : i + _SIDE, j : j + _SIDE].reshape(-1, 3) for i, j in at[np.unique(spread_over(len(at), _WINDOWS))]]


def _cells(scan: Cloud, on_ply: Callable[[Cloud], Bools], side_mm: float) -> list[Cloud]:
    few = thinned(scan).points
    few = few[complete(np.isfinite(few))]
    few = few[on_ply(few)]
    if not len(few):
        return []
    origin = few[:, :2].min(axis=0)
    chosen = np.unique(np.floor((few[:, :2] - origin) / side_mm).astype(np.int64), axis=0)
    chosen = chosen[np.unique(spread_over(len(chosen), _WINDOWS))]
    wide, tall = chosen.max(axis=0) + 1
    number = np.full((wide, tall), -1)
    number[chosen[:, 0], chosen[:, 1]] = np.arange(len(chosen))
    with np.errstate(invalid="ignore"):
        cell = np.floor((scan[:, :2] - origin) / np.float32(side_mm))
        inside = np.flatnonzero((cell >= 0).all(axis=1) & (cell[:, 0] < wide) & (cell[:, 1] < tall))
    of = number[tuple(cell[inside].astype(np.int64).T)]
    inside, of = inside[of >= 0], of[of >= 0]
    order = np.argsort(of, kind="stable")
    groups = np.split(inside[order], np.cumsum(np.bincount(of, minlength=len(chosen)))[:-1])
    return [scan[one[:: max(1, -(-len(one) // _MOST_POINTS))]] for one in groups]
