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
    """Check a cloud, and return it with NaN where the mask hides it."""
    whole = as_points(points, name, stop)
    _check_bounds(whole, name, stop)
    if mask is None:
        return whole
    check_mask(mask, whole, name)
    out = np.empty_like(whole)
    for rows in slices(whole, stop):
        out[rows] = np.where(mask[rows, :, None], np.float32(np.nan), whole[rows])
    return out


def _check_bounds(points: Cloud, name: str, stop: _core.Stop) -> None:
    """Refuse what `cloud.checked` refuses, but heed the stop, and read no further than to a first piece that passes."""
    parts = []
    for piece in pieces(points, name, stop):
        parts.append(_core.cloud.bounds(piece, 0))
        if cloud.extent_mm(parts) >= cloud.SMALLEST_EXTENT_MM:
            return
    cloud.check_bounds(parts, points.size // 3, name)


def check_mask(mask: NDArray[np.bool_] | None, points: Cloud, name: str) -> None:
    """Refuse a mask whose shape is not that of the cloud's image."""
    if mask is not None and points.shape[:2] != mask.shape:
        raise InputError(f"mask: expected the shape of the {name}'s image, {points.shape[:2]}, but got {mask.shape}")


def hide(points: Cloud, mask: NDArray[np.bool_] | None, name: str, stop: _core.Stop) -> Cloud:
    """Check a cloud, set to NaN what the mask hides, in place where it may be written into, and return it."""
    _check_bounds(points, name, stop)
    check_mask(mask, points, name)
    if mask is None:
        return points
    points = points if points.flags.writeable else points.copy()
    for rows in slices(points, stop):
        points[rows][mask[rows]] = np.nan
    return points


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


def raised(
    scan: NDArray[np.float32],
    mold_from_scanner: NDArray[np.float64] | None,
    offset_mm: float,
    *,
    along_rays: bool,
    stop: _core.Stop | None = None,
) -> NDArray[np.float32]:
    """Return a copy of a scan in the scanner's frame whose points lie higher in the mold's frame, along its z.

    `along_rays` keeps each point on its pixel's ray, as the points of a pinhole camera must be. It then also moves
    sideways, by the offset times the tangent of the ray's angle to z.

    >>> scan = np.array([[0.0, 300.0, 1000.0]], dtype=np.float32)
    >>> raised(scan, np.diag([1.0, -1.0, -1.0, 1.0]), 1.0, along_rays=True).tolist()
    [[0.0, 299.70001220703125, 999.0]]
    """
    up = np.array([0.0, 0.0, 1.0]) if mold_from_scanner is None else mold_from_scanner[2, :3]
    out = np.empty_like(scan)
    for points, moved in zip(pieces(scan, "scan", stop), pieces(out, "scan"), strict=True):
        if not along_rays:
            np.add(points, (offset_mm * up).astype(np.float32), out=moved)
            continue
        with np.errstate(invalid="ignore", divide="ignore"):
            rise = points[..., 0] * up[0] + points[..., 1] * up[1] + points[..., 2] * up[2]
            moved[...] = points * (1 + offset_mm / rise)[..., None]
    return out
