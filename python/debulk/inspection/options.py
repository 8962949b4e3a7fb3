"""The recipe's settings as the options of the core's finders: filled here, once for all of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypedDict

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["Cleaning", "Segmenting", "UnseenOptions", "cleaning", "segmenting", "unseen_options"]


class Cleaning(TypedDict):
    """From a scan to a map of heights: outliers, holes, spikes, median."""

    neighbours: int
    std_ratio: float
    least_ratio: float
    hole_diameter_mm: float
    spike_mm: float
    median_cells: int
    threads: int


class Segmenting(TypedDict):
    """What is a pocket."""

    cut_height_mm: float
    area_tol_mm2: float
    peak_tol_mm: float


class UnseenOptions(TypedDict):
    """What counts as seen."""

    area_tol_mm2: float
    fill_mm: float
    ply_outline: NDArray[np.float64] | None


def cleaning(recipe: Recipe) -> Cleaning:
    """Take the section clean from the recipe."""
    clean = recipe.clean
    return {
        "neighbours": clean.neighbours,
        "std_ratio": clean.std_ratio,
        "least_ratio": clean.least_ratio,
        "hole_diameter_mm": clean.max_hole_mm,
        "spike_mm": clean.spike_mm,
        "median_cells": clean.median_cells,
        "threads": recipe.run.threads,
    }


def segmenting(recipe: Recipe) -> Segmenting:
    """Take the tolerances of a pocket from the recipe."""
    wanted = recipe.segmentation
    return {
        "cut_height_mm": wanted.cut_height_mm,
        "area_tol_mm2": wanted.area_tol_mm2,
        "peak_tol_mm": wanted.peak_tol_mm,
    }


def unseen_options(recipe: Recipe, ply_outline: NDArray[np.float64] | None) -> UnseenOptions:
    """Take what counts as seen from the recipe."""
    return {
        "area_tol_mm2": recipe.segmentation.area_tol_mm2,
        "fill_mm": recipe.clean.max_hole_mm,
        "ply_outline": ply_outline,
    }
