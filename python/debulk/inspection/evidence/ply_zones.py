"""Where the ply's level is read: well inside the outline, outside the pockets, in squares that cover the ply evenly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk import pocket
from debulk.arrays import Bools, Floats
from debulk.grid import Grid
from debulk.inspection.clouds.enough import FEW, PLACES
from debulk.inspection.evidence.medians import error
from debulk.inspection.evidence.outline import STRETCH_MM, STRIP_MM
from debulk.inspection.evidence.sample import Sample
from debulk.words import Place, xy_of

SIDES_MM = tuple(STRETCH_MM / k for k in (1, 2, 4))  # of the squares: the largest that gives enough for a fit is taken
INSET_MM = 10.0  # from the outline: nearer to its edge, the ply is not seen from above alone
LEAST_POINTS = 9  # in a square: their median is uncertain by 0.4 of their noise
_LEAST_SHARE = 0.6  # of a square's points: if pockets cover more, the ply there has not come down to the mold yet


@dataclass(frozen=True, eq=False)
class Blocks:
    """Squares of the ply with the medians of their heights."""

    xy_mm: Floats
    """(B, 2) middles."""
    height_mm: Floats
    """(B,) medians above the datum."""
    error_mm: Floats
    """(B,) standard errors of these medians, from the quartiles of the heights."""
    side_mm: float
    """Side of the squares."""
    ply_share: float
    """Share of the ply's area that lies in them."""


