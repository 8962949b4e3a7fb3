"""What finds the pockets of a scan: through regions of interest where that is sure to find all, else in all of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core
from debulk.inspection.found import Found
from debulk.inspection.prepared import Prepared
from debulk.inspection.regions import RegionFinder
from debulk.inspection.whole_scan import WholeScanFinder

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["Finder", "finder_for"]

Floats = NDArray[np.float64]


class Finder(Protocol):
    """Prepared once for a reference, then used scan after scan, by one thread at a time."""

    def find(self, scan: ArrayLike, mask: NDArray[np.bool_] | None = None, stop: _core.Stop | None = None) -> Found:
        """Find the pockets of a scan.

        Parameters
        ----------
        scan
            (H, W, 3) or (N, 3), scanner frame, mm, NaN = nothing seen.
        mask
            (H, W) of an organised scan: True where a pixel is not to be used.
        stop
            Raised from another thread, or past its deadline, it ends the search with `Stopped`.

        Raises
        ------
        InputError
            For a bad cloud, or a mask of another shape.
        """


def finder_for(
    prepared: Prepared, mold_from_scanner: Floats | None, ply_outline: Floats | None, recipe: Recipe
) -> Finder:
    """Prepare what the recipe asks for: regions of interest with the whole scan behind them, or the whole scan."""
    whole = WholeScanFinder(prepared, mold_from_scanner, ply_outline, recipe)
    if not recipe.segmentation.regions:
        whole.prepare()
        return whole
    return RegionFinder(prepared, mold_from_scanner, ply_outline, recipe, whole)
