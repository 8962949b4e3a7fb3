"""Bumps that stay below the cut height ("hills"): no pockets, but a ply too short for a hollow may bridge it there."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk import _core, pocket
from debulk.grid import Grid
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.inspection.running.stopping import heed
from debulk.pocket import Dropped, Feet, Segmentation
from debulk.recipe import options

_SEARCH = "the search for low hills"  # it heeds a stop between passes over all cells, of some ten milliseconds each
_ABOVE_FOOT_MM = 0.05  # a hill's contour is cut at least this far above its foot
_SPECK_SHARE = 0.05  # of AreaTol (`area_tol_mm2`): the segmentation lists nothing smaller
_LARGEST_SPECK_MM2 = 10.0  # that share of the default tolerance: larger bumps can crease, whatever the tolerance is


class Hill(NamedTuple):
    """A hill as a dropped bump, and the height at which it is cut out."""

    dropped: Dropped
    cut_mm: float


def find(whole: Segmentation, feet: Feet, ply: PlyOnMold, stop: _core.Stop, threads: int = 1) -> Iterator[Hill]:
    """Find bumps below the cut and off the pockets' feet: first hills, then lower ones; raises `Stopped`.

    Hills stand clearly above noise and ripples, and are judged in the same way as bumps. The excess of a fibre over
    lower ones is negligible, but a bridge above the limit may stand no higher than they do.
    """
    heights = Grid(whole.heights.values, whole.heights.origin_mm, whole.heights.spacing_mm)
    lower_mm = max(options.flag_mm(ply.recipe), ply.recipe.material.thickness_mm + feet.mold_tol_mm + _ABOVE_FOOT_MM)
    known: NDArray[np.bool_] | None = None
    for cut_mm, smooth in ((feet.hill_mm, heights), (lower_mm, feet.heights)):
        if cut_mm >= whole.cut_height_mm:
            continue
        stands = _above(cut_mm, heights, smooth, stop)
        if not _off_feet(stands, feet, stop):
            continue
        if known is None:
            known = _listed(whole, heights, without_tolerances(ply), threads, stop) | (feet.labels.values > 0)
        found = _at(cut_mm, heights, ply, threads, stop)
        fresh = _ids(found.labels, stands)
        heed(stop, _SEARCH)
        fresh -= _ids(found.labels, known)
        heed(stop, _SEARCH)
        if fresh and cut_mm < feet.hill_mm:
            fresh = _one_a_foot(found, fresh, _at(cut_mm - _ABOVE_FOOT_MM, feet.heights, ply, threads, stop))
        known |= found.labels.values > 0
        for one in found.pockets:
            if one.id in fresh:
                yield Hill(_as_dropped(one), cut_mm)


def without_tolerances(ply: PlyOnMold) -> _core.pocket.SegmentOptions:
    """Return the recipe's options for the segmentation, changed so that only specks are dropped."""
    wanted = options.segment(ply.recipe, ply.outline)
    wanted.area_tol_mm2 = min(_SPECK_SHARE * wanted.area_tol_mm2, _LARGEST_SPECK_MM2)
    wanted.peak_tol_mm = 0.0
    return wanted


def apart(candidate: pocket.Pocket, dropped: Dropped) -> float:
    """Return by how much a pocket differs from a bump in place and size, in mm."""
    away = float(np.linalg.norm(candidate.centroid_mm - dropped.centroid_mm))
    return away + abs(math.sqrt(candidate.area_mm2) - math.sqrt(dropped.area_mm2))


def _listed(
    whole: Segmentation, heights: Grid, wanted: _core.pocket.SegmentOptions, threads: int, stop: _core.Stop
) -> NDArray[np.bool_]:
    """Return all cells of the bumps listed above the cut, as a bump's centre alone may lie off a bent bump."""
    cells = np.zeros(heights.values.shape, dtype=np.bool_)
    if whole.dropped and (above := pocket.segment_with(wanted, heights, threads, stop)).pockets:
        for bump in whole.dropped:
            nearest = min(above.pockets, key=lambda one: apart(one, bump))
            cells |= above.labels.values == nearest.id
    return cells


def _above(cut_mm: float, heights: Grid, smooth: Grid, stop: _core.Stop) -> NDArray[np.bool_]:
    """Return the cells above the cut; for a low cut their smoothed heights, which are free of noise, must be, too."""
    stands: NDArray[np.bool_] = heights.values >= cut_mm
    heed(stop, _SEARCH)
    if smooth is not heights:
        stands &= smooth.values >= cut_mm
        heed(stop, _SEARCH)
    return stands


def _off_feet(stands: NDArray[np.bool_], feet: Feet, stop: _core.Stop) -> bool:
    off = feet.labels.values == 0
    heed(stop, _SEARCH)
    off &= stands
    return bool(off.any())


def _at(cut_mm: float, heights: Grid, ply: PlyOnMold, threads: int, stop: _core.Stop) -> Segmentation:
    wanted = without_tolerances(ply)
    wanted.cut_height_mm = cut_mm
    return pocket.segment_with(wanted, heights, threads, stop)


def _as_dropped(one: pocket.Pocket) -> Dropped:
    return Dropped("height", one.area_mm2, one.peak_mm, one.centroid_mm, one.touches_unknown, one.measured_share)


def _one_a_foot(found: Segmentation, fresh: set[int], ground: Segmentation) -> set[int]:
    """Keep the largest of the bumps on the same ground: its net spans the others, mostly parts of its frayed rim."""
    kept: set[int] = set()
    taken: set[int] = set()
    for one in found.pockets:
        if one.id not in fresh:
            continue
        stands_on = _ids(ground.labels, found.labels.values == one.id)
        if not stands_on & taken:
            kept.add(one.id)
            taken |= stands_on
    return kept


def _ids(labels: Grid, cells: NDArray[np.bool_]) -> set[int]:
    return set(np.flatnonzero(np.bincount(labels.values[cells])).tolist()) - {0}
