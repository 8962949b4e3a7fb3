"""NumPy's own file formats, .npy and .npz, never with pickled objects.

The array is (H, W, 3) or (N, 3); or it has four values per point, of which the first three are x, y, z (the fourth may
be an intensity, a packed colour, or the 1 of homogeneous coordinates); or it is (3, N) or (3, H, W) by coordinates. The
last length decides: a 3 there is read as x, y, z even if the first is 3, too, and a first 3 with a last 4 is ambiguous
and refused. Arrays of records have fields x, y, z (or X, Y, Z, or f0, f1, f2, or one field of three).
"""

from __future__ import annotations

import math
import warnings
import zipfile
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

import numpy as np
from numpy.lib import format as npy_format
from numpy.typing import NDArray

from debulk._core import InputError
from debulk.files.source import MAX_POINTS, Layout, Points, Source, summarised
from debulk.foreign import coordinates, plain

_REMEDY = "save it with numpy.save as (H, W, 3) or (N, 3) float32"
_NAMES = ("points", "cloud", "scan", "xyz", "point_cloud", "pcd", "positions", "vertices")
_AXES = (("x", "y", "z"), ("X", "Y", "Z"))
_MOST_UNPACKED_BYTES = 1 << 32
_STEP_BYTES = 1 << 24
MAX_DEFLATE_RATIO = 1100  # deflate cannot compress by more than 1032


