"""Options of the compiled modules, made from the recipe: the only place where its settings are handed over to C++."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray

from debulk import _core

if TYPE_CHECKING:
    from debulk.recipe.model import Recipe
    from debulk.recipe.section import Section

Options = TypeVar("Options")
LEVEL_SHARE = 0.35  # of the thickness: the mean of a scan without the ply and one with it lies half of it too low
SPIKE_SPACING_MM = 1.0  # spacing up to which `clean.spike_mm` is taken as it is; from there on it spares what may stand
_APART_MM, _NEAREST_MM = 2.0, 0.5  # between two fibre lines: usually, and at least
_ACROSS = 0.1  # of a bump's width: at least ten lines cross the smallest bump that counts as a pocket
# Blur of the heights, as a variance in squares of their spacing: by gridding (surface/image_gridding.hpp) at least, and
# by a median of m cells, three quarters of what a mean of m cells has, by its effect on a round crest.
_GRIDDING, _MEDIAN = 0.25, 0.75 / 12
PLY = (
    "thickness_mm", "young_mpa", "shear_mpa", "density_kg_m3", "friction", "torsion_n_mm", "in_plane_bending_n_mm",
    "tack_n_mm3",
)  # fmt: skip
LOADS = ("pressure_mpa", "gravity_m_s2", "lumping", "pressure_direction")
_CRITERIA = (
    "max_rms_mm", "min_coverage", "min_pocket_coverage", "rms_margin_mm", "ridge_margin_mm", "compliance_margin_mm",
)  # fmt: skip


def _with(options: Options, table: Section, *names: str) -> Options:
    """Return compiled options with these settings of a table, which have the same names there."""
    for name in names:
        setattr(options, name, getattr(table, name))
    return options


def outliers(recipe: Recipe) -> _core.cloud.OutlierOptions:
    """Return the options that determine which points of the scan are removed."""
    return _with(_core.cloud.OutlierOptions(), recipe.clean, "neighbours", "std_ratio", "least_ratio")


def front_end(recipe: Recipe, spacing_mm: float) -> _core.surface.FrontEndOptions:
    """Return the options that determine how a scan becomes a height map of this spacing."""
    options = _core.surface.FrontEndOptions()
    options.outliers = outliers(recipe)
    options.spacing_mm = spacing_mm
    options.hole_diameter_mm = recipe.clean.max_hole_mm
    # The ply rises more from cell to cell of a coarse grid: that must not count as a spike.
    options.spike_mm = recipe.clean.spike_mm * max(1.0, spacing_mm / SPIKE_SPACING_MM)
    options.median_cells = recipe.clean.median_cells
    return options


def segment(recipe: Recipe, ply_outline: NDArray[np.float64] | None) -> _core.pocket.SegmentOptions:
    """Return the options that determine what counts as a pocket, on a ply with this outline."""
    names = "cut_height_mm", "area_tol_mm2", "peak_tol_mm"
    options = _with(_core.pocket.SegmentOptions(), recipe.segmentation, *names)
    options.smooth_mm = recipe.patch.smooth_mm
    options.ply_outline = ply_outline
    return options


def unseen(recipe: Recipe, ply_outline: NDArray[np.float64] | None) -> _core.pocket.UnseenOptions:
    """Return the options that determine which parts count as seen, on a ply with this outline."""
    options = _core.pocket.UnseenOptions()
    options.area_tol_mm2 = recipe.segmentation.area_tol_mm2
    options.ply_outline = ply_outline
    return options


def feet(recipe: Recipe) -> _core.pocket.FootOptions:
    """Return the options that determine where a pocket's ply comes down to the mold."""
    options = _with(_core.pocket.FootOptions(), recipe.patch, "mold_tol_mm", "smooth_mm")
    options.thickness_mm = recipe.material.thickness_mm
    return options


def level_tol_mm(recipe: Recipe) -> float:
    """Return how far, mm, the ply may lie off its thickness: `level.tol_mm`, but at most 0.35 of the thickness."""
    return min(recipe.level.tol_mm, LEVEL_SHARE * recipe.material.thickness_mm)


def counts_from_mm(recipe: Recipe) -> float:
    """Return the height, mm, from which a ridge or a bridge counts: the limit less the margin for errors of height."""
    return recipe.verdict.max_ridge_mm - recipe.verdict.ridge_margin_mm