class PlyZones:
    """Finds the squares of scan after scan; everything that does not depend on the scan is prepared once.

    Without an outline, all of the reference counts as the ply, whose known part lies in the box from `low_mm` to
    `high_mm`, (2,) each.
    """

    def __init__(self, ply_outline: Floats | None, low_mm: Floats, high_mm: Floats) -> None:
        if ply_outline is not None:
            low_mm, high_mm = np.maximum(low_mm, ply_outline.min(axis=0)), np.minimum(high_mm, ply_outline.max(axis=0))
        self.box_mm = np.stack([low_mm, high_mm])
        size = np.maximum(high_mm - low_mm, STRIP_MM)
        nx, ny = np.ceil(size / STRIP_MM).astype(int) + 1
        x, y = low_mm[0] + STRIP_MM * np.arange(nx), low_mm[1] + STRIP_MM * np.arange(ny)
        xy = np.stack(np.meshgrid(np.minimum(x, high_mm[0]), np.minimum(y, high_mm[1])), axis=-1).reshape(-1, 2)
        on = np.ones(len(xy), dtype=np.bool_)
        if ply_outline is not None:
            on = pocket.inside(ply_outline, xy)
            on[on] = pocket.distance_to_outline(ply_outline, xy[on]) > INSET_MM
        self._low, self.on = low_mm, Grid(on.reshape(ny, nx), low_mm, STRIP_MM)  # `on`: as `hold` says it
        self.area_mm2 = float(size[0] * size[1]) if ply_outline is None else abs(pocket.polygon_area(ply_outline))
        self.inner_mm2 = float(np.count_nonzero(on)) * STRIP_MM**2
        self.side_mm = next((s for s in SIDES_MM if self.inner_mm2 >= FEW * s * s), SIDES_MM[-1])
        self._across = int((size[0] + STRIP_MM) / self.side_mm) + 1
        # One spare row of squares: `inside` rounds to cells, which reach past the last square by half a cell.
        squares = self._across * (int((high_mm[1] - low_mm[1] + STRIP_MM) / self.side_mm) + 2)
        block = self._block_of(xy[on])
        self._block_cells = np.bincount(block, minlength=squares)
        self.squares = int(np.count_nonzero(self._block_cells * STRIP_MM**2 >= _LEAST_SHARE * self.side_mm**2))

    def inside(self, sample: Sample) -> Bools:
        """Return which points of a sample have a height and lie on the ply, well inside its outline."""
        on: Bools = np.isfinite(sample.height_mm)
        on[on] = self.hold(sample.points_mm[on, :2])
        return on

    def hold(self, xy_mm: Floats) -> Bools:
        """Return which places (N, 2) lie on the ply, well inside its outline."""
        return self.on.at(xy_mm, beyond=0.0) > 0

    def cells(self, heights: Grid) -> Bools:
        """Return which cells of a map lie on the ply, well inside its outline."""
        return self.on.on_grid(heights.x_mm, heights.y_mm, beyond=0.0)

    def blocks(self, sample: Sample, used: Bools) -> Blocks:
        """Return the medians of the used points in each square in which most of the points on the ply are used."""
        size = len(self._block_cells)
        block = self._block_of(sample.points_mm[sample.on_ply, :2])
        on_ply = np.bincount(block, minlength=size)
        block = block[used[sample.on_ply]]
        heights = _by_block(block, sample.height_mm[used])
        counts = np.bincount(block, minlength=size)
        numbers = np.flatnonzero((counts >= LEAST_POINTS) & (counts >= _LEAST_SHARE * on_ply))
        first, count = (np.cumsum(counts) - counts)[numbers], counts[numbers]
        medians = 0.5 * (heights[first + (count - 1) // 2] + heights[first + count // 2])
        quartiles = heights[first + 3 * (count - 1) // 4] - heights[first + (count - 1) // 4]
        middle = np.stack([numbers % self._across, numbers // self._across], axis=1) + 0.5
        cells = self._block_cells[numbers].sum()
        return Blocks(
            xy_mm=self._low + self.side_mm * middle,
            height_mm=medians,
            error_mm=error(quartiles, count),
            side_mm=self.side_mm,
            ply_share=min(1.0, float(cells) * STRIP_MM**2 / self.area_mm2),
        )

    def most_marked(self, sample: Sample, least: int) -> tuple[float, Place]:
        """Return the largest share of the reference's points in a square with so many at least, and its middle."""
        block, size = self._block_of(sample.points_mm[sample.on_ply, :2]), len(self._block_cells)
        points, marked = (np.bincount(of, minlength=size) for of in (block, block[sample.same[sample.on_ply]]))
        share = np.where(marked >= least, marked / np.maximum(points, 1), 0.0)
        number = int(np.argmax(share))
        middle = self._low + self.side_mm * (np.array([number % self._across, number // self._across]) + 0.5)
        return float(share[number]), xy_of(middle)

    def _block_of(self, xy: Floats) -> NDArray[np.int64]:
        column, row = (np.maximum(xy - self._low, 0.0) / self.side_mm).astype(np.int64).T
        return np.asarray(row * self._across + column)


def _by_block(block: NDArray[np.int64], heights: Floats) -> Floats:
    """Sort heights by square, then by height, rounded to single precision.

    The number of the square and the height are packed into one whole number, because whole numbers are sorted ten times
    faster than pairs. The bits of a float, with all but the sign inverted in negative ones, sort as the values do.
    """

    def turned(bits: NDArray[np.int32]) -> NDArray[np.int32]:
        return bits ^ ((bits >> 31) & np.int32(0x7FFFFFFF))

    keys = (block << 32) + turned(heights.astype(np.float32).view(np.int32))
    keys.sort()
    return turned(keys.astype(np.int32)).view(np.float32).astype(np.float64)


def off_pockets(points_mm: Floats, outlines_mm: Sequence[Floats]) -> Bools:
    """Return which (N, 2 or more) points lie in none of the outlines."""
    off = np.ones(len(points_mm), dtype=np.bool_)
    x, y = points_mm[:, 0], points_mm[:, 1]
    for corners in outlines_mm:
        outline = corners[:: max(1, len(corners) // PLACES)]
        (left, low), (right, high) = outline.min(axis=0), outline.max(axis=0)
        near = np.flatnonzero((x >= left) & (x <= right) & (y >= low) & (y <= high))
        if len(near):
            off[near[pocket.inside(outline, points_mm[near, :2])]] = False
    return off