def read_npy(source: Source, factor: float) -> Points:
    """Read the array of a .npy file."""
    shape, fortran, dtype = read_header(source, source.file, 0)
    offset = source.file.tell()
    _check_form(source, offset, shape, dtype)
    count = math.prod(shape)
    each = 1 if dtype.names else shape[0] if _by_coordinates(shape) else shape[-1]
    source.check_size(offset, count // each if each else 0, each * dtype.itemsize, exact=True)
    layout = None if _by_coordinates(shape) or (fortran and len(shape) > 1 and count > each) else _layout(shape, dtype)
    if layout is None:
        source.file.seek(offset)
        return summarised(_points(read_values(source, dtype, count), shape, fortran), factor)
    points = source.points(offset, count // each, layout, factor)
    lengths = shape if dtype.names else shape[:-1]
    return points.organised(*lengths) if len(lengths) == 2 else points


def read_npz(source: Source, factor: float) -> Points:
    """Read the only array of a .npz file, or the one of a known name, or X, Y and Z."""
    try:
        with zipfile.ZipFile(source.file) as archive:
            members = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
            parts = [_member(source, archive, members[name], name) for name in _chosen(source, list(members))]
    except (InputError, OSError, MemoryError):
        raise
    except Exception as error:  # a damaged archive raises errors of zipfile, zlib, struct, ...: all mean the same
        source.fail(0, f"not a readable .npz archive: {' '.join(str(error).split())[:120]}")
    if len(parts) == 1:
        return summarised(parts[0], factor)
    shapes = [part.shape for part in parts]
    if len(set(shapes)) != 1 or len(shapes[0]) not in (1, 2) or not parts[0].size:
        source.fail(0, f"expected X, Y and Z of one shape, (H, W) or (N,), got {', '.join(map(str, shapes))[:100]}")
    return summarised(np.stack(parts, axis=-1), factor)


def _chosen(source: Source, names: list[str]) -> list[str]:
    """Return the name of the array of points, or the names of the arrays of x, y and z."""
    choices = [[name] for name in _NAMES if name in names]
    choices += [list(axes) for axes in _AXES if all(axis in names for axis in axes)]
    if not choices and len(names) == 1:
        choices = [names]
    if len(choices) != 1:
        listed = ", ".join(names)[:120]
        many = " but only one of these" if choices else ""
        source.fail(
            0, f"expected one array, or one called points, or X, Y and Z{many}, got {listed or 'none'}", _REMEDY
        )
    return choices[0]


def _member(source: Source, archive: zipfile.ZipFile, info: zipfile.ZipInfo, name: str) -> NDArray[Any]:
    offset = info.header_offset
    if info.file_size > max(info.compress_size, 1) * MAX_DEFLATE_RATIO or info.compress_size > source.size:
        source.fail(offset, f"array {name[:40]!r}: the archive's sizes are impossible")
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):  # other methods expand without a bound
        source.fail(offset, f"array {name[:40]!r}: compressed by a method that NumPy does not use", _REMEDY)
    one_axis = any(name in axes for axes in _AXES)
    with archive.open(info) as member:
        shape, fortran, dtype = read_header(source, member, offset)  # type: ignore[arg-type]
        if one_axis:
            _check_number(source, offset, dtype)
        else:
            _check_form(source, offset, shape, dtype)
        count = math.prod(shape)
        need, have = count * dtype.itemsize, info.file_size - member.tell()
        if have != need:
            source.fail(offset, f"array {name[:40]!r}: its header promises {need} bytes, the archive {have}")
        if not 0 < count <= 4 * MAX_POINTS:
            source.fail(offset, f"no points in the file, or more than {MAX_POINTS}", _REMEDY)
        if need > _MOST_UNPACKED_BYTES and need > source.size:
            source.fail(
                offset, f"array {name[:40]!r}: {need} bytes unpacked", "save it as .npy, which is not compressed"
            )
        values = np.empty(count, dtype=dtype)
        room, filled = values.view(np.uint8).data, 0
        while got := member.readinto(room[filled : filled + _STEP_BYTES]):  # type: ignore[attr-defined]
            filled += got
        if filled != need or member.read(1):  # reading to the end also checks the checksum
            source.fail(offset, f"array {name[:40]!r}: {need - filled} bytes lack")
    return reshaped(values, shape, fortran) if one_axis else _points(values, shape, fortran)


def write_npy(path: Path, points: NDArray[np.float32]) -> None:
    """Write a .npy file."""
    with path.open("wb") as file:
        np.save(file, points, allow_pickle=False)


def write_npz(path: Path, points: NDArray[np.float32]) -> None:
    """Write a .npz file with one array called points."""
    with path.open("wb") as file:
        np.savez(file, points=points)


def read_header(source: Source, file: BinaryIO, offset: int) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Return the shape, whether the order is Fortran's, and the dtype; the file is then positioned at the data."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # for headers that only Python 2 wrote
            version = npy_format.read_magic(file)
            read = npy_format.read_array_header_1_0 if version == (1, 0) else npy_format.read_array_header_2_0
            shape, fortran, dtype = read(file)
    except Exception as error:  # NumPy parses the header with Python's tokenizer, which raises many kinds of errors
        return source.fail(offset, f"not a readable .npy header: {' '.join(str(error).split())[:120]}", _REMEDY)
    return tuple(shape), bool(fortran), dtype


def read_values(source: Source, dtype: np.dtype[Any], count: int) -> NDArray[Any]:
    """Read the values that stand from here on, whose number was checked against the file's size."""
    offset = source.file.tell()
    values = np.fromfile(source.file, dtype=dtype, count=count)
    if values.size != count:
        source.fail(offset + values.nbytes, "the file ended while it was read")
    return values


def _check_form(source: Source, offset: int, shape: tuple[int, ...], dtype: np.dtype[Any]) -> None:
    """Refuse arrays in which x, y, z cannot be found."""
    if dtype.names and not dtype.hasobject:
        if coordinates(dtype) is None:
            source.fail(offset, f"expected records with fields x, y, z, got {', '.join(dtype.names)[:60]}", _REMEDY)
        if len(shape) not in (1, 2) or min(shape) < 0:
            source.fail(offset, f"expected records of the shape (H, W) or (N,), got {str(shape)[:60]}", _REMEDY)
        return
    _check_number(source, offset, dtype)
    if len(shape) not in (2, 3) or min(shape) < 0:
        _refuse_shape(source, offset, shape)
    if shape == (4, 4):
        source.fail(
            offset, "expected the shape (H, W, 3) or (N, 3), got a (4, 4) matrix, as a pose is", "give it as the pose"
        )
    if shape[0] == 3 and shape[-1] == 4:
        source.fail(offset, f"{shape} is ambiguous: by coordinates, or four values per point", _REMEDY)
    if not _by_coordinates(shape) and shape[-1] not in (3, 4):
        _refuse_shape(source, offset, shape)


def _refuse_shape(source: Source, offset: int, shape: tuple[int, ...]) -> NoReturn:
    source.fail(offset, f"expected the shape (H, W, 3) or (N, 3), got {str(shape)[:60]}", _REMEDY)


def _check_number(source: Source, offset: int, dtype: np.dtype[Any]) -> None:
    if dtype.hasobject or dtype.kind != "f" or dtype.itemsize not in (4, 8):
        source.fail(offset, f"expected float32 or float64, got {str(dtype)[:60]}", _REMEDY)


def _by_coordinates(shape: tuple[int, ...]) -> bool:
    return len(shape) in (2, 3) and shape[0] == 3 and shape[-1] not in (3, 4)


def _layout(shape: tuple[int, ...], dtype: np.dtype[Any]) -> Layout | None:
    """Return where x, y, z are in what the file holds for a point; None if they differ in byte order."""
    if not dtype.names:
        item = dtype.itemsize
        return Layout(shape[-1] * item, (0, item, 2 * item), [f"f{item}"] * 3, dtype.byteorder == ">")
    found = coordinates(dtype)
    assert found is not None  # as the check of the form has found
    orders = {kind.byteorder == ">" for kind in found[0] if kind.itemsize > 1}
    if len(orders) > 1:
        return None
    return Layout(dtype.itemsize, found[1], [f"{kind.kind}{kind.itemsize}" for kind in found[0]], True in orders)


def reshaped(values: NDArray[Any], shape: tuple[int, ...], fortran: bool) -> NDArray[Any]:
    """Return values in the shape and the order that a header gives."""
    return values.reshape(shape[::-1]).T if fortran else values.reshape(shape)


def _points(values: NDArray[Any], shape: tuple[int, ...], fortran: bool) -> NDArray[Any]:
    """Return (H, W, 3) or (N, 3) of the values of an array whose form has been checked."""
    array = reshaped(values, shape, fortran)
    if array.dtype.names:
        points: NDArray[Any] = plain(array, "array")
        return points
    return np.moveaxis(array, 0, -1) if _by_coordinates(shape) else array[..., :3]
