"""The ply's outline, as a table of corners in a text file or as lines and curves in a DXF file."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from debulk import rings
from debulk._core import InputError
from debulk.arguments import typed
from debulk.files.dxf import read_dxf
from debulk.files.names import find_axes, is_line_of_names, is_line_of_units, unit_fault
from debulk.files.table import Table, read_small_text, read_table
from debulk.files.units import Unit, check_size, factor
from debulk.files.words import split

_RINGS = ("ring", "loop", "contour")  # names of a column that tells the rings of an outline apart


@typed
def load_outline(path: str | PathLike[str], unit: Unit = "mm", layer: str | None = None) -> NDArray[np.float64]:
    """Read the ply's outline in the mold frame: one line "x,y" per corner, in order, or the closed lines in a DXF.

    The outline of a ply with cut-outs is several rings, the outside first: in a table an empty line stands between
    them, or each ends with its first corner again, or a column named ring, loop or contour tells them apart; in a DXF
    one closed line holds all others.

    Parameters
    ----------
    path
        A CSV file. Lines of words may come first; where they name x and y, there may be other columns. Nothing else is
        passed over. The last corner may repeat the first. Or a .dxf with closed lines of LWPOLYLINE, POLYLINE, LINE,
        ARC, CIRCLE, ELLIPSE and SPLINE, which are joined where their ends are at most 0.05 mm apart; curves become
        sides that are at most 0.01 mm beside them, heights are left out. This needs the extra "dxf" (ezdxf).
    unit
        Unit of the numbers in the file. A unit that a DXF names ($INSUNITS) comes before it.
    layer
        Layer of a DXF on which the outline is, or layers, such as "1,11" for the boundary and the cut-outs in a file of
        the AAMA's convention; None looks at all, but takes what is on another layer than the outline for no cut-out.

    Returns
    -------
    (M, 2), mm, M at least 3, closed from the last to the first; with cut-outs one ring after another, the outside
    first, each of which ends with its first corner again.

    Raises
    ------
    InputError
        If there are fewer than three corners, they enclose no area, or sides cross; if rings cross, touch, or do not
        lie in the first; if a DXF has closed lines side by side, open ones, or none.

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
        return rings.outline(read_dxf(path, mm_per_unit, layer), str(path))
    if layer is not None:
        raise InputError(f"layer: expected None for a file that is no .dxf, got {layer!r}")
    outline, starts = _corners(path, read_table(path, read_small_text(path), headings=True), mm_per_unit)
    if len(outline) >= 3:
        check_size(path, float(np.ptp(outline, axis=0).max()), "outline", unit)
    parts = [part for part in np.split(outline, starts) if len(part)]
    if len(parts) == 1 or min(map(len, parts)) < 3:  # so few are no ring: the lines are empty for another reason
        return rings.outline(outline, str(path))
    return rings.outline([ring for part in parts for ring in rings.split(part)], str(path))


def _corners(path: Path, table: Table, mm_per_unit: float) -> tuple[NDArray[np.float64], list[int]]:
    """Return the columns x and y, in mm, and the rows at which another ring may begin."""
    width = table.numbers.shape[1]
    named = next(((number, text) for number, text in reversed(table.headings) if is_line_of_names(text, "xy")), None)
    places, units, starts = [0, 1], [], table.blanks
    if named is not None:
        axes = find_axes(named[1], ",", width, "xy")
        if axes.places is not None and len(axes.words) == width:
            places, units = axes.places, axes.units
            width = 2
            for k in (k for k, word in enumerate(axes.words) if word.lower() in _RINGS):
                starts = (np.flatnonzero(np.diff(table.numbers[:, k])) + 1).tolist()
    for _, text in table.headings:
        for words in (split(text, ","), split(text, ";"), text.split()):
            units += words if is_line_of_units(words) else []
    if fault := unit_fault(units, mm_per_unit, "--frame-unit"):
        raise InputError(f"{path}: {'; '.join(fault)}")
    if width != 2:
        raise InputError(f"{path}: expected two columns x,y, got {width}{table.hint}")
    return np.ascontiguousarray(table.numbers[:, places]) * mm_per_unit, starts
