"""Files in and out: clouds, poses, outlines. Nothing in a file is trusted, and a bad one gives one clear error."""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk._core import InputError
from debulk.formats import mask, npy, pcd, ply
from debulk.formats.source import CHUNK_POINTS, Source, open_source

Unit = Literal["mm", "m"]
_MM_PER_UNIT = {"mm": 1.0, "m": 1000.0}
_READERS: dict[str, Callable[[Source], NDArray[np.float32]]] = {
    ".npy": npy.read_npy, ".npz": npy.read_npz, ".ply": ply.read_ply, ".pcd": pcd.read_pcd,
}  # fmt: skip
_WRITERS: dict[str, Callable[[Path, NDArray[np.float32]], None]] = {
    ".npy": npy.write_npy, ".npz": npy.write_npz, ".ply": ply.write_ply, ".pcd": pcd.write_pcd,
}  # fmt: skip
_FAR_MM = 1e7  # ten kilometres: no scanner sees so far, so the file or its unit is wrong
_MAX_TEXT_BYTES = 1 << 24


def load_cloud(path: str | PathLike[str], unit: Unit = "mm") -> NDArray[np.float32]:
    """Read a point cloud.

    Parameters
    ----------
    path
        A .npy, .npz, .ply or .pcd file. PLY and PCD may be binary or text, their fields in any order and more than
        x, y, z. A .npz holds one array, or one called points.
    unit
        Unit of the numbers in the file, "mm" or "m".

    Returns
    -------
    (H, W, 3) float32 where the file says that the cloud is organised, else (N, 3); mm, NaN = nothing seen.

    Raises
    ------
    InputError
        If the file cannot be read, is cut off, is not what it claims to be, or holds infinite or absurdly far points:
        names the file, the byte and a remedy. Sizes are checked before memory is taken.

    Examples
    --------
    >>> import tempfile, pathlib
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "scan.pcd"
    >>> save_cloud(path, np.zeros((2, 5, 3)))
    >>> load_cloud(path).shape
    (2, 5, 3)
    """
    path = Path(path)
    factor = _factor(unit)
    extension = path.suffix.lower()
    if extension not in _READERS:
        raise InputError(f"{path}: expected a file ending in {', '.join(_READERS)}, got {extension or 'no ending'!r}")
    with open_source(path) as source:
        kind = _kind(source)
        if kind != extension:
            what = f"holds {kind} data" if kind else f"does not start like {extension} data"
            source.fail(0, f"the file {what}", f"rename it to end in {kind}" if kind else "export the cloud again")
        points = _READERS[extension](source)
    if factor != 1.0:
        points *= np.float32(factor)
    _check_near(path, points, unit)
    return points


def save_cloud(path: str | PathLike[str], points: ArrayLike) -> None:
    """Write a point cloud, in mm, as float32; shape and NaN are kept.

    Parameters
    ----------
    path
        Ends in .npy, .npz, .ply or .pcd. An existing file is replaced only when the new one is complete.
    points
        (H, W, 3) or (N, 3), mm. A single row (1, W, 3) comes back from .pcd as (W, 3).

    Raises
    ------
    InputError
        If the ending or the shape is another, or the file cannot be written.
    """
    path = Path(path)
    values = np.asarray(points)
    if path.suffix.lower() not in _WRITERS:
        raise InputError(f"{path}: expected a file ending in {', '.join(_WRITERS)}")
    if values.dtype.kind != "f" or values.ndim not in (2, 3) or values.shape[-1] != 3 or values.size == 0:
        raise InputError(f"points: expected (H, W, 3) or (N, 3) floats, got {values.shape} {values.dtype}")
    with replacing(path) as temporary:
        _WRITERS[path.suffix.lower()](temporary, np.ascontiguousarray(values, dtype=np.float32))


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
    """
    path = Path(path)
    pose = _numbers(path, header=False)
    if pose.shape != (4, 4):
        raise InputError(f"{path}: expected four lines of four numbers, got {pose.shape[0]} of {pose.shape[1]}")
    rotation = pose[:3, :3]
    if not np.allclose(pose[3], [0, 0, 0, 1]):
        raise InputError(f"{path}: expected the last line 0 0 0 1, got {' '.join(f'{v:g}' for v in pose[3])}")
    if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-4 or np.linalg.det(rotation) < 0:
        raise InputError(f"{path}: expected a rotation in the upper left 3 x 3, got one that scales, shears or mirrors")
    pose[:3, 3] *= _factor(unit)
    return pose


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
        If there are fewer than three corners, or they enclose nothing.
    """
    path = Path(path)
    outline = _numbers(path, header=True)
    if outline.shape[1] != 2:
        raise InputError(f"{path}: expected two columns x,y, got {outline.shape[1]}")
    if len(outline) > 1 and np.array_equal(outline[0], outline[-1]):
        outline = outline[:-1]
    x, y = (outline * _factor(unit)).T
    area_mm2 = 0.5 * abs(float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))))
    if len(outline) < 3 or area_mm2 < 1.0:
        raise InputError(
            f"{path}: expected at least 3 corners round an area, got {len(outline)} round {area_mm2:g} mm²"
        )
    return np.column_stack([x, y])


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


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary name beside `path` to write to, and put the file in place when it is complete."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield temporary
        temporary.replace(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def _factor(unit: str) -> float:
    if unit not in _MM_PER_UNIT:
        raise InputError(f'unit: expected "mm" or "m", got {unit!r}')
    return _MM_PER_UNIT[unit]


def _kind(source: Source) -> str:
    """Name the format by the file's first bytes; empty if unknown."""
    head = source.file.read(64)
    source.file.seek(0)
    if head.startswith(b"\x93NUMPY"):
        return ".npy"
    if head.startswith(b"PK"):
        return ".npz"
    if head.startswith((b"ply\n", b"ply\r\n")):
        return ".ply"
    return ".pcd" if head.startswith((b"# .PCD", b"VERSION", b"#\x20PCD", b"FIELDS")) else ""


def _check_near(path: Path, points: NDArray[np.float32], unit: str) -> None:
    flat = points.reshape(-1)
    for first in range(0, flat.size, 3 * CHUNK_POINTS):
        chunk = flat[first : first + 3 * CHUNK_POINTS]
        # fmax passes over NaN, which stands for nothing seen; all NaN gives NaN, which is not greater.
        if np.fmax.reduce(chunk) > _FAR_MM or np.fmin.reduce(chunk) < -_FAR_MM:
            place = first + int(np.flatnonzero(np.abs(chunk) > _FAR_MM)[0])
            raise InputError(
                f"{path}: point {place // 3}: {'xyz'[place % 3]} = {flat[place]:g} mm, expected at most {_FAR_MM:g}; "
                f"write NaN where nothing was seen, and check the unit ({unit})"
            )


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
