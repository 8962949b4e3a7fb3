"""The recipe's settings as the options of the core's finders: filled here, once for all of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypedDict

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["Cleaning", "Segmenting", "cleaning", "segmenting"]


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
