"""The front end of an inspection cell, which turns scan after scan into height maps above one prepared reference."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, arrays, pocket
from debulk.cloud import as_cloud
from debulk.grid import Grid
from debulk.inspection.clouds.camera import PinholeImage
from debulk.surface import HeightMap, Reference

_EVERYTHING_MM = [[-1e9, -1e9], [1e9, 1e9]]


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
        mold_from_scanner: ArrayLike | None = None,
        *,
        options: _core.surface.FrontEndOptions,
        box_mm: ArrayLike | None = None,
        threads: int = 0,
        seen: tuple[NDArray[np.float32], NDArray[np.float64], float] | None = None,
    ) -> None:
        box = arrays.numbers(_EVERYTHING_MM if box_mm is None else box_mm, "box_mm", (2, 2), "an array of shape (2, 2)")
        self._shape: tuple[int, ...] = ()  # shape of the last scan's image
        self._threads, self._finder = threads, _core.pocket.PocketFinder()
        self._core: Any = _core.surface.FrontEnd(
            reference,
            (0, 0) if image is None else image.shape,  # the core reads it only if there is a camera
            None if image is None else image.camera,
            np.eye(4) if mold_from_scanner is None else np.asarray(mold_from_scanner, dtype=np.float64),
            tuple(box.reshape(4).tolist()),
            options,
            threads,
            seen,
        )

    def inspect(self, scan: ArrayLike, stop: _core.Stop | None = None, *, copy: bool = True) -> HeightMap:
        """Return the height map of a scan; without a copy its arrays are views that the next call overwrites."""
        points = as_cloud(scan, "scan")
        self._shape = points.shape[:-1]
        *maps, origin, spacing = self._core.run(points, stop or _core.Stop())
        values, measured, before = (m.copy() if copy and m is not None else m for m in maps)
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
    def fast(self) -> bool:
        """Whether the last scan was processed by the fast method."""
        return bool(self._core.fast)

    @property
    def keep(self) -> NDArray[np.bool_]:
        """(H, W) or (N,): False for the last scan's outliers and missing points."""
        rows, columns = self._shape if len(self._shape) == 2 else (*self._shape, 1)
        keep: NDArray[np.uint8] = self._core.keep((rows, columns))
        return keep.view(np.bool_).reshape(self._shape)

    @property
    def times_ms(self) -> dict[str, float]:
        """Duration of each stage for the last scan."""
        return dict(zip(("clean", "grid", "fill", "spikes", "median"), self._core.times, strict=True))
