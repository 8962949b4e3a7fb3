"""Ridges on a debulked ply where its report has no pocket: they measure no prediction, but must not be missed."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from debulk import pocket
from debulk.arrays import Floats
from debulk.grid import Grid
from debulk.inspection.evidence.pieces import pieces_of
from debulk.inspection.hidden_ridge import MEDIAN_CELLS
from debulk.inspection.place import ply_edge
from debulk.inspection.ply.fibre_runs import draw_length
from debulk.inspection.reference.prepared import Prepared
from debulk.recipe import Recipe, options
from debulk.results.comparison import PocketComparison, Standing
from debulk.verdict import Verdict
from debulk.words import in_mm, xy_of


def standing(
    read: Grid, beside: NDArray[np.bool_], edge_mm: Floats, prepared: Prepared, recipe: Recipe
) -> tuple[Standing, ...]:
    """Find the ridges above the limit among heights that were read by medians, where `beside` is marked; highest first.

    A ridge is as long as a pocket is wide, and above the limit over half of that or more. Where the fitted surface cuts
    a rib of the mold off, the height is that above what was measured there; near the ply's edge, `edge_mm`, cells show
    what lies beside it.
    """
    limit_mm, cell = recipe.verdict.max_ridge_mm, float(read.spacing_mm)
    least_mm = max(math.sqrt(options.looked_for_mm2(recipe) / math.pi), MEDIAN_CELLS * cell)
    out = []
    for (rows, columns), own in pieces_of(beside & (read.values > limit_mm), 8).each(
        least_mm / (math.sqrt(2) * cell), 0
    ):
        cells = np.argwhere(own)[:, ::-1] + [columns.start, rows.start]
        xy = read.origin_mm + cell * cells
        above = read.values[rows, columns][own] - np.fmax(prepared.missed_mm(xy), 0)
        on = (above > limit_mm) & (pocket.distance_to_outline(edge_mm, xy) > ply_edge.LIMITS.blur_mm)
        length_mm = float(np.hypot(*np.ptp(xy[on], axis=0))) + cell if on.any() else 0.0
        if length_mm >= least_mm:
            top = int(np.argmax(np.where(on, above, -np.inf)))
            out.append(Standing(place_mm=xy_of(xy[top]), height_mm=float(above[top]), length_mm=length_mm))
    return tuple(sorted(out, key=lambda one: -one.height_mm))


def near(outcome: PocketComparison, foot_mm: Floats, ridges: tuple[Standing, ...], recipe: Recipe) -> PocketComparison:
    """Return the outcome of a pocket; UNDECIDED in place of CEASE where a ridge stands so near that it may be its own.

    One fold draws in what so little flat ply as `draw_length` holds apart from it (docs/model.md, section 9).
    """
    reach_mm = draw_length(recipe)
    for one in ridges if outcome.measured is Verdict.CEASE else ():
        if pocket.distance_to_outline(foot_mm, np.array([one.place_mm]))[0] <= reach_mm:
            reason = f"{outcome.reason}, but {words(one)}: look whether it came of this pocket"
            return replace(outcome, measured=Verdict.UNDECIDED, reason=reason)
    return outcome


def words(one: Standing) -> str:
    """Say what stands, and where."""
    return f"a ridge of {one.height_mm:.2f} mm, {one.length_mm:.0f} mm long, stands at {in_mm(one.place_mm)}"
