"""Finders of the pockets in a scan: through regions of interest if these surely find all, else in the whole scan."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core
from debulk.inspection.find.found import Found
from debulk.inspection.find.regions import RegionFinder
from debulk.inspection.find.whole_scan import WholeScanFinder
from debulk.inspection.ply.setup import Setup


class Finder(Protocol):
    """A finder is prepared once for a reference, then used for scan after scan, by one thread at a time."""

    def find(self, scan: ArrayLike, mask: NDArray[np.bool_] | None = None, stop: _core.Stop | None = None) -> Found:
        """Find the pockets of a scan.

        Parameters
        ----------
        scan
            (H, W, 3) or (N, 3), scanner frame, mm, NaN = nothing seen.
        mask
            (H, W) of an organised scan: True where a pixel is not to be used.
        stop
            Ends the search with `Stopped` when it is raised from another thread, or when its deadline passes.

        Raises
        ------
        InputError
            For a bad cloud, or a mask of another shape.
        """


def finder_for(setup: Setup) -> Finder:
    """Prepare the finder that the recipe asks for: regions with the whole scan as fallback, or only the whole scan."""
    whole = WholeScanFinder(setup)
    if not setup.recipe.segmentation.regions:
        whole.prepare()
        return whole
    return RegionFinder(setup, whole)
