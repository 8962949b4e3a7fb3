"""The front end of an inspection cell, which turns scan after scan into height maps above one prepared reference."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk import _core, pocket
from debulk.arrays import Cloud, Floats
from debulk.grid import Grid
from debulk.inspection.clouds.camera import PinholeImage
from debulk.surface import HeightMap, Reference


class FrontEnd:
    """Turns scans into height maps: removes outliers, grids heights, fills holes, removes spikes, takes the median.

    The steps are those of `debulk.cloud.transform`, `debulk.cloud.remove_outliers`, `debulk.surface.height_map`,
    `debulk.surface.without_spikes` and `debulk.surface.median`, but many times faster for the organised scans of a
    pinhole camera: exact neighbours are found in its `image`, heights are measured along the rays, and the shift of
    raised points is undone on the grid. Any other cloud is processed by the general method, with the same decisions.

    Whatever depends only on the reference and the camera is prepared here, and memory is reused from scan to scan. One
    object serves one thread at a time. `box_mm` (2, 2) are the lowest and highest mold XY that the map covers; None:
    all of the reference. `seen` are the heights that the reference was fitted to (values, origin, spacing): where they
    are NaN, no height is known, except in gaps that the rule for small holes in a scan would fill.
    """

    def __init__(
        self,
        reference: Reference,
        image: PinholeImage | None,
        mold_from_scanner: Floats,
        *,
        options: _core.surface.FrontEndOptions,
        box_mm: Floats | None = None,
        threads: int = 0,
        seen: tuple[NDArray[np.float32], NDArray[np.float64], float] | None = None,
    ) -> None:
        self._threads, self._finder = threads, _core.pocket.PocketFinder()
        self._core: Any = _core.surface.FrontEnd(
            reference,
            (0, 0) if image is None else image.shape,  # the core reads it only if there is a camera
            None if image is None else image.camera,
            mold_from_scanner,
            tuple((reference.box_mm if box_mm is None else box_mm).reshape(4).tolist()),
            options,
            threads,
            seen,
        )

    def inspect(self, points: Cloud, stop: _core.Stop | None = None) -> HeightMap:
        """Return the height map of a scan; its arrays are views that later calls overwrite."""
        values, measured, before, origin, spacing = self._core.run(points, stop or _core.Stop())
        return HeightMap(values, origin, spacing, measured.view(np.bool_), before, self._core.blur_mm2)

    def overview(self, options: _core.pocket.UnseenOptions) -> tuple[Grid, _core.pocket.Unseen]:
        """Return the last scan's heights every 2 mm or so, and what was not seen of the ply, or else the reference."""
        values, origin, spacing, unseen = _core.pocket.find_unseen(self._core, options)
        return Grid(values, origin, spacing), unseen

    def pockets(
        self, wanted: _core.pocket.SegmentOptions, feet: _core.pocket.FootOptions, stop: _core.Stop
    ) -> tuple[pocket.Segmentation, pocket.Feet]:
        """Return what `debulk.pocket` finds in the last height map, in memory that is reused once nobody holds it."""
        segmentation, its_feet = self._finder.run(self._core, wanted, feet, self._threads, stop)
        found = pocket.from_core(segmentation)
        return found, pocket.feet_from_core(found, its_feet, feet)

    @property
    def times_ms(self) -> dict[str, float]:
        """Duration of each stage for the last scan."""
        return dict(zip(("clean", "grid", "fill", "spikes", "median"), self._core.times, strict=True))
