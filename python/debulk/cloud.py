"""Point clouds: rigid motion, outlier removal, pitch.

A cloud is an array of points in mm: (H, W, 3) as an organised scanner delivers it, one point per pixel, or (N, 3) in
any order. A point with a coordinate that is not finite is missing, because nothing was seen there. The functions
compute on float32, without a copy if the array is C-contiguous float32, and never change their input. They also take
what `from_memory` takes. `threads` is the number of threads, 0 as many as the process may use, on which no result
depends. Cancelling a `stop` from another thread ends a computation with a RuntimeError.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, arrays, foreign, origin
from debulk.arguments import typed

_OUTLIERS = _core.cloud.OutlierOptions()  # each default is defined only in cpp/debulk/cloud/outliers.hpp

InputError = _core.InputError

SMALLEST_EXTENT_MM = 10.0
"""`checked` takes a cloud smaller than this for one in metres."""


@typed
def from_memory(points: Any, unit: Literal["mm", "m"] = "mm", name: str = "points") -> NDArray[np.floating[Any]]:
    """Convert a cloud that another program holds in memory into an array of points in mm.

    Parameters
    ----------
    points
        An array (H, W, 3) or (N, 3); a NumPy array of records with fields x, y, z (or X, Y, Z, or f0, f1, f2, or one
        field xyz, points or position of three numbers), (H, W) or (N,); a ``sensor_msgs/PointCloud2`` message of ROS or
        rosbags; a point cloud of Open3D; or anything that speaks DLPack, in the memory of the CPU.
    unit
        Unit of its numbers. Messages of ROS are in metres by convention, and so are clouds of RealSense.
    name
        What the cloud is called in error messages.

    Returns
    -------
    (H, W, 3) or (N, 3), float32 or float64, mm, NaN where nothing was seen; a view of the same memory if nothing had to
    be converted.

    Raises
    ------
    InputError
        If x, y, z cannot be had from it, or the unit is another.

    Examples
    --------
    >>> records = np.array([(0.5, 0.25, 2.0)], dtype=[("x", "f4"), ("y", "f4"), ("z", "f4")])
    >>> from_memory(records, unit="m").tolist()
    [[500.0, 250.0, 2000.0]]
    """
    if unit not in ("mm", "m"):
        raise InputError(f'unit: expected "mm" or "m", got {unit!r}')
    array = foreign.points_of(points, name)
    return array if unit == "mm" else array * array.dtype.type(1000)


def checked(points: ArrayLike, name: str = "points", *, check_unit: bool = True) -> NDArray[np.float32]:
    """Check a cloud and bring it into the form that the package computes on.

    Parameters
    ----------
    points
        (H, W, 3) or (N, 3), float32 or float64, mm.
    name
        What the cloud is called in error messages.
    check_unit
        Whether to refuse a cloud whose extent suggests metres.

    Returns
    -------
    NDArray[np.float32]
        The points, C-contiguous; the same object if it already has that form.

    Raises
    ------
    InputError
        If the shape or type is another, if no point is finite, or if the cloud is smaller than 10 mm.

    Examples
    --------
    >>> checked(np.zeros((4, 2)), "scan")
    Traceback (most recent call last):
    ...
    debulk._core.InputError: scan: expected an (H, W, 3) or (N, 3) array of points, but got shape (4, 2)
    """
    cloud = as_cloud(points, name)
    check_bounds([_core.cloud.bounds(cloud, 0)], cloud.size // 3, name, check_unit=check_unit)
    return cloud


def extent_mm(parts: Sequence[tuple[int, list[float], list[float]]]) -> float:
    """Return the longest side of the box round the parts of a cloud with these bounds; NaN if no point is finite."""
    boxes = np.array([(low, high) for seen, low, high in parts if seen])
    return float((boxes[:, 1].max(axis=0) - boxes[:, 0].min(axis=0)).max()) if len(boxes) else np.nan


def check_bounds(
    parts: Sequence[tuple[int, list[float], list[float]]], count: int, name: str, *, check_unit: bool = True
) -> None:
    """Refuse a cloud of `count` points by the bounds of its parts, in the same way as `checked`."""
    extent = extent_mm(parts)
    if np.isnan(extent):
        raise InputError(f"{name}: expected at least one point with three finite coordinates, but got none of {count}")
    if check_unit and extent < SMALLEST_EXTENT_MM:
        raise InputError(
            f"{name}: expected coordinates in mm, but got a cloud {extent:.4g} across; "
            "if they are metres, pass the points times 1000 (on the command line: --unit m)"
        )


@typed
def transform(
    points: ArrayLike, matrix: ArrayLike, *, threads: int = 0, stop: _core.Stop | None = None
) -> NDArray[np.float32]:
    """Move a cloud into another frame: ``x_to = matrix @ x_from``, computed in double precision.

    Parameters
    ----------
    points
        (H, W, 3) or (N, 3).
    matrix
        (4, 4) rigid motion, row by row; its 3 by 3 part must be a rotation to within 1e-4.

    Returns
    -------
    NDArray[np.float32]
        The moved points in the same shape; missing points are NaN in all three coordinates.

    Raises
    ------
    InputError
        If the cloud is bad, or the matrix scales, shears, mirrors, or has a bottom row other than 0 0 0 1.

    Examples
    --------
    >>> shift = np.eye(4)
    >>> shift[:3, 3] = 10, 20, 30
    >>> transform(np.array([[1.0, 2.0, 3.0]]), shift).tolist()
    [[11.0, 22.0, 33.0]]
    """
    motion = np.asarray(matrix)
    if motion.dtype.kind not in "fiu":
        raise InputError(f"matrix: expected a (4, 4) array of numbers, but got {motion.dtype}")
    moved: NDArray[np.float32] = _core.cloud.transform(
        as_cloud(points, "points"), motion.astype(np.float64), threads, stop or _core.Stop()
    )
    return moved


@typed
def remove_outliers(
    points: ArrayLike,
    neighbours: int = _OUTLIERS.neighbours,
    std_ratio: float = _OUTLIERS.std_ratio,
    *,
    least_ratio: float = _OUTLIERS.least_ratio,
    camera: tuple[float, float, float] | None = None,
    threads: int = 0,
    stop: _core.Stop | None = None,
) -> NDArray[np.bool_]:
    """Find the points to keep, which are those not unusually far from their neighbours.

    A point is removed if the mean distance to its nearest neighbours (itself not counted) exceeds the mean of that
    figure over all points by more than `std_ratio` standard deviations (of the sample, n - 1). MATLAB's ``pcdenoise``
    does the same; the search is exact.

    Parameters
    ----------
    points
        (H, W, 3) or (N, 3). An organised cloud in the frame of its pinhole camera is processed twenty times faster.
    neighbours
        Number of nearest neighbours that are considered, 1 to 1000.
    std_ratio
        Standard deviations above the mean, 0 or more.
    least_ratio
        Points below this multiple of the mean are always kept. 0 reproduces ``pcdenoise``. But in a scan that has
        already been cleaned, the deviation is so small that 0 removes the flanks of steep pockets, where points lie
        farther apart; 2 keeps them.
    camera
        (f, cx, cy) in pixels of the pinhole camera in whose frame an organised cloud is: pixel (row i, column j) looks
        along ((j - cx) / f, (i - cy) / f, 1). Default: fitted. It makes no difference to the result: the four
        neighbours are then found in the image, with a proof that no nearer point lies elsewhere. A cloud that does not
        come from such a camera is searched in space, as with another number of neighbours.

    Returns
    -------
    NDArray[bool]
        (H, W) or (N,): False for outliers and for missing points.

    Raises
    ------
    InputError
        If the cloud or an option is bad.

    Examples
    --------
    >>> x, y = np.meshgrid(np.arange(20.0), np.arange(20.0))
    >>> points = np.dstack([x, y, np.zeros_like(x)])
    >>> points[7, 5, 2] = 9.0
    >>> bool(remove_outliers(points)[7, 5])
    False
    """
    cloud = as_cloud(points, "points")
    options = _core.cloud.OutlierOptions()
    options.neighbours = arrays.whole(neighbours, "neighbours")
    options.std_ratio = float(std_ratio)
    options.least_ratio = float(least_ratio)
    if camera is not None:
        f, cx, cy = arrays.camera(camera)
        camera = float(f), float(cx), float(cy)
    else:
        camera = _core.cloud.fit_pinhole(cloud)
    keep: NDArray[np.uint8] = _core.cloud.remove_outliers(cloud, options, threads, stop or _core.Stop(), camera)
    return keep.view(np.bool_)


@typed
def median_pitch(points: ArrayLike, *, threads: int = 0, stop: _core.Stop | None = None) -> float:
    """Typical distance between neighbouring points of a cloud, mm.

    For an organised cloud it is the median distance between neighbouring pixels, projected on the XY plane. For an
    unorganised one it is the median over the points of the mean distance to the four nearest neighbours.

    Examples
    --------
    >>> x, y = np.meshgrid(np.arange(20.0), np.arange(20.0))
    >>> median_pitch(0.5 * np.dstack([x, y, x]))
    0.5
    """
    return float(_core.cloud.median_pitch(as_cloud(points, "points"), threads, stop or _core.Stop()))


def as_cloud(points: ArrayLike, name: str = "points") -> NDArray[np.float32]:
    """Bring points into the form that the package computes on, like `checked`, but check only shape and type."""
    array = foreign.points_of(points, name)
    if array.dtype.itemsize == 8 and (shift := origin.shift_of(array)) is not None:
        away = float(np.abs(shift).max())
        if away > arrays.LARGEST_MM:
            raise InputError(
                f"{name}: expected coordinates within {arrays.LARGEST_MM / 1000:g} m of the origin, but got a cloud "
                f"about {away:.4g} mm away, where float32 resolves {origin.resolution_mm(away):.2g} mm only; subtract "
                "the same offset from all clouds, or give an Inspector the pose (mold_from_scanner)"
            )
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(array, dtype=np.float32)
