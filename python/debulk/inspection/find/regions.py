"""Regions of interest: from a scan to its pockets without processing the whole scan."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, cloud, pocket
from debulk.grid import Grid
from debulk.inspection.clouds.cleaning import check_mask
from debulk.inspection.find.found import Found, RegionFigures
from debulk.inspection.find.whole_scan import WholeScanFinder
from debulk.inspection.ply.setup import Setup
from debulk.recipe import options
from debulk.results.report import LeftOut

_WHOLE = "none: the whole scan was processed, which takes longer"
_LEAST_RATIO = 1.5  # with 1.0 a clean scan loses 5 % of the ply on flanks, with 1.5 nothing (measured on 14 pockets)


class RegionFinder:
    """Finds the pockets of scan after scan through regions of interest, or in the whole scan where they may miss some.

    A coarse pass over some rows and columns of pixels finds the places where the ply stands up. Windows round these
    places are processed exactly as the whole scan would be: outliers, heights, holes, spikes, median, segmentation,
    feet. Only the scans of a pinhole camera can be processed this way; `Found.left_out` says why a scan was processed
    whole. One object serves one thread at a time. Memory is reused from scan to scan: `find` overwrites the arrays of
    an earlier `Found` that nobody holds any more, and never changes one that is held. Reports do not hold a `Found`.

    `whole` finds the pockets of scans that cannot be processed by regions; None: it is made here. `mesh`, for studies,
    are the steps between the rows and the columns of pixels that the coarse pass reads; None: as sparse as the area
    tolerance allows without missing a pocket.
    """

    def __init__(self, setup: Setup, whole: WholeScanFinder | None = None, mesh: tuple[int, int] | None = None) -> None:
        prepared, recipe = setup.prepared, setup.recipe
        self._setup, self._recipe = setup, recipe
        self._whole = whole or WholeScanFinder(setup)
        self._core: Any = None
        self._unusable = "the reference is not an image of a pinhole camera"
        if prepared.image is not None:
            wanted = options.regions(recipe, prepared.grid_spacing_mm, setup.outline)
            if mesh is not None:
                wanted.row_step, wanted.column_step = mesh
            self._core = _core.region.RegionFront(
                prepared.datum,
                prepared.image.shape,
                prepared.image.camera,
                setup.pose,
                wanted,
                recipe.run.threads,
                prepared.seen_on_grid(),
            )
            self._unusable = "" if self._core.usable else self._core.reason
            if recipe.clean.least_ratio < _LEAST_RATIO:
                self._unusable = (
                    f"clean.least_ratio below {_LEAST_RATIO:g} takes the flanks of pockets for outliers, which windows "
                    "round what stands up do not count"
                )
        if self._unusable:
            self._whole.prepare()  # now, not in the first cycle

    def find(self, scan: ArrayLike, mask: NDArray[np.bool_] | None = None, stop: _core.Stop | None = None) -> Found:
        """Find the pockets of a scan, as `WholeScanFinder.find` does."""
        stop = stop or _core.Stop()
        why_whole = self._unusable
        if not why_whole:
            points = cloud.as_cloud(scan, "scan")
            check_mask(mask, points, "scan")
            if self._core.run(points, None if mask is None else mask.view(np.uint8), stop):
                return self._found()
            why_whole = self._core.reason
        found = self._whole.find(scan, mask, stop)
        return replace(found, left_out=(LeftOut(what="regions of interest", why=why_whole, bound=_WHOLE),))

    def _found(self) -> Found:
        core = self._core
        *overview, unseen = core.overview(options.unseen(self._recipe, self._setup.outline))
        parts, wanted = [], options.feet(self._recipe)
        for segmentation, feet in core.regions():
            found = pocket.from_core(segmentation)
            parts.append((found, pocket.feet_from_core(found, feet, wanted)))
        rows, columns, pixel_mm, eye_mm2 = core.mesh
        threshold_mm, error_mm, sample = core.threshold
        figures = RegionFigures(
            rows=rows,
            columns=columns,
            pixel_mm=pixel_mm,
            eye_mm2=eye_mm2,
            flag_mm=core.flag_mm,
            windows=len(core.windows),
            read_share=core.read_share,
            image_share=core.image_share,
            threshold_mm=threshold_mm,
            threshold_error_mm=error_mm,
            sample=sample,
        )
        sampling, coarse, windows, filtering, segment, feet_ms = core.times
        times_ms = {
            "sample": sampling, "coarse": coarse, "clean": windows, "fill": filtering, "pockets": segment + feet_ms,
        }  # fmt: skip
        left_out = _left_out(figures, self._recipe.segmentation.area_tol_mm2)
        return Found(tuple(parts), unseen, Grid(*overview), times_ms, left_out, figures)


def finder_for(setup: Setup) -> RegionFinder | WholeScanFinder:
    """Prepare the finder that the recipe asks for: regions with the whole scan as fallback, or only the whole scan."""
    whole = WholeScanFinder(setup)
    if not setup.recipe.segmentation.regions:
        whole.prepare()
        return whole
    return RegionFinder(setup, whole)


def _left_out(figures: RegionFigures, area_tol_mm2: float) -> tuple[LeftOut, ...]:
    pixel_mm = figures.pixel_mm
    outside_percent = round(100 * max(0.0, 1 - figures.image_share))
    outside = LeftOut(
        what=f"fine detail outside {figures.windows} regions of interest: {100 - outside_percent} % of the scan was "
        f"read in full, {outside_percent} % by the coarse pass",
        why=f"a coarse pass over {_every(figures.rows)} row and {_every(figures.columns)} column of "
        f"pixels saw nothing there that stands {figures.flag_mm:g} mm high or more",
        bound=f"a pocket in it would be less than 2 pixels ({2 * pixel_mm:.2g} mm) wide wherever it crosses "
        f"such a row or column, or lie between them: {(figures.rows - 1) * pixel_mm:.2g} by "
        f"{(figures.columns - 1) * pixel_mm:.2g} mm at most, below {figures.eye_mm2 / 100:.2g} cm² "
        f"(limit {area_tol_mm2 / 100:g} cm²)",
    )
    if not figures.threshold_error_mm > 0:
        return (outside,)
    sampled = LeftOut(
        what="most of the scan in the threshold of the outlier filter",
        why=f"it is estimated from a sample of {figures.sample} points",
        bound=f"{figures.threshold_mm:.3f} mm, 3 standard errors are {3 * figures.threshold_error_mm:.2g} mm",
    )
    return outside, sampled


def _every(number: int) -> str:
    if number == 1:
        return "every"
    ending = "th" if number % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"every {number}{ending}"
