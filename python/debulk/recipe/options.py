"""Options of the compiled modules, made from the recipe: the only place where its settings are handed over to C++."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from debulk import _core

if TYPE_CHECKING:
    from debulk.recipe.model import Recipe

_LEVEL_SHARE = 0.35  # of the thickness: the mean of a scan without the ply and one with it lies half of it too low
_SPIKE_SPACING_MM = 1.0  # spacing up to which `clean.spike_mm` is taken as it is
_APART_MM, _NEAREST_MM = 2.0, 0.5  # between two fibre lines: usually, and at least
_ACROSS = 0.1  # of a bump's width: at least ten lines cross the smallest bump that counts as a pocket
# Blur of the heights, as a variance in squares of their spacing: by gridding (surface/image_gridding.hpp), and by a
# median of m cells, three quarters of what a mean of m cells has, by its effect on a round crest.
_GRIDDING, _MEDIAN = 0.25, 0.75 / 12


def outliers(recipe: Recipe) -> _core.cloud.OutlierOptions:
    """Return the options that determine which points of the scan are removed."""
    options = _core.cloud.OutlierOptions()
    options.neighbours = recipe.clean.neighbours
    options.std_ratio = recipe.clean.std_ratio
    options.least_ratio = recipe.clean.least_ratio
    return options


def front_end(recipe: Recipe, spacing_mm: float) -> _core.surface.FrontEndOptions:
    """Return the options that determine how a scan becomes a height map of this spacing."""
    options = _core.surface.FrontEndOptions()
    options.outliers = outliers(recipe)
    options.spacing_mm = spacing_mm
    options.hole_diameter_mm = recipe.clean.max_hole_mm
    # A bump's top stands out of what lies two cells away: on a coarse grid it must not count as a spike.
    options.spike_mm = recipe.clean.spike_mm * max(1.0, spacing_mm / _SPIKE_SPACING_MM)
    options.median_cells = recipe.clean.median_cells
    return options


def segment(recipe: Recipe, ply_outline: NDArray[np.float64] | None) -> _core.pocket.SegmentOptions:
    """Return the options that determine what counts as a pocket, on a ply with this outline."""
    options = _core.pocket.SegmentOptions()
    options.cut_height_mm = recipe.segmentation.cut_height_mm
    options.area_tol_mm2 = recipe.segmentation.area_tol_mm2
    options.peak_tol_mm = recipe.segmentation.peak_tol_mm
    options.smooth_mm = recipe.patch.smooth_mm
    options.ply_outline = ply_outline
    return options


def unseen(recipe: Recipe, ply_outline: NDArray[np.float64] | None) -> _core.pocket.UnseenOptions:
    """Return the options that determine which parts count as seen, on a ply with this outline."""
    options = _core.pocket.UnseenOptions()
    options.area_tol_mm2 = recipe.segmentation.area_tol_mm2
    options.fill_mm = recipe.clean.max_hole_mm
    options.ply_outline = ply_outline
    return options


def feet(recipe: Recipe) -> _core.pocket.FootOptions:
    """Return the options that determine where a pocket's ply comes down to the mold."""
    options = _core.pocket.FootOptions()
    options.thickness_mm = recipe.material.thickness_mm
    options.mold_tol_mm = recipe.patch.mold_tol_mm
    options.smooth_mm = recipe.patch.smooth_mm
    return options


def level_tol_mm(recipe: Recipe) -> float:
    """Return how far, mm, the ply may lie off its thickness: `level.tol_mm`, but at most 0.35 of the thickness."""
    return min(recipe.level.tol_mm, _LEVEL_SHARE * recipe.material.thickness_mm)


def counts_from_mm(recipe: Recipe) -> float:
    """Return the height, mm, from which a ridge or a bridge counts: the limit less the margin for errors of height."""
    return recipe.verdict.max_ridge_mm - recipe.verdict.ridge_margin_mm


def looked_for_mm2(recipe: Recipe) -> float:
    """Return the area, mm², from which a plateau or a patch without noise counts: the smallest pocket's, or 2 cm²."""
    return min(recipe.segmentation.area_tol_mm2, 200.0)


def bridge_mm(gap_mm: float, recipe: Recipe) -> float:
    """Return a bridge's height, mm, as post-processing counts it: with the consolidated ply; 0 if the ply touches."""
    thickness_mm = recipe.material.thickness_mm
    return gap_mm + thickness_mm / recipe.material.bulk_factor if gap_mm > thickness_mm / 30 else 0.0


def cannot_bridge(bound_mm: float | None, recipe: Recipe) -> bool:
    """Return whether fibres that can bridge gaps up to this bound, mm, make no bridge that counts; None: no bound."""
    return bound_mm is not None and bridge_mm(bound_mm, recipe) <= counts_from_mm(recipe)


def flag_mm(recipe: Recipe) -> float:
    """Return the height above the reference, mm, from which the ply may crease without a pocket, and is looked at.

    A ply that is too short for a hollow has no excess length that lifts it, so it stands no higher now than it will
    after debulking. If half the cut is lower, that is taken: a row of hills must be this high to make a ridge.
    """
    thickness_mm = recipe.material.thickness_mm
    as_laid_mm = counts_from_mm(recipe) + thickness_mm - thickness_mm / recipe.material.bulk_factor
    return min(recipe.segmentation.cut_height_mm / 2, max(as_laid_mm, thickness_mm + recipe.patch.mold_tol_mm))


