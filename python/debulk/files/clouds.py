"""Point clouds in and out of files: the contents of a file are checked before anything is computed from them."""

from __future__ import annotations

import logging
import time
import warnings
from collections.abc import Callable
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk._core import InputError
from debulk.arguments import typed
from debulk.files import npy, pcd, ply, ptx, text
from debulk.files.kinds import TEXT, check_kind, refuse_ending
from debulk.files.packed import PACKED, unpacked
from debulk.files.replacing import replacing
from debulk.files.source import Points, Source, open_source
from debulk.files.units import Unit, check_size, factor
from debulk.foreign import points_of
from debulk.origin import resolution_mm, shift_of

log = logging.getLogger("debulk")
_READERS: dict[str, Callable[[Source, float], Points]] = {
    ".npy": npy.read_npy, ".npz": npy.read_npz, ".ply": ply.read_ply, ".pcd": pcd.read_pcd,
    **dict.fromkeys(TEXT, text.read_text), ".ptx": ptx.read_ptx,
}  # fmt: skip
_WRITERS: dict[str, Callable[[Path, NDArray[np.float32]], None]] = {
    ".npy": npy.write_npy, ".npz": npy.write_npz, ".ply": ply.write_ply, ".pcd": pcd.write_pcd,
    **{extension: partial(text.write_text, extension=extension) for extension in TEXT if extension != ".pts"},
}  # fmt: skip
_FAR_MM = 1e7  # ten kilometres: no scanner sees that far, so the file or its unit is wrong
_FARTHEST_MM = 1e10  # ten thousand kilometres: no map's northing is larger
_FEW = 3  # points may lie at the origin by rounding; more are a mark, since no two points of a scan share a place


class CloudWarning(UserWarning):
    """Says what a file holds beside its points, such as a pose that is not applied."""


@typed
def load_cloud(path: str | PathLike[str], unit: Unit = "mm") -> NDArray[np.floating[Any]]:
    """Read a point cloud.

    Parameters
    ----------
    path
        A .npy, .npz, .ply, .pcd, .ptx, .xyz, .csv, .txt, .pts or .asc file, or one of these packed by gzip (.pcd.gz and
        so on). A PCD may be binary, compressed or text. A PLY may be binary, of either byte order, or text; its shape
        may come from a range_grid, num_cols and num_rows, PCL's camera or a comment. Both may have their fields in any
        order, more fields than x, y, z, capital letters, and numbers of any type. Arrays are float32 or float64, of
        either byte order, by rows or by columns: (H, W, 3) or (N, 3), or with four values per point, of which the first
        three are taken, or (3, N) or (3, H, W); or arrays of records with fields x, y, z. A .npz holds a single array,
        or one called points, cloud, scan, xyz, point_cloud or pcd, or X, Y and Z. Each line of text is a point, with
        numbers separated by blanks, tabs, commas or semicolons. The coordinates are in the first three columns, or in
        those that a line of names calls x, y, z. Nothing is ever unpickled. For a matrix of heights see `load_heights`.
    unit
        Unit of the numbers in the file, "mm" or "m".

    Returns
    -------
    (H, W, 3) if the file marks the cloud as organised, otherwise (N, 3); mm; NaN where nothing was seen. The points are
    float32; or float64, if the file has that precision and all points lie farther than `debulk.origin.FAR_MM` (32.8 m)
    from the origin along an axis, where float32 would round them by more than 0.002 mm. An Inspector takes both.

    Warns
    -----
    CloudWarning
        If the file holds something that the points do not show: a VIEWPOINT or another pose, which is never applied,
        faces of a mesh, or more than three points at (0, 0, 0), which are read as NaN.

    Raises
    ------
    InputError
        If the file cannot be read, is cut off, is not what it claims to be, holds infinite or absurdly far points or
        none at all, or is too small or too large for a scan in this unit. The message names the file, the byte or the
        line, and a remedy. Sizes are checked before memory is allocated.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "scan.pcd"
    >>> save_cloud(path, 100 * np.random.default_rng(0).random((2, 5, 3)))
    >>> load_cloud(path).shape
    (2, 5, 3)
    """
    points = read_cloud(Path(path), unit)
    for note in points.notes:
        warnings.warn(f"{path}: {note}", CloudWarning, stacklevel=3)  # past the check of the arguments
    return points.values


