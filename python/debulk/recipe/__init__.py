"""All settings of an inspection, section by section, with the paper's tables as defaults."""

from __future__ import annotations

from debulk.recipe.model import Recipe
from debulk.recipe.section import Section
from debulk.recipe.tables import (
    Clean,
    Level,
    Loads,
    Material,
    Net,
    Patch,
    Ridge,
    Run,
    Segmentation,
    Solve,
    Uncertainty,
    VerdictLimits,
)

__all__ = [
    "Clean",
    "Level",
    "Loads",
    "Material",
    "Net",
    "Patch",
    "Recipe",
    "Ridge",
    "Run",
    "Section",
    "Segmentation",
    "Solve",
    "Uncertainty",
    "VerdictLimits",
]
