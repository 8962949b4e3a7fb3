"""The fibre lines of a ply, laid once, and the runs that a scan shows on them (docs/model.md, section 9)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from debulk import _core, fibre
from debulk.arrays import Floats
from debulk.fibre import FibreRuns
from debulk.grid import Grid
from debulk.inspection.ply import excess
from debulk.pocket import Feet, Segmentation
from debulk.recipe import Recipe, options
from debulk.section import SMALL_FORCE
from debulk.surface import Reference
from debulk.verdict import natural_length

# Means over 3 mm and the interpolation between them left of the excess of bells 16, 20, 24 and 40 mm wide, on a map of
# 0.8 mm: 0.44, 0.55, 0.67 and 0.86. That is exp(-25 (pitch / width)^2) within 0.04. It is to be a bound: of eight
# scenes of the third family (bench/lab/third), on which it was not fitted, two needed 33, the others less.
_LOST = 36.0
_BARE_MM = 6  # of bare mold in a row along a fibre's direction: there is no ply
_LEAST_WIDE = 4.0  # pitches: a narrower run is not resolved, and its width is that of noise


def left_by_means(apart_mm: float, width_mm: Floats) -> Floats:
    """Return the share of the excess of bumps so wide (N,) that means over `apart_mm`, so far apart, leave of it."""
    return np.asarray(np.exp(-_LOST * (apart_mm / np.maximum(width_mm, _LEAST_WIDE * apart_mm)) ** 2))


@dataclass(frozen=True, eq=False)
class ScanRuns:
    """The runs of all fibre lines over a scan."""

    runs: FibreRuns
    """One row for each run."""
    largest: Grid
    """Largest excess of a run over each place, mm."""
    _lines: _core.fibre.FibreLines
    _field: _core.fibre.ExcessField
    _known: WeakKeyDictionary[Feet, NDArray[np.int32]] = field(default_factory=WeakKeyDictionary)

    def of_coarser(self, beyond_mm: float) -> ScanRuns:
        """Return the same runs with what points farther apart than the map's heights may have lost of each.

        Between points of a pitch p the map is interpolated, and the points may themselves be means over p, as those of
        a voxel filter are. `beyond_mm` is the root of p² less the square of the map's spacing; 0 changes nothing.
        """
        if not beyond_mm > 0:
            return self
        width_mm = (self.runs.length_mm - self.runs.flat_mm) / self.runs.spans
        high_mm = np.where(
            self.runs.high_mm > 0, self.runs.high_mm / left_by_means(beyond_mm, width_mm), self.runs.high_mm
        )
        return replace(self, runs=replace(self.runs, high_mm=high_mm))

    def ending_at_bare(self, above_mm: Callable[[Floats], Floats], recipe: Recipe) -> ScanRuns:
        """Return the same runs, none sure beyond its noise beside which the bare mold shows: the ply may end there.

        `above_mm` gives the heights (M,) above the bare mold at (M, 2) places, NaN where nothing is known. What a
        run may have at most stays, because a groove in the ply looks like bare mold, too.
        """
        low_mm = self.runs.low_mm.copy()
        sure = np.flatnonzero(low_mm > self.runs.uncertainty_mm)
        runs = self.runs[sure]
        along = runs.to_mm - runs.from_mm
        along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
        steps = np.arange(0.0, max(_BARE_MM, recipe.net.free_edge_mm), 1.0)[:, None]
        ends = np.zeros(len(runs), dtype=bool)
        for end, out in ((runs.from_mm, -along), (runs.to_mm, along)):
            places = end[:, None] + steps * out[:, None]
            bare = above_mm(places.reshape(-1, 2)).reshape(places.shape[:2]) < 0.5 * recipe.material.thickness_mm
            ends |= np.asarray(sliding_window_view(bare, _BARE_MM, axis=1).all(axis=2)).any(axis=1)
        low_mm[sure[ends]] = runs.uncertainty_mm[ends]
        return replace(self, runs=replace(self.runs, low_mm=low_mm))

    def crossing(self, feet: Feet, index: int) -> NDArray[np.intp]:
        """Return the numbers of the runs that cross the foot of one pocket."""
        pairs = self._known.get(feet)  # of all feet of the piece: its other pockets ask for them, too
        if pairs is None:
            self._known[feet] = pairs = _core.fibre.crossings(self._lines, self._field, feet._core)
        return np.asarray(pairs[pairs[:, 1] == feet.feet[index].label, 0], dtype=np.intp)


class PlyFibres:
    """The lines along both fibre directions of a ply; made once, read in every scan."""

    def __init__(
        self, reference: Reference, ply_outline: Floats | None, fibre_angles_deg: Floats | Grid, recipe: Recipe
    ) -> None:
        self._reference, self._recipe = reference, recipe
        self._draw_mm = draw_length(recipe)
        wanted = options.fibre_lines(recipe, self._draw_mm)
        self._lines = fibre.lines_over(fibre_angles_deg, ply_outline, reference.box_mm, wanted, _core.Stop())

    def over(self, segmentation: Segmentation, feet: Feet, stop: _core.Stop, *, whole: bool, threads: int) -> ScanRuns:
        """Read the lines over a segmented height map with its feet; raises `Stopped`.

        If it is the whole scan, nothing is known beyond it. Otherwise the ply lies flat there.
        """
        blur_cells2 = segmentation._core.blur_mm2 / segmentation.heights.spacing_mm**2
        wanted = options.fibre_lines(self._recipe, self._draw_mm, blur_cells2)
        wanted.threads = threads
        wanted.mold_tol_mm = max(wanted.mold_tol_mm, feet.mold_tol_mm)
        field = _core.fibre.measure_excess(self._lines, segmentation._core, self._reference, whole, wanted, stop)
        made = fibre.from_core(field)
        return ScanRuns(made.runs, made.largest, self._lines, field)


def friction_length(recipe: Recipe) -> float:
    """Return the length of flat ply, mm, that a fold as high as the limit can move against friction: H / (mu P).

    Its end force H comes from the closed form for small folds, which lies above the exact force (docs/model.md,
    section 6).
    """
    material, pressure_mpa = recipe.material, recipe.loads.pressure_mpa
    if material.friction == 0:
        return math.inf
    natural_mm = natural_length(material.young_mpa, material.thickness_mm, pressure_mpa)
    held_mm = max(excess.of_ridge(recipe.verdict.max_ridge_mm, recipe), 1e-3 * natural_mm)
    return SMALL_FORCE * natural_mm / material.friction * math.pow(held_mm / natural_mm, -2 / 7)


def draw_length(recipe: Recipe) -> float:
    """Return the length of flat ply, mm, from which one fold may draw.

    It is at least what an edge lets go, which is the same slip: else a modulus in GPa or a pressure in bar would part
    what creases together.
    """
    return max(friction_length(recipe), recipe.net.free_edge_mm)
