"""The highest ridge that a debulked ply's cells may not show: between its points, and where nobody saw it.

A ridge is read along itself: of cells in a row, in one of twelve directions, the median. Some such row reads a straight
ridge within half a cell of its crest, where a median over 5 by 5 cells reads it up to 1.5 cells away
(`tests/python/inspection/test_hidden_ridge.py`). How much lower it is there follows from its section, the elastic fold
of docs/model.md, section 6, which folds as high as a third of the natural length keep within 1 %.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats, Singles
from debulk.inspection.evidence import medians
from debulk.inspection.evidence.pieces import pieces_of
from debulk.recipe import Recipe
from debulk.section import elastic_fold
from debulk.verdict import natural_length

ROWS = 5, 13  # cells: short ones lie on short ridges, long ones survive six flying pixels and more noise
_UNIT = [np.array([math.sin(turn), math.cos(turn)]) for turn in np.arange(12) * math.pi / 12]  # directions
OFF_CREST, OFF_CREST_OF_MEDIAN = 0.5, 1.5  # cells
_LEAST_MM = 0.01  # no height is known better
_PART = 0.25  # of a pocket's width: so long a part of a ridge stands out, and no group of flying pixels does
_K = 4.4934  # tan k = k, in the fold's section


class Hidden:
    """What cells may hide that are so wide, or whose points lie so far apart, and that were blurred by this variance.

    The blur is that of the weights (1 - d²/r²)² within a radius r (`cpp/debulk/surface/gridding.hpp`).
    """

    def __init__(self, recipe: Recipe, cell_mm: float, blur_mm2: float) -> None:
        material = recipe.material
        length_mm = natural_length(material.young_mpa, material.thickness_mm, recipe.loads.pressure_mpa)
        folds = [elastic_fold(excess * length_mm, recipe) for excess in np.geomspace(1e-7, 20.0, 600).tolist()]
        self.cell_mm, self._base_mm = cell_mm, material.consolidated_mm
        self._heights_mm = np.array([fold.height_mm for fold in folds])
        self._halves_mm = np.array([fold.foot_width_mm for fold in folds])[:, None] / 2
        away = np.linspace(-1.0, 1.0, 22)[1:-1]
        weights = (1 - away**2) ** 2.5
        self._blur_mm = math.sqrt(blur_mm2)
        self._away_mm, self._weights = away * math.sqrt(8) * self._blur_mm, weights / weights.sum()

    def highest_mm(self, heights: Singles, read: Singles, inside: NDArray[np.bool_], foot: NDArray[np.bool_]) -> float:
        """Return how high the ply may stand within a pocket: by heights, and `read`, medians of 5 by 5; NaN = not seen.

        Each reading bounds it, and the lowest bound counts: that of rows where cells are wide, that of the medians
        where cells are narrow and flying pixels fill a row, and in the foot, which reaches beyond the outline and may
        have many of these, that of what stands along a part of a ridge.
        """
        own, beside = np.pad(inside, 1), np.pad(foot, 1)
        known, medians_of = (np.pad(of.astype(np.float64), 1, constant_values=np.nan) for of in (heights, read))
        wide = 2 * float(_depth(own).max())
        holes = list(_holes(own & np.isnan(known)))
        readings = [(along(known, cells), OFF_CREST, math.sqrt(2) * (cells - 1) / 4) for cells in ROWS]
        readings.append((medians_of, OFF_CREST_OF_MEDIAN, 2.0))
        within = min(
            self._behind_mm(of[own], _highest(of[own]), off, ahead, wide, holes) for of, off, ahead in readings
        )
        around = min(
            self._behind_mm(of[beside], top_mm, off, ahead + more, wide, [])
            for of, off, ahead in readings
            for top_mm, more in ((_highest(of[beside]), 0.0), (_reached(of, beside, _PART * wide), _PART * wide / 2))
        )
        return self._base_mm + max(within, around)

    def _behind_mm(
        self, values: Floats, top_mm: float, off: float, ahead: float, wide: float, holes: list[tuple[float, float]]
    ) -> float:
        """Return the highest fold behind a pocket's readings, so many cells off its crest, and behind its holes.

        A ridge is at least as long as the pocket is wide and highest in its middle, by the excess of the bump that it
        comes from, cos² over its length. So a hole hides it no better than by its own width between points, or than
        its crest lies above what stands at both ends of the hole; and so does a row, whose median is that of cells so
        far ahead, and the blur.
        """
        values = values[np.isfinite(values)]
        if not len(values):
            return math.inf
        laid = float(np.median(values))  # most of a pocket is laid ply, also where all of it lies a little too low
        sigma = medians.OF_MEDIAN * float(np.median(np.abs(values - laid)))
        ahead = math.hypot(ahead, self._blur_mm / self.cell_mm)
        read_mm = max(_LEAST_MM, top_mm - min(laid, self._base_mm) + sigma) / _taper(2 * ahead / wide)
        between = self._seen_mm(off * self.cell_mm)
        highest_mm = self._highest_mm(read_mm, between)
        for length, deep in holes:
            if (along_mm := self._highest_mm(read_mm / _taper(length / wide), between)) > highest_mm:
                across_mm = self._highest_mm(read_mm, self._seen_mm((off + deep) * self.cell_mm))
                highest_mm = max(highest_mm, min(along_mm, across_mm))
        return highest_mm

    def _seen_mm(self, off_mm: float) -> Floats:
        """Return how high cells show each fold that far from its crest."""
        u = np.minimum(np.abs(off_mm + self._away_mm) / self._halves_mm, 1.0)
        shape = (_section(1.0) - _section(u)) / (_section(1.0) - _section(0.0))
        return np.asarray(self._heights_mm * (shape * self._weights).sum(axis=1), dtype=np.float64)

    def _highest_mm(self, read_mm: float, seen_mm: Floats) -> float:
        """Return the height of the highest fold that is seen no higher than was read."""
        hidden = np.flatnonzero(seen_mm <= read_mm)
        if not len(hidden):
            return 0.0
        pair = slice(hidden[-1], hidden[-1] + 2)
        return float(np.interp(read_mm, seen_mm[pair], self._heights_mm[pair]))


def _highest(values: Floats) -> float:
    return float(np.nanmax(values, initial=-np.inf))


def _reached(of: Floats, marks: NDArray[np.bool_], length: float) -> float:
    """Return the highest of the marked values that a connected part, so many cells long, reaches everywhere."""
    low, high = -_highest(-of[marks]), _highest(of[marks])
    while high - low > _LEAST_MM / 2:
        middle = (low + high) / 2
        stands = (marks & ~(of < middle)).view(np.uint8)  # what was not seen may stand
        boxes = cv2.connectedComponentsWithStats(stands, connectivity=8)[2][1:]
        far = np.hypot(boxes[:, cv2.CC_STAT_WIDTH], boxes[:, cv2.CC_STAT_HEIGHT]) >= length
        low, high = (middle, high) if far.any() else (low, middle)
    return high


def _holes(unseen: NDArray[np.bool_]) -> Iterator[tuple[float, float]]:
    """Yield of each hole how long it is, and how far its middle lies from what was seen, in cells."""
    depth = _depth(unseen)
    for part, own in pieces_of(unseen, 8).each(1, 0):
        y, x = np.nonzero(own)
        yield max(float(np.ptp(x * dx + y * dy)) + 1 for dy, dx in _UNIT), float(depth[part][own].max())


def _taper(share: float) -> float:
    """Return how high a ridge is, over its crown, at both ends of this share of its length about the crown."""
    return float(max(math.cos(math.pi / 2 * min(share, 1.0)), 1e-4) ** (16 / 7))


def _section(u: Floats | float) -> Floats:
    """Return how far a fold has come down from its crown at this share of its half width, up to a factor."""
    return np.asarray(u * u / 2 + np.cos(_K * u) / (_K * _K * math.cos(_K)))


def along(heights: Floats, cells: int) -> Floats:
    """Return the highest median of a row of so many cells about each; NaN where most of every row was not seen."""
    highest = np.full(heights.shape, np.nan)
    reach, (ny, nx) = cells // 2, heights.shape
    padded = np.pad(heights, reach, constant_values=np.nan)
    for unit in _UNIT:
        places = reach + np.rint(np.arange(-reach, reach + 1)[:, None] * unit / np.abs(unit).max()).astype(int)
        row = np.sort([padded[y : y + ny, x : x + nx] for y, x in places], axis=0)  # NaN comes last
        seen = np.count_nonzero(np.isfinite(row), axis=0)
        middle = np.take_along_axis(row, seen[None] // 2, axis=0)[0]
        highest = np.fmax(highest, np.where(2 * seen > cells, middle, np.nan))
    return highest


def _depth(marks: NDArray[np.bool_]) -> Singles:
    """Return how many cells each mark lies from what is not marked, 0 there."""
    return np.asarray(cv2.distanceTransform(marks.view(np.uint8), cv2.DIST_L2, 5), dtype=np.float32)
