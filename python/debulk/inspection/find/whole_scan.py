"""Search for pockets in the whole scan: heights everywhere, then segmentation and feet."""

from __future__ import annotations

import time

import numpy as np
from numpy.typing import ArrayLike

from debulk import _core
from debulk.arrays import Bools, Floats
from debulk.inspection.clouds.camera import PinholeImage
from debulk.inspection.clouds.cleaning import masked
from debulk.inspection.clouds.enough import SEEN
from debulk.inspection.clouds.products import product
from debulk.inspection.evidence.flying import without_flying
from debulk.inspection.find.found import Found
from debulk.inspection.find.front import FrontEnd
from debulk.inspection.ply.excess import harmless_mm2
from debulk.inspection.ply.ply_on_mold import Setup
from debulk.inspection.running.cycle import in_parallel
from debulk.pocket import UnseenHole
from debulk.recipe import options

_TOO_LITTLE = (
    "no pocket was looked for: is the scan cut off, in another unit, frame or place than the reference, are its pixels "
    "in another order than the camera's, or are its points repeated, as in an enlarged image? Pass those as (N, 3)"
)
_STEP_MM = 2.0  # between the places in a hole that are looked up in the mask


class WholeScanFinder:
    """Finds the pockets of scan after scan, in any kind of cloud. One object serves one thread at a time."""

    def __init__(self, setup: Setup) -> None:
        self._setup, self._recipe = setup, setup.recipe
        self._front = FrontEnd(
            setup.prepared.datum,
            setup.prepared.image,
            setup.pose,
            options=options.front_end(setup.recipe, setup.prepared.grid_spacing_mm),
            box_mm=self._ply_box(),
            threads=setup.recipe.run.threads,
            seen=setup.prepared.seen_on_grid(),
        )

    def find(self, scan: ArrayLike, stop: _core.Stop) -> Found:
        """Find the pockets of a scan, scanner frame, mm; of an organised one, where the mask does not hide it.

        `Stopped` is raised when the stop is raised from another thread, or when its deadline passes.
        """
        points = masked(scan, self._setup.mask, "scan", stop)
        points = without_flying(points, self._setup.pose[2, :3], self._setup.prepared.grid_spacing_mm)
        front = self._front
        front.inspect(points, stop)
        times_ms, began = front.times_ms, time.perf_counter()
        listed = options.unseen(self._recipe, self._setup.outline)
        # Of holes that are filled in, those of half of this are listed, too.
        listed.area_tol_mm2 = min(listed.area_tol_mm2, harmless_mm2(self._recipe))
        wanted, feet = options.segment(self._recipe, self._setup.outline), options.feet(self._recipe)
        search = in_parallel(stop, lambda: front.pockets(wanted, feet, stop), self._recipe.run.threads)
        with search as found:  # its steps leave cores idle
            overview, unseen = front.overview(listed)
            holes = tuple((hole, _cause(hole, self._setup)) for hole in unseen.holes)
            if unseen.coverage < 0.5 * self._recipe.verdict.min_coverage:  # the bridging of drop-outs adds less
                return Found(None, unseen, holes, overview, times_ms, doubt=_TOO_LITTLE)
            part = found()
        times_ms["pockets"] = 1e3 * (time.perf_counter() - began)
        return Found(part, unseen, holes, overview, times_ms)

    def _ply_box(self) -> Floats | None:
        """Return the lowest and highest XY of the ply with the margin that the filters see; None: all the reference."""
        if self._setup.outline is None:
            return None
        margin = max(30.0, 2 * self._recipe.clean.max_hole_mm)
        low, high = self._setup.outline.min(axis=0) - margin, self._setup.outline.max(axis=0) + margin
        lowest, highest = self._setup.prepared.reference.box_mm
        beside = (low >= highest).any() or (high <= lowest).any()
        return None if beside else np.stack([low, high])


def _cause(hole: UnseenHole, setup: Setup) -> str:
    """Return what hides the ply in a hole, as `debulk.results.half_seen.HoleBeside.of` names it."""
    if _is_masked(hole, setup):
        return "mask"
    if hole.reference_share <= 0.5:
        return "scan"
    return "reference" if _in_view(hole.centre, setup) else "view"


def _in_view(place_mm: Floats, setup: Setup) -> bool:
    """Return whether the scanner's picture reaches a place; of a list, whether the reference goes on round it."""
    if setup.prepared.image is None:
        return bool(setup.prepared.between(place_mm[None]).all())
    return bool(_pixels(place_mm[None], setup.prepared.image, setup)[2][0])


def _is_masked(hole: UnseenHole, setup: Setup) -> bool:
    """Return whether the mask hides most of a hole: under a clamp another scan would not show a pocket, either.

    Without a camera, which relates mask and mold, it is not known.
    """
    image, mask = setup.prepared.image, setup.mask
    if image is None or mask is None or mask.shape != image.shape:
        return False
    low, high = setup.prepared.reference.box_mm
    begin, end = np.maximum(hole.box[0], low), np.minimum(hole.box[1], high)
    if (begin >= end).any():
        return False
    x, y = np.meshgrid(*(np.arange(b + 0.5 * _STEP_MM, e, _STEP_MM) for b, e in zip(begin, end, strict=True)))
    row, column, inside = _pixels(np.column_stack([x.ravel(), y.ravel()]), image, setup)
    hidden = np.count_nonzero(mask[row[inside].astype(int), column[inside].astype(int)]) * _STEP_MM**2
    return bool(hidden >= SEEN * hole.area)  # pixels at a tool's edge are often missing in addition to the masked ones


def _pixels(xy: Floats, image: PinholeImage, setup: Setup) -> tuple[Floats, Floats, Bools]:
    """Return whole rows and columns of the pixels that see (N, 2) places of the mold, and which the image has."""
    reference, pose = setup.prepared.reference, setup.pose
    heights = reference.height(np.clip(xy, *reference.box_mm))
    points = product(np.column_stack([xy, heights]) - pose[:3, 3], pose[:3, :3])
    column = np.rint(image.f * points[:, 0] / points[:, 2] + image.cx)
    row = np.rint(image.f * points[:, 1] / points[:, 2] + image.cy)
    ahead = points[:, 2] > 0
    return row, column, ahead & (column >= 0) & (row >= 0) & (column < image.width) & (row < image.height)
