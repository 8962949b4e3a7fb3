"""Masks of an image: a grey or colour .png, or a .npy of bool or uint8. Everything that is not zero is masked."""

from __future__ import annotations

import math
import struct
import zlib
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError
from debulk.arguments import typed
from debulk.files import npy
from debulk.files.source import Source, open_source

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}  # by PNG colour type (4 and 6 are grey and colour with alpha)
_DEPTHS = {0: (1, 2, 4, 8, 16), 2: (8, 16), 3: (1, 2, 4, 8), 4: (8, 16), 6: (8, 16)}
_MAX_PIXELS = 1 << 28
_MAX_PNG_BYTES = 1 << 30
_STEP_BYTES = 1 << 20
_PNG_REMEDY = "save it again as a grey 8-bit PNG"
_NPY_REMEDY = "save it with numpy.save as (H, W) bool"


@typed
def load_mask(path: str | PathLike[str]) -> NDArray[np.bool_]:
    """Read a mask of the scanner's image, which marks everything that is not the ply: clamps, tools.

    Parameters
    ----------
    path
        A .png of 1 to 16 bits, grey, coloured or with a palette, masked where it is not black (transparency is
        ignored), or a .npy of (H, W) bool or uint8, masked where it is not zero.

    Returns
    -------
    (H, W) bool, true where the image is masked, by row and column of an organised cloud's points.

    Raises
    ------
    InputError
        If the file cannot be read, is damaged, or is not what it claims to be. Sizes are checked before memory is
        allocated.

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
    readers = {".png": read_mask_png, ".npy": read_mask_npy}
    extension = path.suffix.lower()
    if extension not in readers:
        raise InputError(f"{path}: expected a mask ending in {', '.join(readers)}, got {extension or 'no ending'!r}")
    with open_source(path) as source:
        return readers[extension](source)


def read_mask_npy(source: Source) -> NDArray[np.bool_]:
    """Read an (H, W) array of bool, or of uint8, which counts as true where it is not zero."""
    shape, fortran, dtype = npy.read_header(source, source.file, 0)
    if dtype not in (np.dtype(bool), np.dtype(np.uint8)):
        source.fail(0, f"expected bool or uint8, got {str(dtype)[:60]}", _NPY_REMEDY)
    if len(shape) != 2 or min(shape) < 0:
        source.fail(0, f"expected the shape (H, W), got {str(shape)[:60]}", _NPY_REMEDY)
    source.check_size(source.file.tell(), math.prod(shape), 1, exact=True, what="pixels")
    values = npy.read_values(source, np.dtype(np.uint8), math.prod(shape))
    return np.ascontiguousarray(npy.reshaped(values, shape, fortran) != 0)


def read_mask_png(source: Source) -> NDArray[np.bool_]:
    """Read a .png; true where any of its colours is not black. Transparency is ignored."""
    image = decode_png(source)
    if image.ndim == 2:
        return np.asarray(image != 0)
    return np.asarray((image[..., : min(3, image.shape[2])] != 0).any(axis=2))


def decode_png(source: Source) -> NDArray[Any]:
    """Read a .png as (H, W) or (H, W, channels), once its chunks are known to be whole."""
    import cv2

    if source.size > _MAX_PNG_BYTES:
        source.fail(0, f"a .png of {source.size} bytes, expected at most {_MAX_PNG_BYTES}", _PNG_REMEDY)
    data = source.file.read(source.size)
    height, width = _check_png(source, data)
    try:
        image: NDArray[Any] | None = cv2.imdecode(np.frombuffer(data, dtype=np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error:
        image = None
    if image is None or image.shape[:2] != (height, width):
        source.fail(0, "OpenCV cannot decode this .png", _PNG_REMEDY)
    return image


def _check_png(source: Source, data: bytes) -> tuple[int, int]:
    """Check all chunks before OpenCV sees them: they must be complete, undamaged, and of the size in the header."""
    if not data.startswith(_SIGNATURE):
        source.fail(0, "the file does not start like a .png", _PNG_REMEDY)
    offset, promised, size = len(_SIGNATURE), 0, (0, 0)
    unpack, unpacked = zlib.decompressobj(), 0
    while True:
        if offset + 12 > len(data):
            source.fail(len(data), "the .png ends within its chunks", "copy it again")
        length, kind = struct.unpack_from(">I4s", data, offset)
        if length > len(data) - offset - 12:
            source.fail(offset, "a chunk of the .png is longer than the file", "copy it again")
        body = memoryview(data)[offset + 8 : offset + 8 + length]
        if zlib.crc32(kind + bytes(body)) != struct.unpack_from(">I", data, offset + 8 + length)[0]:
            source.fail(offset, "a chunk of the .png is damaged (its checksum is wrong)", "copy it again")
        if (kind == b"IHDR") != (promised == 0):
            source.fail(offset, "expected one IHDR chunk, and first in the .png", _PNG_REMEDY)
        if kind == b"IHDR":
            size, promised = _promised_bytes(source, offset, bytes(body))
        elif kind == b"IDAT":
            try:
                rest: bytes | memoryview = body
                while rest and unpacked <= promised:
                    unpacked += len(unpack.decompress(rest, _STEP_BYTES))
                    rest = unpack.unconsumed_tail
            except zlib.error:
                source.fail(offset, "the pixels of the .png are damaged", "copy it again")
        elif kind == b"IEND":
            break
        offset += 12 + length
    if unpacked <= promised:
        unpacked += len(unpack.flush())  # zlib may hold back the last bytes after its input has ended
    if unpacked != promised:
        more = "more" if unpacked > promised else f"only {unpacked}"
        source.fail(offset, f"the .png promises {promised} bytes of pixels and holds {more}", _PNG_REMEDY)
    return size


def _promised_bytes(source: Source, offset: int, header: bytes) -> tuple[tuple[int, int], int]:
    if len(header) != 13:
        source.fail(offset, "the header of the .png has another length", _PNG_REMEDY)
    width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", header)
    if depth not in _DEPTHS.get(colour, ()):
        source.fail(offset, f"a .png of colour type {colour} with {depth} bits", _PNG_REMEDY)
    if interlaced:
        source.fail(offset, "an interlaced .png", f"{_PNG_REMEDY}, not interlaced")
    if not 0 < width * height <= _MAX_PIXELS:
        source.fail(offset, f"a .png of {width} x {height} pixels, expected 1 to {_MAX_PIXELS}", _PNG_REMEDY)
    promised = height * (1 + (width * depth * _CHANNELS[colour] + 7) // 8)
    if promised > source.size * npy.MAX_DEFLATE_RATIO:
        source.fail(offset, f"{width} x {height} pixels cannot be in {source.size} bytes", "copy it again")
    return (height, width), promised
