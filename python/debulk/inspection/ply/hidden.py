"""How much excess a place that nobody saw can hide (docs/verdicts.md): that of the steepest bell that fits into it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from debulk.recipe import Recipe
from debulk.ridge import excess_of_ridge


@dataclass(frozen=True)
class Limits:
    """Of what was not seen; bench/trust/holes.py has holes over creases."""

    # The steepest flank of a laid ply, a prior: the steepest hundredth of each of 42 pockets inside the ply of eleven
    # virtual layups has 28.6 degrees or less, but for one with 34.
    steepest_deg: float = 30.0


LIMITS = Limits()
_PER_MM = math.tan(math.radians(LIMITS.steepest_deg)) ** 2 / 4  # half the mean of the squared slopes of such a bell


def hidden_mm(wide_mm: float) -> float:
    """Return the excess of the steepest bell that a place so wide can hide, its foot at the place's rim."""
    return _PER_MM * wide_mm


def harmless_mm2(recipe: Recipe) -> float:
    """Return the area of the largest round place that hides no ridge above the limit."""
    wide_mm = excess_of_ridge(recipe.verdict.max_ridge_mm, recipe.material.thickness_mm) / _PER_MM
    return math.pi / 4 * wide_mm**2
