"""Where the ply lies: the scanner's pose and the ply's outline, as small tables of numbers in text files."""

from __future__ import annotations

import math
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk import arrays
from debulk._core import InputError
from debulk.arguments import typed
from debulk.files.source import open_source
from debulk.files.units import Unit, check_size, factor

__all__ = ["load_outline", "load_pose"]

_MAX_TEXT_BYTES = 1 << 24


@typed
def load_pose(path: str | PathLike[str], unit: Unit = "mm") -> NDArray[np.float64]:
    """Read a rigid transform, x_mold = T x_scanner: four lines of four numbers.

    Parameters
    ----------
    path
        A text file; numbers are separated by blanks or commas, and ``#`` starts a comment.
    unit
        Unit of the translation in the file.

    Returns
    -------
    (4, 4) with the translation in mm.

    Raises
    ------
    InputError
        If it is not a rotation and a translation, but mirrors, scales or shears.

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
    pose[:3, 3] *= factor(unit)
    return pose


@typed
def load_outline(path: str | PathLike[str], unit: Unit = "mm") -> NDArray[np.float64]:
    """Read the ply's outline: one line "x,y" per corner, in order, in the mold frame.

    Parameters
    ----------
    path
        A CSV file; one line of names may come first. The last corner may repeat the first.
    unit
        Unit of the numbers in the file.

    Returns
    -------
    (M, 2), mm, M at least 3, closed from the last to the first.

    Raises
    ------
    InputError
        If there are fewer than three corners, they enclose no area, or sides cross.

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
    outline *= factor(unit)
    if len(outline) >= 3:
        check_size(path, float(np.ptp(outline, axis=0).max()), "outline", unit)
    return arrays.outline(outline, str(path))


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