def looked_for_mm2(recipe: Recipe) -> float:
    """Return the area, mm², from which a plateau or a patch without noise counts: the smallest pocket's, or 2 cm²."""
    return min(recipe.segmentation.area_tol_mm2, 200.0)


def bridge_mm(gap_mm: float, recipe: Recipe) -> float:
    """Return a bridge's height, mm, as post-processing counts it: with the consolidated ply; 0 if the ply touches."""
    return gap_mm + recipe.material.consolidated_mm if gap_mm > ridge(recipe).touch_gap_mm else 0.0


def cannot_bridge(bound_mm: float | None, recipe: Recipe) -> bool:
    """Return whether fibres that can bridge gaps up to this bound, mm, make no bridge that counts; None: no bound."""
    return bound_mm is not None and bound_mm <= bridges_from_mm(recipe)


def bridges_from_mm(recipe: Recipe) -> float:
    """Return the largest gap, mm, below a bridge that does not count."""
    return max(ridge(recipe).touch_gap_mm, counts_from_mm(recipe) - recipe.material.consolidated_mm)


def lay_pocket(recipe: Recipe) -> _core.net.LayPocketOptions:
    """Return the options that determine how a pocket's net is laid."""
    options = _core.net.LayPocketOptions()
    options.mode = recipe.patch.mode
    _with(options.net, recipe.net, "spacing_mm", "node_target", "free_edge_mm", "paths")
    return options


def fibre_lines(recipe: Recipe, draw_mm: float, gridding_cells2: float = 0.0) -> _core.fibre.FibreOptions:
    """Return the options that determine how the fibre lines are read, if a fold draws over so much flat ply.

    `gridding_cells2` is the blur of the gridding, as a variance in squares of the heights' spacing.
    """
    options = _core.fibre.FibreOptions()
    options.thickness_mm = recipe.material.thickness_mm
    options.mold_tol_mm = recipe.patch.mold_tol_mm
    options.apart_mm = min(_APART_MM, max(_NEAREST_MM, _ACROSS * math.sqrt(recipe.segmentation.area_tol_mm2)))
    options.draw_mm = draw_mm
    options.hold_mm = recipe.net.free_edge_mm
    options.blur_cells2 = max(_GRIDDING, gridding_cells2) + (recipe.clean.median_cells**2 - 1) * _MEDIAN
    return options


def ply(recipe: Recipe) -> _core.sheet.PlyMaterial:
    """Return the material and the loads of the sheet."""
    return _with(_with(_core.sheet.PlyMaterial(), recipe.material, *PLY), recipe.loads, *LOADS)


def minimise(recipe: Recipe) -> _core.sheet.MinimiseOptions:
    """Return the options that determine how a minimum is found, from the starts that every pocket gets."""
    options = _with(_core.sheet.MinimiseOptions(), recipe.solve, "method", "starts", "seed")
    _with(options.solve, recipe.solve, "tolerance", "max_iterations", "stiffness")
    return options


def section_ply(recipe: Recipe) -> _core.section.SectionPly:
    """Return the bending stiffness and the pressure of the section model."""
    options = _core.section.SectionPly()
    options.stiffness_n_mm = recipe.material.young_mpa * recipe.material.thickness_mm**3 / 12
    options.pressure_mpa = recipe.loads.pressure_mpa
    return options


def ridge(recipe: Recipe) -> _core.ridge.RidgeOptions:
    """Return the options that determine how ridges are read from the net."""
    options = _with(_core.ridge.RidgeOptions(), recipe.material, "thickness_mm", "bulk_factor")
    if recipe.ridge.touch_mm is not None:
        options.touch_mm = recipe.ridge.touch_mm
    return options


def criteria(recipe: Recipe, criterion: Literal["excess", "paper"] | None = None) -> _core.verdict.Criteria:
    """Return the limits for the verdict, with the recipe's criterion unless another is named."""
    options = _with(_core.verdict.Criteria(), recipe.verdict, *_CRITERIA)
    options.max_ridge_height_mm = recipe.verdict.max_ridge_mm
    options.criterion = _core.verdict.Criterion.__members__[(criterion or recipe.verdict.criterion).upper()]
    return options
