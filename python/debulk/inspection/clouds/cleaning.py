"""The steps that prepare any cloud for a map of heights: check, mask, outlier removal, motion into the mold frame."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, cloud
from debulk._core import InputError
from debulk.arrays import Cloud
from debulk.inspection.running.cycle import heed
from debulk.recipe import Recipe, options

_PIECE = 1 << 19  # points; they take a few milliseconds, and a raised stop is heeded between pieces


def pieces(points: ArrayLike, name: str, stop: _core.Stop | None = None) -> Iterator[Cloud]:
    """Yield a cloud in the form of `as_cloud`, some rows at a time; the pieces are views if it has that form already.

    Raises
    ------
    Stopped
        Before the next piece, once the stop is raised.
    """
    array = points if is_plain(points) else cloud.as_cloud(points, name)  # as_cloud raises an error if it is no cloud
    for rows in slices(array, stop):
        yield cloud.as_cloud(array[rows], name)


def slices(array: NDArray[Any], stop: _core.Stop | None = None) -> Iterator[slice]:
    """Yield the rows of each piece of a cloud, and heed the stop before each."""
    rows = max(1, 3 * _PIECE * len(array) // max(1, array.size))
    for first in range(0, max(1, len(array)), rows):
        heed(stop, "the taking of a cloud")
        yield slice(first, first + rows)


def as_points(points: ArrayLike, name: str, stop: _core.Stop) -> Cloud:
    """Do what `as_cloud` does, but heed the stop, because it takes a while to copy a cloud of another type."""
    if not is_plain(points) or (points.dtype == np.float32 and points.flags.c_contiguous):
        return cloud.as_cloud(points, name)
    return owned(points, name, stop)


def owned(points: ArrayLike, name: str, stop: _core.Stop) -> Cloud:
    """Copy a cloud, because its owner may write into its memory while it is being processed, unless nobody can."""
    array = points if is_plain(points) else cloud.as_cloud(points, name)
    if array.dtype == np.float32 and array.flags.c_contiguous and array.flags.owndata and not array.flags.writeable:
        return array
    out = np.empty(array.shape, dtype=np.float32)
    for rows in slices(array, stop):
        out[rows] = cloud.as_cloud(array[rows], name)
    return out


def is_plain(points: ArrayLike) -> TypeGuard[NDArray[Any]]:
    """Whether this is an array of numbers in the shape of a cloud."""
    plain = isinstance(points, np.ndarray) and not isinstance(points, np.ma.MaskedArray) and points.dtype.kind in "fiu"
    return plain and np.ndim(points) in (2, 3) and np.shape(points)[-1] == 3


def masked(points: ArrayLike, mask: NDArray[np.bool_] | None, name: str, stop: _core.Stop) -> Cloud:
    """Check a cloud, and return it with NaN where the mask hides it, in a copy."""
    whole = as_points(points, name, stop)
    return hide(whole, mask, name, stop, out=None if mask is None else np.empty_like(whole))


def _check_bounds(points: Cloud, name: str, stop: _core.Stop) -> None:
    """Refuse what `cloud.checked` refuses, but heed the stop, and read no further than to a first piece that passes."""
    parts = []
    for piece in pieces(points, name, stop):
        parts.append(_core.cloud.bounds(piece, 0))
        if cloud.extent_mm(parts) >= cloud.SMALLEST_EXTENT_MM:
            return
    cloud.check_bounds(parts, points.size // 3, name)


def hide(
    points: Cloud, mask: NDArray[np.bool_] | None, name: str, stop: _core.Stop, *, out: Cloud | None = None
) -> Cloud:
    """Check a cloud, set to NaN what the mask hides, and return it: in place where it may be written into."""
    _check_bounds(points, name, stop)
    if mask is None:
        return points
    if points.shape[:2] != mask.shape:
        raise InputError(f"mask: expected the shape of the {name}'s image, {points.shape[:2]}, but got {mask.shape}")
    if out is None:
        out = points if points.flags.writeable else np.empty_like(points)
    for rows in slices(points, stop):
        if out is not points:
            out[rows] = points[rows]
        out[rows][mask[rows]] = np.nan
    return out


def clean(
    points: Cloud,
    mold_from_scanner: NDArray[np.float64] | None,
    camera: tuple[float, float, float] | None,
    recipe: Recipe,
    stop: _core.Stop,
) -> Cloud:
    """Remove a cloud's outliers, and move it into the mold's frame: in place, or into new memory if it is read-only.

    Its memory belongs to the caller alone, or nobody can write into it. If it comes from the camera (f, cx, cy), in
    pixels, neighbours are found in its image, twenty times faster and with the same decisions. None means that it does
    not come from a pinhole camera.
    """
    threads = recipe.run.threads
    keep = _core.cloud.remove_outliers(points, options.outliers(recipe), threads, stop, camera)
    pose = np.eye(4) if mold_from_scanner is None else mold_from_scanner
    out = points if points.flags.writeable else np.empty_like(points)
    _core.cloud.move_kept(points, out, keep, pose, threads, stop)
    return out
