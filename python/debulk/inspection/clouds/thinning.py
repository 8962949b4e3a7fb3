"""A few of a cloud's points, spread over all of it, and the pitch of the cloud on the surface that it shows."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk.arrays import Bools, Cloud, Floats
from debulk.inspection.clouds.enough import POINTS

_CELLS_MM = (10.0, 20.0, 40.0, 80.0)  # sides of the cells that are tried
_MANY = 20  # cells per point in the box of the points, up to which cells are counted by marks
_CROWD = 6  # points per filled cell: with so many, hardly a cell of the surface is empty


class Thinned(NamedTuple):
    """Some points of a cloud, NaN where nothing was seen."""

    points: NDArray[np.float32]
    """(N, 3)."""
    each: int
    """Number of the cloud's points that each of these stands for."""


def thinned(points: NDArray[np.float32], mask: NDArray[np.bool_] | None = None) -> Thinned:
    """Return about 30 000 points, one from each tile of a cloud's image or list, NaN where the mask hides them.

    Their places in the tiles are random, but the same for every cloud of the same shape. If a cloud has a point in
    every eighth pixel only, the random places hit neither all nor none of its points.
    """
    places, each = _places(points.shape[:-1])
    if points.flags.c_contiguous:
        few = np.take(points.reshape(-1, 3), places, axis=0)
    else:  # a part of an image, all of which `reshape` would copy
        few = points[np.unravel_index(places, points.shape[:-1])]
    if mask is not None and mask.shape == points.shape[:2]:
        few[np.take(mask.reshape(-1), places)] = np.nan
    return Thinned(few, each)


@functools.lru_cache(maxsize=4)
def _places(shape: tuple[int, ...]) -> tuple[NDArray[np.int64], int]:
    """Return the flat indices of one point in each tile, and the number of points in a tile."""
    step = max(1, int((np.prod(shape) / POINTS) ** (1 / len(shape))))
    tiles = np.meshgrid(*(np.arange(max(1, n // step)) for n in shape), indexing="ij")
    inside = np.random.default_rng(0).integers(0, step, (len(shape), tiles[0].size))
    at = [np.minimum(tile.ravel() * step + jitter, n - 1) for tile, jitter, n in zip(tiles, inside, shape, strict=True)]
    flat = np.asarray(np.ravel_multi_index(at, shape), dtype=np.int64)
    flat.flags.writeable = False
    return flat, step ** len(shape)


def window_of(points: Cloud, wanted: Callable[[Cloud], Bools]) -> tuple[slice, slice]:
    """Return the rows and columns of an image (H, W, 3) outside which none of `thinned` points is wanted.

    `wanted` says it of (N, 3) points, all finite. They reach by two tiles farther, and are all if no point is wanted.
    """
    few, each = thinned(points)
    seen = np.flatnonzero(complete(np.isfinite(few)))
    place = _places(points.shape[:-1])[0][seen[wanted(few[seen])]]
    if not len(place):
        return np.s_[:, :]
    beyond = 2 * math.isqrt(each)
    rows, columns = (
        slice(max(0, int(at.min()) - beyond), int(at.max()) + beyond) for at in np.divmod(place, points.shape[1])
    )
    return rows, columns


def complete(marks: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which rows of (..., 3) marks are all set; ten times faster than `all` along so short an axis."""
    return np.asarray(marks[..., 0] & marks[..., 1] & marks[..., 2])


def pitch_of(xy_mm: NDArray[np.floating], each: int) -> float:
    """Return the side of the square that each point of a cloud has for itself, from a finite sample, (N, 2).

    The area is that of the cells that hold points. The cells are so large that hardly a cell on the surface is empty.
    """
    if len(xy_mm) < _CROWD:
        return np.inf
    area = 0.0
    for side in _CELLS_MM:
        filled = _filled(np.floor(xy_mm[:, 0] / side), np.floor(xy_mm[:, 1] / side))
        area = filled * side * side
        if len(xy_mm) >= _CROWD * filled:
            break
    return float(np.sqrt(area / (len(xy_mm) * each)))


def widest_mm(points: Cloud, pitch_mm: float, pose: Floats, stop: _core.Stop) -> float:
    """Return how far apart a cloud's points lie where they are farthest apart, at least the pitch.

    A line scanner measures a point every tenth of a millimetre along lines that may be millimetres apart.
    """
    if points.ndim == 2 and not np.array_equal(pose, np.eye(4)):  # its neighbours are sought in XY
        points = _core.cloud.transform(points, pose, 0, stop)
    return _core.cloud.widest_pitch(points, pitch_mm, stop)


def _filled(column: NDArray[np.floating], row: NDArray[np.floating]) -> int:
    """Return the number of different cells with these columns and rows, which are whole numbers."""
    wide, tall = np.ptp(column) + 1, np.ptp(row) + 1
    if not wide * tall <= _MANY * len(row):  # some points are far off: sorting takes less time than so many marks
        return len(np.unique(np.stack([column, row], axis=1), axis=0))
    marks = np.zeros((int(tall), int(wide)), dtype=np.bool_)
    marks[(row - row.min()).astype(np.int64), (column - column.min()).astype(np.int64)] = True
    return int(np.count_nonzero(marks))
