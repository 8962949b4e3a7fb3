"""The ply's outline, as a table of corners in a text file or as lines and curves in a DXF file."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from debulk import arrays
from debulk._core import InputError
from debulk.arguments import typed
from debulk.files.dxf import read_dxf
from debulk.files.names import find_axes, is_line_of_names, is_line_of_units, unit_fault
from debulk.files.table import Table, read_small_text, read_table
from debulk.files.units import Unit, check_size, factor
from debulk.files.words import split


@typed
def load_outline(path: str | PathLike[str], unit: Unit = "mm", layer: str | None = None) -> NDArray[np.float64]:
    """Read the ply's outline in the mold frame: one line "x,y" per corner, in order, or the closed line in a DXF.

    Parameters
    ----------
    path
        A CSV file. Lines of words may come first; where they name x and y, there may be other columns. Nothing else is
        passed over. The last corner may repeat the first. Or a .dxf with one closed line of LWPOLYLINE, POLYLINE, LINE,
        ARC, CIRCLE, ELLIPSE and SPLINE, which are joined where their ends are at most 0.05 mm apart; curves become
        sides that are at most 0.01 mm beside them, heights are left out. This needs the extra "dxf" (ezdxf).
    unit
        Unit of the numbers in the file. A unit that a DXF names ($INSUNITS) comes before it.
    layer
        Layer of a DXF on which the outline is; None looks at all.

    Returns
    -------
    (M, 2), mm, M at least 3, closed from the last to the first.

    Raises
    ------
    InputError
        If there are fewer than three corners, they enclose no area, or sides cross; if a DXF has several closed lines,
        open ones, or none.

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
    mm_per_unit = factor(unit)
    if path.suffix.lower() == ".dxf":
        return arrays.outline(read_dxf(path, mm_per_unit, layer), str(path))
    if layer is not None:
        raise InputError(f"layer: expected None for a file that is no .dxf, got {layer!r}")
    outline = _corners(path, read_table(path, read_small_text(path), headings=True), mm_per_unit)
    if len(outline) >= 3:
        check_size(path, float(np.ptp(outline, axis=0).max()), "outline", unit)
    return arrays.outline(outline, str(path))


def _corners(path: Path, table: Table, mm_per_unit: float) -> NDArray[np.float64]:
    """Return the columns x and y, in mm."""
    width = table.numbers.shape[1]
    named = next(((number, text) for number, text in reversed(table.headings) if is_line_of_names(text, "xy")), None)
    places, units = [0, 1], []
    if named is not None:
        axes = find_axes(named[1], ",", width, "xy")
        if axes.places is not None and len(axes.words) == width:
            places, units = axes.places, axes.units
            width = 2
    for _, text in table.headings:
        for words in (split(text, ","), split(text, ";"), text.split()):
            units += words if is_line_of_units(words) else []
    if fault := unit_fault(units, mm_per_unit, "--frame-unit"):
        raise InputError(f"{path}: {'; '.join(fault)}")
    if width != 2:
        raise InputError(f"{path}: expected two columns x,y, got {width}{table.hint}")
    return np.ascontiguousarray(table.numbers[:, places]) * mm_per_unit
