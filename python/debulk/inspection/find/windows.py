"""Windows of a height map."""

from __future__ import annotations

import numpy as np

from debulk.arrays import Floats
from debulk.grid import Grid


def cells_round(box_mm: Floats, grid: Grid, margin_mm: float) -> tuple[slice, slice]:
    """Return the rows and columns of a grid in a box, given by its (2, 2) lowest and highest corner, with a margin."""
    ny, nx = grid.values.shape
    wide_mm = box_mm + np.array([[-margin_mm], [margin_mm]])
    (i0, j0), (i1, j1) = np.rint((wide_mm - grid.origin_mm) / grid.spacing_mm).astype(int).tolist()
    return slice(max(0, j0), min(ny, j1 + 1)), slice(max(0, i0), min(nx, i1 + 1))


def cut_out(grid: Grid, rows: slice, columns: slice) -> Grid:
    """Return a copy of these cells as a grid of their own."""
    origin = grid.origin_mm + grid.spacing_mm * np.array([columns.start, rows.start])
    return Grid(grid.values[rows, columns].copy(), origin, grid.spacing_mm)
