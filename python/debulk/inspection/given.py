"""What an inspector was given, checked and prepared: enough to make it again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk.grid import Grid
from debulk.inspection.reference.prepared import Prepared
from debulk.recipe import Recipe


@dataclass(frozen=True, eq=False)
class Given:
    """The arguments of `debulk.Inspector` that its file keeps and its reports name, under the names that it has."""

    recipe: Recipe
    reference: Prepared
    ply_outline: NDArray[np.float64] | None
    fibre_angles_deg: NDArray[np.float64] | Grid
    nominal_angles_deg: Grid | None
    mold_from_scanner: NDArray[np.float64] | None
    camera: NDArray[np.float64] | None
    mask: NDArray[np.bool_] | None
