"""What is given once and holds for every scan of an inspection."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.inspection.reference.prepared import Prepared
from debulk.recipe import Recipe


@dataclass(frozen=True, eq=False)
class Setup:
    """What is made once from all that an inspector is given, and read by everything that looks at a scan."""

    prepared: Prepared
    """The reference, and the camera's image if there is one. Without an outline, it ends at the mold's edge."""
    ply: PlyOnMold
    """The ply on it, and the recipe."""
    mold_from_scanner: Floats | None
    """(4, 4), x_mold = T x_scanner; None: clouds are in the mold's frame."""
    mask: NDArray[np.bool_] | None = None
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
