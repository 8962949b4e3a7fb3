"""NumPy's own file formats, .npy and .npz, never with pickled objects."""

from __future__ import annotations

import math
import warnings
import zipfile
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.lib import format as npy_format
from numpy.typing import NDArray

from debulk import _core
from debulk._core import InputError
from debulk.files.source import MAX_POINTS, Layout, Points, Source

_REMEDY = "save it with numpy.save as (H, W, 3) or (N, 3) float32"
_NAMES = ("points", "cloud", "scan", "xyz", "arr_0")
_MOST_UNPACKED_BYTES = 1 << 32
_STEP_BYTES = 1 << 24
MAX_DEFLATE_RATIO = 1100  # deflate cannot compress by more than 1032


def read_npy(source: Source, factor: float) -> Points:
    """Read the array of a .npy file."""
    shape, fortran, dtype = read_header(source, source.file, 0)
    offset = source.file.tell()
    _check_kind(source, offset, shape, dtype)
    count, item = math.prod(shape) // 3, dtype.itemsize
    source.check_size(offset, count, 3 * item, exact=True)
    if fortran and count > 1:
        return _summarised(_array(source, offset, shape, dtype), factor)
    layout = Layout(3 * item, (0, item, 2 * item), (item, item, item), dtype.byteorder == ">")
    points = source.points(offset, count, layout, factor)
    return points.organised(*shape[:2]) if len(shape) == 3 else points


def read_npz(source: Source, factor: float) -> Points:
    """Read the only array of a .npz file, or the one called points, cloud, scan or xyz."""
    try:
        with zipfile.ZipFile(source.file) as archive:
            members = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
            name = next((name for name in _NAMES if name in members), None)
            if len(members) == 1:
                name = next(iter(members))
            if name is None:
                listed = ", ".join(members)[:120]
                source.fail(0, f"expected one array, or one called points, got {listed or 'none'}", _REMEDY)
            return _summarised(_member(source, archive, members[name], name), factor)
    except (InputError, OSError, MemoryError):
        raise
    except Exception as error:  # a damaged archive raises errors of zipfile, zlib, struct, ...: all mean the same
        return source.fail(0, f"not a readable .npz archive: {' '.join(str(error).split())[:120]}")


def _member(source: Source, archive: zipfile.ZipFile, info: zipfile.ZipInfo, name: str) -> NDArray[np.float32]:
    offset = info.header_offset
    if info.file_size > max(info.compress_size, 1) * MAX_DEFLATE_RATIO or info.compress_size > source.size:
        source.fail(offset, f"array {name[:40]!r}: the archive's sizes are impossible")
    if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):  # other methods expand without a bound
        source.fail(offset, f"array {name[:40]!r}: compressed by a method that NumPy does not use", _REMEDY)
    with archive.open(info) as member:
        shape, fortran, dtype = read_header(source, member, offset)  # type: ignore[arg-type]
        _check_kind(source, offset, shape, dtype)
        count = math.prod(shape)
        need, have = count * dtype.itemsize, info.file_size - member.tell()
        if have != need:
            source.fail(offset, f"array {name[:40]!r}: its header promises {need} bytes, the archive {have}")
        if not 0 < count // 3 <= MAX_POINTS:
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
    return _shaped(values, shape, fortran)


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


def _check_kind(source: Source, offset: int, shape: tuple[int, ...], dtype: np.dtype[Any]) -> None:
    if dtype.hasobject or dtype.kind != "f" or dtype.itemsize not in (4, 8):
        source.fail(offset, f"expected float32 or float64, got {str(dtype)[:60]}", _REMEDY)
    if len(shape) not in (2, 3) or shape[-1] != 3 or min(shape) < 0:
        source.fail(offset, f"expected the shape (H, W, 3) or (N, 3), got {str(shape)[:60]}", _REMEDY)


def _array(source: Source, offset: int, shape: tuple[int, ...], dtype: np.dtype[Any]) -> NDArray[np.float32]:
    """Read an array that is stored column by column: first all values as stored, then the points from them."""
    source.file.seek(offset)
    values = np.fromfile(source.file, dtype=dtype, count=math.prod(shape))
    if values.size != math.prod(shape):
        source.fail(offset + values.nbytes, "the file ended while it was read")
    return _shaped(values, shape, fortran=True)


def _shaped(values: NDArray[Any], shape: tuple[int, ...], fortran: bool) -> NDArray[np.float32]:
    values = values.reshape(shape[::-1]).T if fortran else values.reshape(shape)
    with np.errstate(over="ignore", invalid="ignore"):  # an overflow is found afterwards as an infinite value
        return np.require(values, dtype=np.float32, requirements=["C", "W"])


def _summarised(values: NDArray[np.float32], factor: float) -> Points:
    return Points(values, *_core.files.scale_and_summarise(values.reshape(-1, 3), factor, 0))
