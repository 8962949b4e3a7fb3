"""A sample of a scan's points, checked before all others: where they are, and how high above the reference."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from debulk import _core, cloud
from debulk.arrays import Bools, Cloud, Floats
from debulk.grid import Grid
from debulk.inspection.clouds.enough import POINTS
from debulk.inspection.clouds.thinning import complete, thinned
from debulk.inspection.clouds.unseen_marks import refuse_marks
from debulk.inspection.evidence.cloud_image import step_of
from debulk.inspection.ply.ply_on_mold import Setup


@dataclass(frozen=True, eq=False)
class Sample:
    """Some points of a scan, mold frame."""

    points_mm: Floats
    """(N, 3), all finite."""
    height_mm: Floats
    """(N,) heights above the reference along z; NaN where the reference was not seen."""
    each: int
    """Number of the scan's points that each of these stands for."""
    same: Bools
    """(N,) which of the points are in the reference cloud, bit for bit; all False if that is not known."""
    rounded: bool = False
    """Whether the depths were rounded, so that points of both clouds may be the same by chance."""
    pitch_mm: float = np.inf
    """Side of the square that each point of the scan has for itself, where it shows the ply; inf: not known."""
    widest_mm: float = np.inf
    """Distance from point to point where they lie farthest apart, as between the lines of a line scanner."""
    apart_mm: float = 0.0
    """Distance of two layers in one list of points; 0: one layer. See `two_layers`."""
    on_ply: Bools = field(default_factory=lambda: np.zeros(0, np.bool_))
    """(N,) which of the points lie on the ply, well inside its outline; empty: not known yet."""

    def overview(self) -> Grid:
        """Return the heights as a coarse picture."""
        seen = np.isfinite(self.height_mm)
        xy, heights = self.points_mm[seen, :2], self.height_mm[seen]
        if not len(xy):
            return Grid(np.full((1, 1), np.nan, dtype=np.float32), np.zeros(2), 1.0)
        low, size = xy.min(axis=0), np.ptp(xy, axis=0)
        spacing = max(1.0, 1.5 * float(np.sqrt(size[0] * size[1] / len(xy))))
        column, row = np.rint((xy - low) / spacing).astype(np.int64).T
        values = np.full((row.max() + 1, column.max() + 1), np.nan, dtype=np.float32)
        values[row, column] = heights
        return Grid(values, low, spacing)


def sampled(scan: ArrayLike, setup: Setup) -> Sample:
    """Take a sample of a scan."""
    whole = cloud.as_cloud(scan, "scan")
    if whole.size < POINTS:  # it may be no cloud
        cloud.checked(whole, "scan")
    points, each = thinned(whole, setup.mask)
    seen = complete(np.isfinite(points))
    same = _same(points, setup.prepared.sample)[seen]
    points = points.take(np.flatnonzero(seen), axis=0)  # four times faster than marks that select rows
    refuse_marks(points, "scan")
    rounded = bool(same.any()) and step_of(points[:, 2]) > 0
    return replace(sample_of(points, setup), each=each, same=same, rounded=rounded)


def sample_of(points: Cloud, setup: Setup) -> Sample:
    """Make a sample of (N, 3) points of a scan, all finite, each of which stands for itself alone."""
    moved, on = over_reference(points, setup)
    in_mold = moved.astype(np.float64, order="F")  # each coordinate is contiguous: the checks read them one by one
    heights, below = np.full(len(in_mold), np.nan), np.flatnonzero(on)
    if len(below):
        heights[below] = in_mold[below, 2] - setup.prepared.datum.height(in_mold[:, :2].take(below, axis=0))
    return Sample(in_mold, heights, 1, np.zeros(len(in_mold), np.bool_))


def over_reference(points: Cloud, setup: Setup, *more: Grid) -> tuple[Cloud, Bools]:
    """Return (N, 3) points of a scan in the mold's frame, and which of them lie where the mold was seen below.

    Points that were not seen are none of these, nor those over whose place one of `more`, marks, is not set.
    """
    box_mm, threads = setup.prepared.datum.box_mm, setup.recipe.run.threads
    marks = [(grid.values, grid.origin_mm, float(grid.spacing_mm)) for grid in (setup.prepared.seen_at, *more)]
    moved, on = _core.cloud.points_over(points, setup.mold_from_scanner, box_mm, marks, threads, _core.Stop())
    return moved, on.view(np.bool_)


def _same(points: Cloud, reference: Cloud | None) -> Bools:
    if reference is None or reference.shape != points.shape:
        return np.zeros(len(points), dtype=np.bool_)
    return complete(points == reference)
