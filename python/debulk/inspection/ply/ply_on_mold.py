"""What is given once and holds for every scan and pocket of an inspection: the ply, and the surface below it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from debulk.arrays import Bools, Floats
from debulk.forking import kept
from debulk.grid import Grid
from debulk.inspection.ply import angle_field
from debulk.inspection.ply.fibre_runs import PlyFibres
from debulk.inspection.reference.prepared import Prepared
from debulk.recipe import Recipe
from debulk.surface import Reference


@dataclass(frozen=True, eq=False)
class PlyOnMold:
    """Everything that the evaluation of a pocket needs besides the pocket itself."""

    reference: Reference
    """The surface below the ply."""
    outline: Floats | None
    """(M, 2), mold XY, mm; None: not known."""
    fibre_angles_deg: Floats | Grid
    """Two angles, or a Grid of them with NaN where nothing is known."""
    recipe: Recipe
    """All settings."""
    turned: angle_field.Turned | None = None
    """How far measured fibres run from nominal ones; None: not both are given."""

    @classmethod
    def of(
        cls, reference: Reference, outline: Floats | None, given: Floats | Grid, nominal: Grid | None, recipe: Recipe
    ) -> PlyOnMold:
        """Return a ply by its angles as they are given and, if those are measured, by nominal ones on the same grid.

        An `InputError` is raised if measured and nominal angles are known at no common place of the ply.
        """
        if not isinstance(given, Grid):
            return cls(reference, outline, given, recipe)
        if nominal is None:
            return cls(reference, outline, angle_field.averaged(given), recipe)
        both, turned = angle_field.completed(given, nominal), angle_field.turned(given, nominal, outline)
        return cls(reference, outline, angle_field.averaged(both), recipe, turned)

    @kept
    def fibres(self) -> PlyFibres:
        """The lines along its fibres, which are the same for every scan of it."""
        angles = self.fibre_angles_deg
        along = angle_field.across_gaps(angles) if isinstance(angles, Grid) else angles
        return PlyFibres(self.reference, self.outline, along, self.recipe)

    @kept
    def shear(self) -> Grid | None:
        """Its shear, degrees, if its fibre directions are known from place to place."""
        return self._of_field(angle_field.shear_of)

    @kept
    def gaps(self) -> Grid | None:
        """Where on it the fibre directions are not known; None if they are everywhere."""
        return self._of_field(angle_field.gaps_of)

    def prepare(self) -> None:
        """Make what is the same for every scan."""
        _ = self.fibres, self.shear, self.gaps

    def _of_field(self, made: Callable[[Grid, Reference, Floats | None], Grid | None]) -> Grid | None:
        angles = self.fibre_angles_deg
        return made(angles, self.reference, self.outline) if isinstance(angles, Grid) else None


@dataclass(frozen=True, eq=False)
class Setup:
    """What is made once from all that an inspector is given, and read by everything that looks at a scan."""

    prepared: Prepared
    """The reference, and the camera's image if there is one. Without an outline, it ends at the mold's edge."""
    ply: PlyOnMold
    """The ply on it, and the recipe."""
    mold_from_scanner: Floats | None
    """(4, 4), x_mold = T x_scanner; None: clouds are in the mold's frame."""
    mask: Bools | None = None
    """(H, W), True where an image is not to be used, or None."""

    @property
    def outline(self) -> Floats | None:
        """(M, 2) outline of the ply, mold XY, mm, or None."""
        return self.ply.outline

    @property
    def recipe(self) -> Recipe:
        """All settings."""
        return self.ply.recipe

    @property
    def pose(self) -> Floats:
        """(4, 4), the motion into the mold's frame, also if that is none."""
        return np.eye(4) if self.mold_from_scanner is None else self.mold_from_scanner
