"""Files in and out: clouds, poses, outlines. Nothing in a file is trusted, and a bad one gives one clear error."""

from __future__ import annotations

import logging
import math
import time
from collections.abc import Callable
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import arrays
from debulk._core import InputError
from debulk.arguments import of_type, typed
from debulk.files import mask, npy, pcd, ply, text
from debulk.files.kinds import TEXT, check_kind
from debulk.files.replacing import replacing
from debulk.files.source import Points, Source, open_source

log = logging.getLogger("debulk")
Unit = Literal["mm", "m"]
_MM_PER_UNIT = {"mm": 1.0, "m": 1000.0}
_READERS: dict[str, Callable[[Source, float], Points]] = {
    ".npy": npy.read_npy, ".npz": npy.read_npz, ".ply": ply.read_ply, ".pcd": pcd.read_pcd,
    **dict.fromkeys(TEXT, text.read_text),
}  # fmt: skip
_WRITERS: dict[str, Callable[[Path, NDArray[np.float32]], None]] = {
    ".npy": npy.write_npy, ".npz": npy.write_npz, ".ply": ply.write_ply, ".pcd": pcd.write_pcd,
    **{extension: partial(text.write_text, extension=extension) for extension in TEXT},
}  # fmt: skip
_FAR_MM = 1e7  # ten kilometres: no scanner sees so far, so the file or its unit is wrong
_LEAST_SIZE_MM = 10.0  # a cloud in metres, given as mm, is smaller
_MOST_SIZE_MM = 1e5  # a cloud in mm, given as metres, is larger
_FEW_POINTS, _MOST_AT_ORIGIN = 20, 0.001  # no two points of a scan share a place
_MAX_TEXT_BYTES = 1 << 24


@typed
def load_cloud(path: str | PathLike[str], unit: Unit = "mm") -> NDArray[np.float32]:
    """Read a point cloud.

    Parameters
    ----------
    path
        A .npy, .npz, .ply, .pcd, .xyz, .csv or .txt file. PCD may be binary, compressed or text; PLY binary, of either
        byte order, or text; both with their fields in any order and more than x, y, z. Arrays are float32 or float64,
        of either byte order, by rows or by columns; a .npz holds one, or one called points. A line of an .xyz, .csv
        or .txt is a point, its numbers parted by blanks, commas or semicolons, in the first three columns or in those
        that a line of names calls x, y, z. Nothing is ever unpickled.
    unit
        Unit of the numbers in the file, "mm" or "m".

    Returns
    -------
    (H, W, 3) float32 where the file says that the cloud is organised, else (N, 3); mm, NaN = nothing seen.

    Raises
    ------
    InputError
        If the file cannot be read, is cut off, is not what it claims to be, holds infinite or absurdly far points or
        none at all, or is too small or too large for a scan in this unit: names the file, the byte or the line, and a
        remedy. Sizes are checked before memory is taken.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "scan.pcd"
    >>> save_cloud(path, 100 * np.random.default_rng(0).random((2, 5, 3)))
    >>> load_cloud(path).shape
    (2, 5, 3)
    """
    path = Path(path)
    factor = _factor(unit)
    extension = path.suffix.lower()
    if extension not in _READERS:
        raise InputError(f"{path}: expected a file ending in {', '.join(_READERS)}, got {extension or 'no ending'!r}")
    began = time.perf_counter()
    with open_source(path) as source:
        check_kind(source, extension)
        points = _READERS[extension](source, factor)
        _check_plausible(source, points, unit)
    log.debug("reading %s: %.1f ms", path, 1e3 * (time.perf_counter() - began))
    return points.values