def regions(recipe: Recipe, spacing_mm: float, ply_outline: NDArray[np.float64] | None) -> _core.region.RegionOptions:
    """Return the options that determine how pockets are found through regions of interest."""
    options = _core.region.RegionOptions()
    options.front = front_end(recipe, spacing_mm)
    options.segment = segment(recipe, ply_outline)
    options.feet = feet(recipe)
    options.flag_mm = flag_mm(recipe)
    return options


def lay_pocket(recipe: Recipe) -> _core.net.LayPocketOptions:
    """Return the options that determine how a pocket's net is laid."""
    options = _core.net.LayPocketOptions()
    options.mode = recipe.patch.mode
    options.net.spacing_mm = recipe.net.spacing_mm
    options.net.node_target = recipe.net.node_target
    options.net.free_edge_mm = recipe.net.free_edge_mm
    options.net.paths = recipe.net.paths
    return options


def fibre_lines(recipe: Recipe, draw_mm: float) -> _core.fibre.FibreOptions:
    """Return the options that determine how the fibre lines are read, if a fold draws over so much flat ply."""
    options = _core.fibre.FibreOptions()
    options.thickness_mm = recipe.material.thickness_mm
    options.mold_tol_mm = recipe.patch.mold_tol_mm
    options.apart_mm = min(_APART_MM, max(_NEAREST_MM, _ACROSS * math.sqrt(recipe.segmentation.area_tol_mm2)))
    options.draw_mm = draw_mm
    options.hold_mm = recipe.net.free_edge_mm
    options.blur_cells2 = _GRIDDING + (recipe.clean.median_cells**2 - 1) * _MEDIAN
    return options


def ply(recipe: Recipe) -> _core.sheet.PlyMaterial:
    """Return the material and the loads of the sheet."""
    options = _core.sheet.PlyMaterial()
    options.thickness_mm = recipe.material.thickness_mm
    options.young_mpa = recipe.material.young_mpa
    options.shear_mpa = recipe.material.shear_mpa
    options.density_kg_m3 = recipe.material.density_kg_m3
    options.friction = recipe.material.friction
    options.pressure_mpa = recipe.loads.pressure_mpa
    options.gravity_m_s2 = recipe.loads.gravity_m_s2
    options.lumping = recipe.loads.lumping
    options.torsion_n_mm = recipe.material.torsion_n_mm
    options.in_plane_bending_n_mm = recipe.material.in_plane_bending_n_mm
    options.tack_n_mm3 = recipe.material.tack_n_mm3
    options.pressure_direction = recipe.loads.pressure_direction
    return options


def minimise(recipe: Recipe) -> _core.sheet.MinimiseOptions:
    """Return the options that determine how a minimum is found, from the starts that every pocket gets."""
    options = _core.sheet.MinimiseOptions()
    options.method = recipe.solve.method
    options.starts = recipe.solve.starts
    options.seed = recipe.solve.seed
    options.solve.tolerance = recipe.solve.tolerance
    options.solve.max_iterations = recipe.solve.max_iterations
    options.solve.stiffness = recipe.solve.stiffness
    return options


def section_ply(recipe: Recipe) -> _core.section.SectionPly:
    """Return the bending stiffness and the pressure of the section model."""
    options = _core.section.SectionPly()
    options.stiffness_n_mm = recipe.material.young_mpa * recipe.material.thickness_mm**3 / 12
    options.pressure_mpa = recipe.loads.pressure_mpa
    return options


def ridge(recipe: Recipe) -> _core.ridge.RidgeOptions:
    """Return the options that determine how ridges are read from the net."""
    options = _core.ridge.RidgeOptions()
    options.thickness_mm = recipe.material.thickness_mm
    options.bulk_factor = recipe.material.bulk_factor
    if recipe.ridge.touch_mm is not None:
        options.touch_mm = recipe.ridge.touch_mm
    return options


def criteria(recipe: Recipe, criterion: Literal["excess", "paper"] | None = None) -> _core.verdict.Criteria:
    """Return the limits for the verdict, with the recipe's criterion unless another is named."""
    options = _core.verdict.Criteria()
    options.criterion = _core.verdict.Criterion.__members__[(criterion or recipe.verdict.criterion).upper()]
    options.max_rms_mm = recipe.verdict.max_rms_mm
    options.max_ridge_height_mm = recipe.verdict.max_ridge_mm
    options.min_coverage = recipe.verdict.min_coverage
    options.min_pocket_coverage = recipe.verdict.min_pocket_coverage
    options.rms_margin_mm = recipe.verdict.rms_margin_mm
    options.ridge_margin_mm = recipe.verdict.ridge_margin_mm
    options.excess_margin_mm = recipe.verdict.excess_margin_mm
    options.compliance_margin_mm = recipe.verdict.compliance_margin_mm
    return options
