"""The length of ply lying on the mold over which one fold can draw more ply in."""

from __future__ import annotations

import math

from debulk.recipe import Recipe
from debulk.ridge import excess_of_ridge
from debulk.verdict import natural_length


def friction_length(recipe: Recipe) -> float:
    """Return the length of flat ply, mm, that a fold as high as the limit can move against friction: H / (mu P).

    Its end force H comes from the closed form for small folds, which lies above the exact force (docs/model.md,
    section 6).
    """
    material, limits, pressure_mpa = recipe.material, recipe.verdict, recipe.loads.pressure_mpa
    if material.friction == 0:
        return math.inf
    natural_mm = natural_length(material.young_mpa, material.thickness_mm, pressure_mpa)
    held_mm = max(excess_of_ridge(limits.max_ridge_mm, material.thickness_mm), 1e-3 * natural_mm)
    return 3.441 * natural_mm / material.friction * math.pow(held_mm / natural_mm, -2 / 7)
