"""NumPy's own files: .npy and .npz, never with pickled objects."""

from __future__ import annotations

import math
import warnings
import zipfile
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.lib import format as npy_format
from numpy.typing import NDArray

from debulk._core import InputError
from debulk.formats.source import Source

_REMEDY = "save it with numpy.save as (H, W, 3) or (N, 3) float32"
_NAMES = ("points", "cloud", "scan", "xyz", "arr_0")
MAX_DEFLATE_RATIO = 1100  # deflate cannot do better than 1032


def read_npy(source: Source) -> NDArray[np.float32]:
    """Read the array of a .npy file."""
    shape, fortran, dtype = read_header(source, source.file, 0)
    offset = source.file.tell()
    _check_kind(source, offset, shape, dtype)
    source.check_size(offset, math.prod(shape) // 3, 3 * dtype.itemsize, exact=True)
    values = np.fromfile(source.file, dtype=dtype, count=math.prod(shape))
    if values.size != math.prod(shape):
        source.fail(offset + values.nbytes, "the file ended while it was read")
    return _shaped(values, shape, fortran)


def read_npz(source: Source) -> NDArray[np.float32]:
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
            info = members[name]
            offset = info.header_offset
            if info.file_size > max(info.compress_size, 1) * MAX_DEFLATE_RATIO or info.compress_size > source.size:
                source.fail(offset, f"array {name!r}: the archive's sizes are impossible")
            with archive.open(info) as member:
                shape, fortran, dtype = read_header(source, member, offset)  # type: ignore[arg-type]
                _check_kind(source, offset, shape, dtype)
                need = math.prod(shape) * dtype.itemsize
                have = info.file_size - member.tell()
                if have != need:
                    source.fail(offset, f"array {name!r}: its header promises {need} bytes, the archive {have}")
                data = member.read()
            if len(data) != need:
                source.fail(offset, f"array {name!r}: {need - len(data)} bytes lack")
            return _shaped(np.frombuffer(data, dtype=dtype), shape, fortran)
    except (InputError, OSError):
        raise
    except Exception as error:  # a damaged archive ends in errors of zipfile, zlib, struct, ...: all mean the same
        return source.fail(0, f"not a readable .npz archive: {' '.join(str(error).split())[:120]}")


def write_npy(path: Path, points: NDArray[np.float32]) -> None:
    """Write a .npy file."""
    with path.open("wb") as file:
        np.save(file, points, allow_pickle=False)


def write_npz(path: Path, points: NDArray[np.float32]) -> None:
    """Write a .npz file with one array called points."""
    with path.open("wb") as file:
        np.savez(file, points=points)


def read_header(source: Source, file: BinaryIO, offset: int) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Return shape, whether it is in Fortran's order, and dtype; the file stands where the data starts."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # of headers that only Python 2 wrote
            version = npy_format.read_magic(file)
            read = npy_format.read_array_header_1_0 if version == (1, 0) else npy_format.read_array_header_2_0
            shape, fortran, dtype = read(file)
    except Exception as error:  # NumPy parses the header with Python's own tokenizer, which has many errors
        return source.fail(offset, f"not a readable .npy header: {' '.join(str(error).split())[:120]}", _REMEDY)
    return tuple(shape), bool(fortran), dtype


def _check_kind(source: Source, offset: int, shape: tuple[int, ...], dtype: np.dtype[Any]) -> None:
    if dtype.hasobject or dtype.kind != "f" or dtype.itemsize not in (4, 8):
        source.fail(offset, f"expected float32 or float64, got {str(dtype)[:60]}", _REMEDY)
    if len(shape) not in (2, 3) or shape[-1] != 3 or min(shape) < 0:
        source.fail(offset, f"expected the shape (H, W, 3) or (N, 3), got {str(shape)[:60]}", _REMEDY)


def _shaped(values: NDArray[Any], shape: tuple[int, ...], fortran: bool) -> NDArray[np.float32]:
    values = values.reshape(shape[::-1]).T if fortran else values.reshape(shape)
    with np.errstate(over="ignore", invalid="ignore"):
        return np.require(values, dtype=np.float32, requirements=["C", "W"])
