"""Values on a regular grid in the mold's XY plane."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError
from debulk.arguments import of_type


@dataclass(frozen=True, eq=False)
class Grid:
    """Values on a regular grid: ``values[j, i]`` belongs to ``origin_mm + spacing_mm * (i, j)``.

    Examples
    --------
    >>> grid = Grid(np.zeros((3, 5)), np.array([10.0, 20.0]), 0.5)
    >>> grid.x_mm.tolist()
    [10.0, 10.5, 11.0, 11.5, 12.0]
    """

    values: NDArray[Any]
    """(ny, nx) or (ny, nx, k); a missing value is NaN."""
    origin_mm: NDArray[np.float64]
    """(2,) position of ``values[0, 0]`` in the mold frame, mm."""
    spacing_mm: float
    """Distance between neighbouring grid points along x and y, mm."""

    def __post_init__(self) -> None:
        if getattr(self.values, "ndim", 0) < 2:
            raise InputError(f"values: expected an (ny, nx) or (ny, nx, k) array, but got {of_type(self.values)}")
        if np.shape(self.origin_mm) != (2,):
            raise InputError(f"origin_mm: expected two numbers in mm, but got {of_type(self.origin_mm)}")
        if not isinstance(self.spacing_mm, Real):
            raise InputError(f"spacing_mm: expected a number in mm, but got {of_type(self.spacing_mm)}")

    @property
    def x_mm(self) -> NDArray[np.float64]:
        """(nx,) x of the columns, mm."""
        return np.asarray(self.origin_mm[0] + self.spacing_mm * np.arange(self.values.shape[1]), dtype=np.float64)

    @property
    def y_mm(self) -> NDArray[np.float64]:
        """(ny,) y of the rows, mm."""
        return np.asarray(self.origin_mm[1] + self.spacing_mm * np.arange(self.values.shape[0]), dtype=np.float64)
