"""Windows of a height map, and marks on its cells that grow."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from debulk.grid import Grid

__all__ = ["cells_round", "cut_out", "grown"]

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]


def cells_round(box_mm: Floats, grid: Grid, margin_mm: float) -> tuple[slice, slice]:
    """Rows and columns of a box, (2, 2) its lowest and highest corner, with a margin, as far as they are in a grid."""
    ny, nx = grid.values.shape
    wide_mm = box_mm + np.array([[-margin_mm], [margin_mm]])
    (i0, j0), (i1, j1) = np.rint((wide_mm - grid.origin_mm) / grid.spacing_mm).astype(int).tolist()
    return slice(max(0, j0), min(ny, j1 + 1)), slice(max(0, i0), min(nx, i1 + 1))


def cut_out(grid: Grid, rows: slice, columns: slice) -> Grid:
    """Return a copy of these cells as a grid of their own."""
    origin = grid.origin_mm + grid.spacing_mm * np.array([columns.start, rows.start])
    return Grid(grid.values[rows, columns].copy(), origin, grid.spacing_mm)


def grown(marks: Flags, cells: int = 1) -> Flags:
    """Return (ny, nx) the marks, and what is up to so many cells away from one along each axis."""
    out = marks.copy()
    for along in (out, out.T):
        reach = 0
        while reach < cells:
            step = min(reach + 1, cells - reach)  # as far as no gap opens, beside the border either
            before = along.copy()
            along[step:] |= before[:-step]
            along[:-step] |= before[step:]
            reach += step
    return out
