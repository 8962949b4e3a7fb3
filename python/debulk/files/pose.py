"""A rigid motion from a small file: text, JSON, or the YAML and XML of OpenCV and Zivid."""

from __future__ import annotations

import re
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from debulk import arrays
from debulk._core import InputError
from debulk.arguments import typed
from debulk.files.matrices import named_matrices
from debulk.files.table import read_small_text, read_table
from debulk.files.units import Unit, factor

_ROTATIONS = ("rotation", "rotation_matrix", "rotationmatrix", "rot", "rmat", "r")
_TRANSLATIONS = ("translation", "translation_vector", "translationvector", "trans", "position", "tvec", "t")
_EXPECTED = "four lines of four numbers, three lines of four, or one line of 16 by rows"


@typed
def load_pose(path: str | PathLike[str], unit: Unit = "mm") -> NDArray[np.float64]:
    """Read a rigid transform, x_mold = T x_scanner.

    Parameters
    ----------
    path
        A text file with four lines of four numbers, three of four (without the last, 0 0 0 1), or all in one line, by
        rows; ``#`` starts a comment. Or JSON, or the YAML or XML of OpenCV's FileStorage or of Zivid, which holds one
        such matrix under any name, or one 3 by 3 called rotation or R and one vector called translation or t.
    unit
        Unit of the translation in the file.

    Returns
    -------
    (4, 4) with the translation in mm. A rotation that is rounded to three decimals or more is replaced by the nearest
    one; `debulk.arrays.rigid` says why that is safe and what remains uncertain.

    Raises
    ------
    InputError
        If there is no such matrix or more than one, or it mirrors, scales or shears, or stands there by columns.

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
    mm_per_unit = factor(unit)
    text = read_small_text(path)
    matrices = named_matrices(path, text)
    if matrices is None:
        if text.lstrip().startswith("["):  # as MATLAB and NumPy print a matrix, whose rows may be broken
            text = re.sub(r"[\];]", "\n", re.sub(r"\s|\[", " ", text))
        table = read_table(path, text, headings=False)
        pose = _four_by_four(table.numbers)
        if pose is None:
            height, width = table.numbers.shape
            raise InputError(f"{path}: expected {_EXPECTED}, got {height} of {width}{table.hint}")
        if table.numbers.shape == (3, 4) and np.array_equal(table.numbers[2], (0, 0, 0, 1)):
            raise InputError(f"{path}: expected four lines of four numbers, got 3 of 4 that end with 0 0 0 1")
    else:
        pose = _the_one(path, matrices)
    pose = arrays.rigid(pose, str(path))
    pose[:3, 3] *= mm_per_unit
    return pose


def _four_by_four(matrix: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Return a pose as (4, 4), or None if it has another number of rows or columns."""
    if matrix.shape in ((1, 12), (1, 16)):
        matrix = matrix.reshape(-1, 4)
    if matrix.shape == (3, 4):
        matrix = np.vstack([matrix, (0.0, 0.0, 0.0, 1.0)])
    return matrix if matrix.shape == (4, 4) else None


def _the_one(path: Path, matrices: dict[str, NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the only pose among named matrices, which is one matrix, or a rotation and a translation."""
    poses = {name: pose for name, matrix in matrices.items() if (pose := _four_by_four(matrix)) is not None}
    if len(poses) == 1:
        return next(iter(poses.values()))
    if poses:
        raise InputError(f"{path}: expected one pose, got {_listed(poses)}: keep one of them in the file")
    rotations = _called(matrices, _ROTATIONS, ((3, 3), (1, 9)))
    translations = _called(matrices, _TRANSLATIONS, ((1, 3), (3, 1)))
    if len(rotations) == len(translations) == 1:
        pose = np.eye(4)
        pose[:3, :3] = next(iter(rotations.values())).reshape(3, 3)
        pose[:3, 3] = next(iter(translations.values())).ravel()
        return pose
    if len(rotations) > 1 or len(translations) > 1:
        several = _listed(rotations | translations)
        raise InputError(f"{path}: expected one rotation and one translation, got {several}: keep one pose in the file")
    shapes = ", ".join(f"{name or 'a list'} {'x'.join(map(str, m.shape))}" for name, m in list(matrices.items())[:6])
    raise InputError(
        f"{path}: expected a matrix of 4 by 4 or 3 by 4, or a 3 by 3 called rotation and a vector called translation, "
        f"got {shapes or 'none'}"
    )


def _called(
    matrices: dict[str, NDArray[np.float64]], names: tuple[str, ...], shapes: tuple[tuple[int, int], ...]
) -> dict[str, NDArray[np.float64]]:
    return {n: m for n, m in matrices.items() if n.rsplit(".")[-1].lower() in names and m.shape in shapes}


def _listed(names: dict[str, NDArray[np.float64]]) -> str:
    return f"{len(names)}: {', '.join(list(names)[:8])}"
