"""All settings, section by section; the paper's tables are the defaults."""

from __future__ import annotations

from debulk.recipe.model import (
    Clean,
    Level,
    Loads,
    Material,
    Net,
    Patch,
    Recipe,
    Ridge,
    Run,
    Section,
    Segmentation,
    Solve,
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
    "VerdictLimits",
]