@typed
def save_cloud(path: str | PathLike[str], points: ArrayLike) -> None:
    """Write a point cloud, in mm, as float32; shape and NaN are kept.

    Parameters
    ----------
    path
        Ends in .npy, .npz, .ply, .pcd (all binary) or, for unorganised points, .xyz, .csv or .txt. An existing file is
        replaced only when the new one is complete.
    points
        (H, W, 3) or (N, 3), mm. A single row (1, W, 3) comes back from .pcd as (W, 3).

    Raises
    ------
    InputError
        If the ending or the shape is another, or the file cannot be written.

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
    values = np.asarray(points)
    if path.suffix.lower() not in _WRITERS:
        raise InputError(f"{path}: expected a file ending in {', '.join(_WRITERS)}")
    if values.dtype.kind != "f" or values.ndim not in (2, 3) or values.shape[-1] != 3 or values.size == 0:
        got = f"{values.dtype}, shape {values.shape}" if values.ndim else of_type(points)
        raise InputError(f"points: expected (H, W, 3) or (N, 3) floats, but got {got}")
    if values.ndim == 3 and path.suffix.lower() in TEXT:
        raise InputError(f"{path}: text has no rows of an image; give points.reshape(-1, 3), or another ending")
    with replacing(path) as temporary:
        _WRITERS[path.suffix.lower()](temporary, np.ascontiguousarray(values, dtype=np.float32))


@typed
def load_pose(path: str | PathLike[str], unit: Unit = "mm") -> NDArray[np.float64]:
    """Read a rigid transform, x_mold = T x_scanner: four lines of four numbers.

    Parameters
    ----------
    path
        Text; numbers parted by blanks or commas; ``#`` starts a comment.
    unit
        Unit of the translation in the file.

    Returns
    -------
    (4, 4) with the translation in mm.

    Raises
    ------
    InputError
        If it is not a rotation and a translation: mirrored, scaled or sheared.

    Examples
    --------
    >>> import tempfile
    >>> pose = np.eye(4)
    >>> pose[:3, 3] = 0.5, 0, -1.2
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     np.savetxt(Path(folder) / "pose.txt", pose)
    ...     load_pose(Path(folder) / "pose.txt", "m")[:3, 3].tolist()
    [500.0, 0.0, -1200.0]
    """
    path = Path(path)
    pose = _numbers(path, header=False)
    if pose.shape != (4, 4):
        raise InputError(f"{path}: expected four lines of four numbers, got {pose.shape[0]} of {pose.shape[1]}")
    pose = arrays.rigid(pose, str(path))
    pose[:3, 3] *= _factor(unit)
    return pose


@typed
def load_outline(path: str | PathLike[str], unit: Unit = "mm") -> NDArray[np.float64]:
    """Read the ply's outline: a line "x,y" for each corner, in order, in the mold frame.

    Parameters
    ----------
    path
        CSV; one line of names may come first. The last corner may repeat the first.
    unit
        Unit of the numbers in the file.

    Returns
    -------
    (M, 2), mm, M at least 3, closed from the last to the first.

    Raises
    ------
    InputError
        If there are fewer than three corners, or they enclose nothing, or cross each other's sides.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     corners = [(0, 0), (400, 0), (400, 300), (0, 0)]
    ...     np.savetxt(Path(folder) / "outline.csv", corners, delimiter=",", header="x,y", comments="")
    ...     load_outline(Path(folder) / "outline.csv").tolist()
    [[0.0, 0.0], [400.0, 0.0], [400.0, 300.0]]
    """
    path = Path(path)
    outline = _numbers(path, header=True)
    if outline.shape[1] != 2:
        raise InputError(f"{path}: expected two columns x,y, got {outline.shape[1]}")
    outline *= _factor(unit)
    if len(outline) >= 3:
        _check_size(path, float(np.ptp(outline, axis=0).max()), "outline", unit)
    return arrays.outline(outline, str(path))


@typed
def load_mask(path: str | PathLike[str]) -> NDArray[np.bool_]:
    """Read a mask of the scanner's image, drawn over what is not the ply: clamps, tools.

    Parameters
    ----------
    path
        A .png of 1 to 16 bits, grey, coloured or with a palette, masked where it is not black (transparency is not
        looked at), or a .npy of (H, W) bool or uint8, masked where it is not zero.

    Returns
    -------
    (H, W) bool, true where the image is masked: row and column of an organised cloud's points.

    Raises
    ------
    InputError
        If the file cannot be read, is damaged, or is not what it claims to be; sizes are checked before memory is
        taken.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "clamps.npy"
    >>> np.save(path, np.eye(2, 3, dtype=bool))
    >>> load_mask(path)
    array([[ True, False, False],
           [False,  True, False]])
    """
    path = Path(path)
    readers = {".png": mask.read_mask_png, ".npy": mask.read_mask_npy}
    extension = path.suffix.lower()
    if extension not in readers:
        raise InputError(f"{path}: expected a mask ending in {', '.join(readers)}, got {extension or 'no ending'!r}")
    with open_source(path) as source:
        return readers[extension](source)


def _factor(unit: str) -> float:
    if not isinstance(unit, str) or unit not in _MM_PER_UNIT:
        raise InputError(f'unit: expected "mm" or "m", got {unit!r}')
    return _MM_PER_UNIT[unit]


def _check_plausible(source: Source, points: Points, unit: Unit) -> None:
    """Refuse points that cannot be a scan, and sizes that suggest another unit."""
    low, high = np.array(points.low), np.array(points.high)
    if (low > high).any():
        source.fail(0, "no point has three numbers: nothing was seen", "check the scanner and its export")
    if max(high.max(), -low.min()) > _FAR_MM:
        flat = points.values.reshape(-1)
        place = int(np.argmax(np.abs(flat) > _FAR_MM))  # NaN is not greater
        raise InputError(
            f"{source.path}: point {place // 3}: {'xyz'[place % 3]} = {flat[place]:g} mm, expected at most "
            f"{_FAR_MM:g}; write NaN where nothing was seen, and check the unit ({unit})"
        )
    size_mm = float((high - low).max())
    if points.values.size > 3 and size_mm == 0:
        where = ", ".join(f"{value:g}" for value in low)
        source.fail(0, f"all points seen lie at ({where})", "check the scanner and its export")
    if points.sampled >= _FEW_POINTS and points.at_origin > points.sampled * _MOST_AT_ORIGIN:
        share = points.at_origin / points.sampled
        source.fail(0, f"{share:.1%} of the points lie at (0, 0, 0)", "write NaN where nothing was seen")
    if points.values.size > 3:
        _check_size(source.path, size_mm, "cloud", unit)


def _check_size(path: Path, size_mm: float, what: str, unit: Unit) -> None:
    """Hold the largest extent against what can be scanned: a wrong unit is a factor of 1000."""
    other: Unit = "m" if unit == "mm" else "mm"
    small, large = size_mm < _LEAST_SIZE_MM, size_mm > _MOST_SIZE_MM
    if not (small or large):
        return
    remedy = "check the unit of the export"
    if small == (unit == "mm"):
        remedy = f'if its numbers are in {other}, give unit="{other}" (--unit {other})'
    across, limit = size_mm / _MM_PER_UNIT[unit], "small" if small else "large"
    raise InputError(f"{path}: the {what} is {across:g} {unit} across, too {limit} for a scanned ply; {remedy}")


def _numbers(path: Path, *, header: bool) -> NDArray[np.float64]:
    """Read a small table of finite numbers from text."""
    with open_source(path) as source:
        if source.size > _MAX_TEXT_BYTES:
            raise InputError(f"{path}: expected a small text file, got {source.size} bytes")
        text = source.file.read().decode("utf-8-sig", errors="replace")
    rows: list[list[float]] = []
    for number, line in enumerate(text.splitlines(), start=1):
        words: list[Any] = line.split("#")[0].replace(",", " ").replace(";", " ").split()
        if not words:
            continue
        try:
            row = [float(word) for word in words]
        except ValueError:
            if header and not rows:
                header = False
                continue
            raise InputError(f"{path}: line {number}: expected numbers, got {line.strip()[:60]!r}") from None
        if not all(map(math.isfinite, row)) or (rows and len(row) != len(rows[0])):
            raise InputError(f"{path}: line {number}: expected finite numbers, as many as above, got {line[:60]!r}")
        rows.append(row)
    if not rows:
        raise InputError(f"{path}: expected a table of numbers, got none")
    return np.array(rows, dtype=np.float64)
