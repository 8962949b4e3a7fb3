"""The front end of an inspection cell, which turns scan after scan into height maps above one prepared reference."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, arrays
from debulk.arguments import of_type
from debulk.cloud import as_cloud
from debulk.inspection.clouds.camera import PinholeImage
from debulk.surface import HeightMap, Reference

InputError = _core.InputError


class FrontEnd:
    """Turns scans into height maps: removes outliers, grids heights, fills holes, removes spikes, takes the median.

    The steps are those of `debulk.cloud.transform`, `debulk.cloud.remove_outliers`, `debulk.surface.height_map`,
    `debulk.surface.without_spikes` and `debulk.surface.median`, but many times faster for the organised scans of a
    pinhole camera: exact neighbours are found in the image, heights are measured along the rays, and the shift of
    raised points is undone on the grid.
    Whatever depends only on the reference and the camera is prepared here, and memory is reused from scan to scan. Any
    other cloud is processed by the general method, with the same decisions. One object serves one thread at a time.

    Parameters
    ----------
    reference
        The smooth reference surface, mold frame.
    image
        Image of the pinhole camera that took the organised scans (see `debulk.inspection.clouds.camera`). None means
        that every scan is processed by the general method.
    mold_from_scanner
        (4, 4) rigid motion, x_mold = T x_scanner. None means that scans are in the mold's frame already.
    options
        Compiled options, see `debulk.recipe.options.front_end`. The fast method needs four neighbours. None means the
        defaults.
    box_mm
        (2, 2) lowest and highest mold XY that the map covers, cut to the reference's; None means all of the reference.
    threads
        Number of threads; 0 means as many as the process may use. The result does not depend on it.
    seen
        The heights that the reference was fitted to: values (ny, nx), origin, spacing. Where they are NaN, except in
        gaps that the rule for small holes in a scan would fill, no height is known. None means that the reference is
        known everywhere.

    Raises
    ------
    InputError
        Names the argument, what was expected and what was given.

    Examples
    --------
    >>> import debulk
    >>> x, y = np.meshgrid(np.arange(-40.0, 41.0, 10.0), np.arange(-30.0, 31.0, 10.0))
    >>> flat = Reference(np.full_like(x, 500.0), (-40.0, -30.0), 10.0)
    >>> column, row = np.meshgrid(np.arange(120.0), np.arange(90.0))
    >>> scan = 502.0 * np.dstack([(column - 59.5) / 800, (row - 44.5) / 800, np.ones_like(row)])
    >>> front = FrontEnd(flat, PinholeImage(90, 120, 800.0, 59.5, 44.5))
    >>> heights = front.inspect(scan)
    >>> front.fast, round(float(np.nanmedian(heights.values)), 4)
    (True, 2.0)
    """

    def __init__(
        self,
        reference: Reference,
        image: PinholeImage | None,
        mold_from_scanner: ArrayLike | None = None,
        *,
        options: _core.surface.FrontEndOptions | None = None,
        box_mm: ArrayLike | None = None,
        threads: int = 0,
        seen: tuple[NDArray[np.float32], NDArray[np.float64], float] | None = None,
    ) -> None:
        if not isinstance(reference, _core.surface.Reference):
            raise InputError(f"reference: expected a debulk.surface.Reference, but got {of_type(reference)}")
        pose = np.eye(4) if mold_from_scanner is None else np.asarray(mold_from_scanner, dtype=np.float64)
        everything = [[-1e9, -1e9], [1e9, 1e9]]
        box = arrays.numbers(everything if box_mm is None else box_mm, "box_mm", (2, 2), "an array of shape (2, 2)")
        self._shape: tuple[int, ...] = ()  # shape of the last scan's image
        self._core: Any = _core.surface.FrontEnd(
            reference,
            (0, 0) if image is None else image.shape,  # the core reads it only if there is a camera
            None if image is None else image.camera,
            pose,
            tuple(box.reshape(4).tolist()),
            options or _core.surface.FrontEndOptions(),
            threads,
            seen,
        )

    def inspect(self, scan: ArrayLike, stop: _core.Stop | None = None, *, copy: bool = True) -> HeightMap:
        """Return the height map of a scan.

        Parameters
        ----------
        scan
            (H, W, 3) or (N, 3), scanner frame, mm, NaN = nothing seen. C-contiguous float32 is not copied.
        stop
            When raised from another thread, ends the computation soon with a RuntimeError.
        copy
            If False, the map's arrays are views that the next call overwrites.

        Raises
        ------
        InputError
            For a bad cloud.
        """
        points = as_cloud(scan, "scan")
        self._shape = points.shape[:-1]
        *maps, origin, spacing = self._core.run(points, stop or _core.Stop())
        values, measured, before = (m.copy() if copy and m is not None else m for m in maps)
        return HeightMap(values, origin, spacing, measured.view(np.bool_), before, self._core.blur_mm2)

    def unseen(self, options: _core.pocket.UnseenOptions) -> _core.pocket.Unseen:
        """Return what the last scan did not show of the ply, or of the reference if there is no outline."""
        return _core.pocket.find_unseen(self._core, options)

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
    def outlier_threshold_mm(self) -> float:
        """Mean distance to the neighbours above which points of the last scan were removed."""
        return float(self._core.threshold)

    @property
    def times_ms(self) -> dict[str, float]:
        """Duration of each stage for the last scan."""
        return dict(zip(("clean", "grid", "fill", "spikes", "median"), self._core.times, strict=True))
