"""The highest ridge that a debulked ply's cells may not show: between its points, and where nobody saw it.

A ridge is read along itself: of cells in a row, in one of twelve directions, the median. Some such row reads a straight
ridge within half a cell of its crest, where a median over 5 by 5 cells reads it up to 1.5 cells away
(`tests/python/inspection/test_hidden_ridge.py`). How much lower it is there follows from its section, the elastic fold
of docs/model.md, section 6, which folds as high as a third of the natural length keep within 1 %.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk.arrays import Floats, Singles, Whole
from debulk.grid import Grid
from debulk.inspection.evidence import medians
from debulk.inspection.evidence.pieces import pieces_of
from debulk.recipe import Recipe
from debulk.section import elastic_fold
from debulk.verdict import natural_length

MEDIAN_CELLS = 5  # width of the median by which peaks are read: runs of flying pixels survive a smaller one
ROWS = 5, 13  # cells: short ones lie on short ridges, long ones survive six flying pixels and more noise
_UNIT = [np.array([math.sin(turn), math.cos(turn)]) for turn in np.arange(12) * math.pi / 12]  # directions
OFF_CREST, OFF_CREST_OF_MEDIAN = 0.5, 1.5  # cells
_READINGS = *((OFF_CREST, math.sqrt(2) * (cells - 1) / 4) for cells in ROWS), (OFF_CREST_OF_MEDIAN, 2.0)
"""Of each reading, how far off a crest it may lie, and how far ahead the cell whose height it is."""
STANDS_OUT = 6.0  # median deviations, four sigma: so far from the ply's height nothing lies by noise
_LEAST_MM = 0.01  # no height is known better
_PART = 0.25  # of a pocket's width: so long a part of a ridge stands out, and no group of flying pixels does
_K = 4.4934  # tan k = k, in the fold's section


def read(heights: Grid, threads: int = 0) -> Grid:
    """Return the (ny, nx, 4) heights and their readings: by rows of 5 and of 13 cells, and by medians of 5 by 5."""
    values = np.asarray(heights.values, dtype=np.float32)
    rows = [_core.surface.row_medians(values, cells, threads) for cells in ROWS]
    by = np.stack([values, *rows, _core.surface.median(values, MEDIAN_CELLS, threads)], axis=-1)
    return Grid(by, heights.origin_mm, heights.spacing_mm)


def width(inside: NDArray[np.bool_]) -> float:
    """Return how wide a pocket is, by its marked cells, in cells."""
    return 2 * float(_depth(np.pad(inside, 1)).max())


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

    def highest_mm(self, seen: Singles, marks: NDArray[np.bool_], wide: float) -> float:
        """Return how high a ridge may stand among the marked cells: what a part of one reaches everywhere."""
        if not marks.any():
            return -math.inf
        whole, part = (np.pad(self.may_stand_mm(seen, marks, wide, cells), 1) for cells in (0.0, _PART * wide / 2))
        return min(float(whole.max()), _reached(part, np.pad(marks, 1), _PART * wide))

    def may_stand_mm(self, seen: Singles, marks: NDArray[np.bool_], wide: float, part: float) -> Floats:
        """Return the map of what may stand: how high a ridge, so many cells long, may be at each marked cell; 0 beside.

        Each reading bounds it, and the lowest bound counts: that of rows where cells are wide, that of the medians
        where cells are narrow and flying pixels fill a row.
        """
        behind = [self._behind_mm(seen[..., [0, k]], marks, wide, part, *rule) for k, rule in enumerate(_READINGS, 1)]
        out = np.zeros(marks.shape)
        out[marks] = self._base_mm + np.min(behind, axis=0)
        return out

    def _behind_mm(
        self, seen: Singles, marks: NDArray[np.bool_], wide: float, part: float, off: float, ahead: float
    ) -> Floats:
        """Return the highest folds behind a reading, so many cells off its crest, and behind holes, at marked cells.

        A ridge is at least as long as a pocket is wide and highest in its middle, by the excess of the bump that it
        comes from, cos² over its length. So a hole hides it no better than by its own width between points, or than
        its crest lies above what stands at both ends of the hole; and so does a row, whose median is that of cells so
        far ahead, and the blur.
        """
        values = seen[marks].astype(np.float64)
        hole, of = np.isnan(values).any(axis=1), values[:, 1]
        if hole.all():
            return np.full(len(of), math.inf)
        laid, spread = level(of[~hole])
        doubt_mm = medians.OF_MEDIAN * spread - min(laid, self._base_mm)
        ahead = 2 * math.hypot(ahead + part, self._blur_mm / self.cell_mm)
        behind = self._behind(off)
        out = behind(np.fmax(of + doubt_mm, _LEAST_MM) / _taper(ahead / wide))
        if hole.any():
            unseen = np.zeros(marks.shape, dtype=bool)
            unseen[marks] = hole
            number, length, deep, top = _holes(unseen, seen[..., 1])
            read_mm = np.fmax(np.where(np.isnan(top), math.inf, top + doubt_mm), _LEAST_MM)
            along, across = behind(read_mm / _taper((ahead + length) / wide)), read_mm / _taper(ahead / wide)
            for depth in np.unique(deep):
                at = deep == depth
                along[at] = np.minimum(along[at], self._behind(off + float(depth))(across[at]))
            out[hole] = along[number]
        return out

    def _behind(self, off: float) -> Callable[[Floats], Floats]:
        """Return the function that gives the highest fold that so far from its crest, in cells, is seen that high."""
        u = np.minimum(np.abs(off * self.cell_mm + self._away_mm) / self._halves_mm, 1.0)
        shape = (_section(1.0) - _section(u)) / (_section(1.0) - _section(0.0))
        seen_mm = self._heights_mm * (shape * self._weights).sum(axis=1)
        return lambda read_mm: np.interp(read_mm, seen_mm, self._heights_mm)


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


def _holes(unseen: NDArray[np.bool_], read: Singles) -> tuple[Whole, Floats, Floats, Floats]:
    """Return the hole of each unseen cell, and of each hole length and depth in cells and what is read round it."""
    pieces = pieces_of(unseen, 8)
    y, x = np.nonzero(unseen)
    number, count = pieces.labels[unseen].astype(np.int64) - 1, len(pieces.sizes) - 1
    length, deep, top = (np.full(count, start) for start in (0.0, 0.0, np.nan))
    for dy, dx in _UNIT:
        at = x * dx + y * dy
        ends = np.full((2, count), -np.inf)
        np.maximum.at(ends[0], number, at)
        np.maximum.at(ends[1], number, -at)
        np.maximum(length, ends.sum(axis=0) + 1, out=length)
    np.maximum.at(deep, number, _depth(np.pad(unseen, 1))[1:-1, 1:-1][unseen])
    around = np.pad(np.where(unseen, np.float32(np.nan), read), 1, constant_values=np.nan)
    for dy, dx in np.ndindex(3, 3):
        np.fmax.at(top, number, around[y + dy, x + dx])
    return number, length, deep, top


def _taper(share: Floats | float) -> Floats:
    """Return how high a ridge is, over its crown, at both ends of this share of its length about the crown."""
    return np.asarray(np.fmax(np.cos(math.pi / 2 * np.minimum(share, 1.0)), 1e-4) ** (16 / 7))


def _section(u: Floats | float) -> Floats:
    """Return how far a fold has come down from its crown at this share of its half width, up to a factor."""
    return np.asarray(u * u / 2 + np.cos(_K * u) / (_K * _K * math.cos(_K)))


def level(values: Floats) -> tuple[float, float]:
    """Return the median of values, and that of how far they lie off it."""
    laid = float(np.median(values))
    return laid, float(np.median(np.abs(values - laid)))


def _depth(marks: NDArray[np.bool_]) -> Singles:
    """Return how many cells each mark lies from what is not marked, 0 there."""
    return np.asarray(cv2.distanceTransform(marks.view(np.uint8), cv2.DIST_L2, 5), dtype=np.float32)