def read_cloud(path: Path, unit: Unit) -> Points:
    """Do what `load_cloud` does, but return its warnings as notes with the points."""
    mm_per_unit = factor(unit)
    extension, packed = _ending(path)
    began = time.perf_counter()
    with open_source(path) as source:
        if extension not in _READERS:
            known = ", ".join(_READERS)
            if packed:
                got = extension or "no ending"
                source.fail(0, f"expected a file ending in {known} before {PACKED}, got {got!r}", "rename it")
            refuse_ending(source, extension, known)
        if packed:
            with unpacked(source) as inner:
                points = _read(inner, extension, mm_per_unit, unit)
        else:
            points = _read(source, extension, mm_per_unit, unit)
    log.debug("reading %s: %.1f ms", path, 1e3 * (time.perf_counter() - began))
    for note in points.notes:
        log.info("%s: %s", path, note)
    return points


def named_as_cloud(path: Path) -> bool:
    """Return whether a file's name ends as those of clouds do."""
    return _ending(path)[0] in _READERS


def _ending(path: Path) -> tuple[str, bool]:
    """Return the ending of a file's name, without that of gzip, and whether that is there, too."""
    packed = path.suffix.lower() == PACKED
    return (path.with_suffix("") if packed else path).suffix.lower(), packed


def _read(source: Source, extension: str, mm_per_unit: float, unit: Unit) -> Points:
    check_kind(source, extension)
    points = _READERS[extension](source, mm_per_unit)
    _check_plausible(source, points, unit)
    if points.at_origin <= _FEW:
        return points
    points.values[(points.values == 0).all(axis=-1)] = np.nan
    return points.noted(f"{points.at_origin} of its points lie at (0, 0, 0): they are read as NaN, nothing seen")


@typed
def save_cloud(path: str | PathLike[str], points: ArrayLike) -> None:
    """Write a point cloud, in mm, as float32; shape and NaN are kept.

    Parameters
    ----------
    path
        Name of the file, which ends in .npy, .npz, .ply, .pcd (all binary) or, for unorganised points, .xyz, .csv,
        .txt or .asc. An existing file is replaced only when the new one is complete.
    points
        (H, W, 3) or (N, 3), mm, as an inspector takes them. A single row (1, W, 3) is read back from .pcd as (W, 3).

    Raises
    ------
    InputError
        If the ending or the shape is another, the points are so far from the origin that float32 would round them, or
        the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> x, y = np.meshgrid(np.arange(40.0), np.arange(30.0))
    >>> points = np.dstack([x, y, 0 * x]).astype(np.float32)
    >>> points[0, 0] = np.nan  # nothing seen
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save_cloud(Path(folder) / "scan.pcd", points)
    ...     again = load_cloud(Path(folder) / "scan.pcd")
    >>> bool(np.array_equal(again, points, equal_nan=True))
    True
    """
    path = Path(path)
    values = points_of(points, "points")
    if path.suffix.lower() not in _WRITERS:
        raise InputError(f"{path}: expected a file ending in {', '.join(_WRITERS)}")
    if values.size == 0:
        raise InputError(f"points: expected at least one point, but got shape {values.shape}")
    if values.dtype.itemsize == 8 and (shift := shift_of(values)) is not None:
        step = resolution_mm(float(np.abs(shift).max()))
        raise InputError(
            f"points: expected points near the origin, but got some that float32 rounds by up to {step:.2g} mm; "
            "subtract the same offset from all clouds, or numpy.save() them as float64"
        )
    if values.ndim == 3 and path.suffix.lower() in TEXT:
        raise InputError(f"{path}: text has no rows of an image; give points.reshape(-1, 3), or another ending")
    with replacing(path) as temporary:
        _WRITERS[path.suffix.lower()](temporary, np.ascontiguousarray(values, dtype=np.float32))


def _check_plausible(source: Source, points: Points, unit: Unit) -> None:
    """Refuse points that cannot be a scan, and sizes that suggest another unit."""
    low, high = np.array(points.low), np.array(points.high)
    if (low > high).any():
        source.fail(0, "no point has three numbers: nothing was seen", "check the scanner and its export")
    most = _FAR_MM if points.values.dtype == np.float32 else _FARTHEST_MM
    if max(high.max(), -low.min()) > most:
        flat = points.values.reshape(-1)
        place = int(np.argmax(np.abs(flat) > most))  # false for NaN
        raise InputError(
            f"{source.path}: point {place // 3}: {'xyz'[place % 3]} = {flat[place]:g} mm, expected at most "
            f"{most:g}; write NaN where nothing was seen, and check the unit ({unit})"
        )
    size_mm = float((high - low).max())
    if points.values.size > 3 and size_mm == 0:
        where = ", ".join(f"{value:g}" for value in low)
        source.fail(0, f"all points seen lie at ({where})", "check the scanner and its export")
    if points.values.size > 3:
        check_size(source.path, size_mm, "cloud", unit)
