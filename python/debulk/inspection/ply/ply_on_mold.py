"""The ply of an inspection and the surface below it, which are the same for all of its pockets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from debulk.forking import kept
from debulk.grid import Grid
from debulk.inspection.ply.fibre_runs import PlyFibres
from debulk.surface import Reference

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["PlyOnMold"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PlyOnMold:
    """Everything that the evaluation of a pocket needs besides the pocket itself.

    Attributes
    ----------
    reference
        The surface below the ply.
    outline
        (M, 2), mold XY, mm; None: not known.
    fibre_angles_deg
        Two angles, or a Grid of them with NaN where nothing is known.
    recipe
        All settings.
    """

    reference: Reference
    outline: Floats | None
    fibre_angles_deg: Floats | Grid
    recipe: Recipe

    @kept
    def datum(self) -> Reference:
        """The surface above which the ply's heights are measured; see `debulk.surface.Reference.datum`."""
        return self.reference.datum(self.recipe.material.thickness_mm)

    @kept
    def fibres(self) -> PlyFibres:
        """The lines along its fibres, which are the same for every scan of it."""
        return PlyFibres(self.reference, self.outline, self.fibre_angles_deg, self.recipe)
