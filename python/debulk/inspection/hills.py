"""What stands up below the cut's height: no pocket, but a ply too short for a hollow may stay there as a bridge."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from debulk import _core, pocket
from debulk.grid import Grid
from debulk.inspection.ply_on_mold import PlyOnMold
from debulk.pocket import Dropped, Feet, Segmentation
from debulk.recipe import Recipe, options

__all__ = ["apart", "find", "look_mm", "without_tolerances"]

_ABOVE_FOOT_MM = 0.05  # a hill's contour is cut at least so much above its foot
_SPECK_SHARE = 0.05  # of AreaTol: the segmentation lists nothing smaller
_LARGEST_SPECK_MM2 = 10.0  # as of the default tolerance: what is larger can crease, whatever the tolerance is


def look_mm(feet: Feet, recipe: Recipe) -> float:
    """Height from which hills are looked at; no lower than where their feet begin."""
    return max(options.flag_mm(recipe), recipe.material.thickness_mm + feet.mold_tol_mm + _ABOVE_FOOT_MM)


def find(whole: Segmentation, feet: Feet, ply: PlyOnMold, stop: _core.Stop) -> Iterator[Dropped]:
    """Find what stands as high as `look_mm` without reaching the cut, off the pockets' feet; raises `Stopped`."""
    least_mm = look_mm(feet, ply.recipe)
    heights = Grid(whole.heights.values, whole.heights.origin_mm, whole.heights.spacing_mm)
    stands = (heights.values >= least_mm) & (feet.heights.values >= least_mm)  # smoothed: noise is no hill
    if least_mm >= whole.cut_height_mm or not (stands & (feet.labels.values == 0)).any():
        return
    wanted = without_tolerances(ply)
    listed = _listed(whole, heights, wanted, stop)
    wanted.cut_height_mm = least_mm
    lower = pocket.segment_with(wanted, heights, 1, stop)
    known = _ids(lower.labels, listed | (feet.labels.values > 0))
    high = _ids(lower.labels, stands)
    # The largest of those that stand on one foot: its net spans the others too, which are as a rule its frayed rim.
    wanted.cut_height_mm = least_mm - _ABOVE_FOOT_MM
    ground = pocket.segment_with(wanted, Grid(feet.heights.values, heights.origin_mm, heights.spacing_mm), 1, stop)
    both = (lower.labels.values > 0) & (ground.labels.values > 0)
    pairs = np.unique(np.stack([lower.labels.values[both], ground.labels.values[both]]), axis=1)
    taken: set[int] = set()
    for one in lower.pockets:
        if one.id not in high or one.id in known:
            continue
        stands_on = set(pairs[1, pairs[0] == one.id].tolist())
        if stands_on & taken:
            continue
        taken |= stands_on
        yield Dropped("height", one.area_mm2, one.peak_mm, one.centroid_mm, one.touches_unknown, one.measured_share)


def without_tolerances(ply: PlyOnMold) -> _core.pocket.SegmentOptions:
    """Segment as the recipe says, but drop only specks."""
    wanted = options.segment(ply.recipe, ply.outline)
    wanted.area_tol_mm2 = min(_SPECK_SHARE * wanted.area_tol_mm2, _LARGEST_SPECK_MM2)
    wanted.peak_tol_mm = 0.0
    return wanted


def apart(candidate: pocket.Pocket, dropped: Dropped) -> float:
    """Tell by how much a pocket differs from a bump in place and size, in mm."""
    away = float(np.linalg.norm(candidate.centroid_mm - dropped.centroid_mm))
    return away + abs(math.sqrt(candidate.area_mm2) - math.sqrt(dropped.area_mm2))


def _listed(
    whole: Segmentation, heights: Grid, wanted: _core.pocket.SegmentOptions, stop: _core.Stop
) -> NDArray[np.bool_]:
    """Tell the cells of the bumps that are listed above the cut: the middle of a bent one may lie off it."""
    cells = np.zeros(heights.values.shape, dtype=np.bool_)
    if whole.dropped and (above := pocket.segment_with(wanted, heights, 1, stop)).pockets:
        for bump in whole.dropped:
            nearest = min(above.pockets, key=lambda one: apart(one, bump))
            cells |= above.labels.values == nearest.id
    return cells


def _ids(labels: Grid, cells: NDArray[np.bool_]) -> set[int]:
    return {int(label) for label in np.unique(labels.values[cells])}
