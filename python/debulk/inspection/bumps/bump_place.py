"""A bump that the tolerances drop: the piece of the scan round it is segmented again without the tolerances."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from debulk import _core, pocket
from debulk.grid import Grid
from debulk.inspection.bumps.hills import apart, without_tolerances
from debulk.inspection.find.found import FoundPocket
from debulk.inspection.find.windows import cells_round, cut_out
from debulk.inspection.ply import polyline
from debulk.inspection.ply.fibre_runs import ScanRuns
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.pocket import Dropped, Feet, Segmentation, Unseen
from debulk.recipe import options

_LEAST_HALF_MM = 40.0  # half the side of the first window round a bump; it grows until the bump's foot lies in it
# In standard deviations of the heights' noise: over the thousand pixels of a contour, a peak and a notch of pure noise
# reach five of them each.
_FRAYED = 12.0
_MOST_FRAYED_MM = 0.2  # a notch deeper than this separates two bumps, however noisy the scan is


@dataclass(frozen=True, eq=False)
class BumpPlace:
    """A dropped bump, and the piece of the scan in which it stands."""

    dropped: Dropped
    """The bump as the segmentation lists it."""
    cut_mm: float
    """Height at which it is cut out."""
    whole: Segmentation
    feet: Feet
    """`whole`, `feet`: segmentation and feet of the piece of the scan."""
    unseen: Unseen
    masked: tuple[bool, ...]
    """`unseen`, `masked`: what the scan does not show, and for each of its holes whether the mask hides it."""
    runs: ScanRuns | None
    """The runs of the fibre lines over the scan."""

    def cell(self, heights: Grid) -> tuple[int, int]:
        """Return the column and the row of the bump's middle on a grid."""
        i, j = np.rint((self.dropped.centroid_mm - heights.origin_mm) / heights.spacing_mm).astype(int)
        return int(i), int(j)


def looked_at_again(place: BumpPlace, ply: PlyOnMold, stop: _core.Stop) -> FoundPocket | None:
    """Segment a window round a bump without tolerances; None if it belongs to a pocket or is only a speck."""
    dropped, whole, feet = place.dropped, place.whole, place.feet
    wanted = without_tolerances(ply)
    wanted.cut_height_mm = place.cut_mm
    one = None
    for rows, columns in _windows(place):
        window = cut_out(whole.heights, rows, columns)
        if one is None and _frayed(place, whole.labels.values[rows, columns], window, wanted, stop):
            return None
        again = pocket.segment_with(wanted, window, 1, stop)
        if not again.pockets:
            return None  # it hardly reaches the cut: only a speck of it lies above
        index = min(range(len(again.pockets)), key=lambda k: apart(again.pockets[k], dropped))
        owner = feet.labels.values[rows, columns][again.labels.values == again.pockets[index].id]
        if 2 * np.count_nonzero(owner) > owner.size:
            return None
        lower = options.feet(ply.recipe)
        lower.noise_mm = feet.noise_mm  # the noise of the whole scan: a window is too small to estimate it
        # Smoothed over the window that suits a pocket, a bump 10 mm wide would lose half of its excess.
        bump = again.pockets[index]
        lower.smooth_mm = min(lower.smooth_mm, bump.area_mm2 / _perimeter_mm(bump.outline_mm))
        again.pockets[index] = replace(
            again.pockets[index], measured_share=dropped.measured_share, touches_unknown=dropped.touches_unknown
        )
        its_feet = pocket.feet_with(lower, again, 1, stop)
        one = FoundPocket(0, again, its_feet, index, place.unseen, masked=place.masked, runs=place.runs)
        if one.foot.closed:
            break
    return one


def _frayed(
    place: BumpPlace, labels: NDArray[np.int32], window: Grid, wanted: _core.pocket.SegmentOptions, stop: _core.Stop
) -> bool:
    """Return whether only noise separates a bump from a pocket, whose contour frays where a broad pocket is flat."""
    cut_mm = wanted.cut_height_mm
    wanted.cut_height_mm = place.dropped.peak_mm - min(_FRAYED * place.feet.noise_mm, _MOST_FRAYED_MM)
    try:
        if not 0 < wanted.cut_height_mm < cut_mm:
            return False
        lower = pocket.segment_with(wanted, window, 1, stop)
    finally:
        wanted.cut_height_mm = cut_mm
    i, j = place.cell(window)
    number = lower.labels.values[j, i]
    return bool(number > 0 and (labels[lower.labels.values == number] > 0).any())


def _perimeter_mm(outline: NDArray[np.float64]) -> float:
    return polyline.length_mm(np.vstack([outline, outline[:1]]))


def _windows(place: BumpPlace) -> Iterator[tuple[slice, slice]]:
    """Yield rows and columns of wider and wider windows round a bump, up to the whole grid."""
    heights = place.whole.heights
    ny, nx = heights.values.shape
    middle, half_mm = place.dropped.centroid_mm, max(_LEAST_HALF_MM, 3 * math.sqrt(place.dropped.area_mm2))
    while True:
        rows, columns = cells_round(np.stack([middle, middle]), heights, half_mm)
        yield rows, columns
        if (rows.start, columns.start, rows.stop, columns.stop) == (0, 0, ny, nx):
            return
        half_mm *= 2
