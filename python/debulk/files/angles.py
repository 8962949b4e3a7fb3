"""What a sensor measured of a ply's fibre directions: a table of places and the two directions there."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np

from debulk._core import InputError
from debulk.arguments import typed
from debulk.files.names import find_axes, is_line_of_names, unit_fault
from debulk.files.table import Table, read_small_text, read_table
from debulk.files.units import Unit, check_size, factor
from debulk.grid import Grid

_MOST_PLACES = 1 << 22
_MOST_OFF = 0.02  # of a place from its grid point, in spacings


@typed
def load_angles(path: str | PathLike[str], unit: Unit = "mm") -> Grid:
    """Read fibre directions in the mold frame: one line "x,y,first,second" for each place that the sensor saw.

    Parameters
    ----------
    path
        A CSV file of places on one regular grid along x and y, and two angles in degrees counter-clockwise from +x at
        each. Where the sensor saw nothing there is no line. Lines of words may come first.
    unit
        Unit of x and y.

    Returns
    -------
    Grid
        Values (ny, nx, 2), degrees, NaN where the file says nothing: the ``fibre_angles_deg`` of an inspection.

    Raises
    ------
    InputError
        If the file has other columns, or its places are not those of one grid, or one is there twice.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     seen = [(0, 0, 1, 91), (20, 0, 2, 92), (0, 10, 3, 93)]
    ...     np.savetxt(Path(folder) / "angles.csv", seen, delimiter=",", header="x,y,first,second", comments="")
    ...     load_angles(Path(folder) / "angles.csv").values[..., 0].tolist()
    [[1.0, nan, 2.0], [3.0, nan, nan]]
    """
    path = Path(path)
    table = read_table(path, read_small_text(path), headings=True)
    _check_columns(path, table, factor(unit))
    xy, angles = table.numbers[:, :2] * factor(unit), table.numbers[:, 2:]
    low, size = xy.min(axis=0), np.ptp(xy, axis=0)
    check_size(path, float(size.max()), "ply", unit)
    axis = int(np.argmax(size))
    steps = np.concatenate([np.diff(np.unique(np.round(places, 3))) for places in xy.T])
    spacing = float(size[axis] / np.rint(size[axis] / steps.min()))  # without the rounding of the file's numbers
    cells = (xy - low) / spacing
    nx, ny = (np.rint(cells.max(axis=0)) + 1).astype(np.int64).tolist()
    column, row = np.rint(cells).astype(np.int64).T
    if np.abs(cells - np.rint(cells)).max() > _MOST_OFF or nx * ny > _MOST_PLACES:
        raise InputError(f"{path}: expected places of one regular grid, of the same spacing along x and y")
    if len(np.unique(row * nx + column)) != len(row):
        raise InputError(f"{path}: expected one line for each place, but some have two")
    values = np.full((ny, nx, 2), np.nan)
    values[row, column] = angles
    return Grid(values, low, spacing)


def _check_columns(path: Path, table: Table, mm_per_unit: float) -> None:
    width = table.numbers.shape[1]
    if width != 4:
        raise InputError(f"{path}: expected four columns, x,y,first,second, got {width}{table.hint}")
    for _, text in table.headings:
        if not is_line_of_names(text, "xy"):
            continue
        axes = find_axes(text, ",", width, "xy")
        if axes.places != [0, 1]:
            raise InputError(f"{path}: expected the columns x,y,first,second in this order, got {text[:60]!r}")
        if fault := unit_fault(axes.units, mm_per_unit, "--frame-unit"):
            raise InputError(f"{path}: {'; '.join(fault)}")
