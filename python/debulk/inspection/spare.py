"""A laid net with what its fibres have to spare for a fold, theirs or that of a pocket nearby."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from debulk.net import Net
from debulk.results.report import ExcessReport, PocketNet

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["SpareNet"]


@dataclass(frozen=True, eq=False)
class SpareNet:
    """The net of a pocket, or of a bump below the tolerances.

    Attributes
    ----------
    net, spacing_mm
        As laid.
    foot_outline_mm
        (M, 2), mold XY, where the ply comes down to the mold tolerance.
    tail_mm
        How far beyond that it comes to lie on the mold.
    at_spacing_mm
        Largest excess of its fibres, as laid.
    measure
        Returns the ridge that it makes; None where it is not known. Called once, where a fold may reach it.
    """

    net: Net | PocketNet
    spacing_mm: float
    foot_outline_mm: NDArray[np.float64]
    tail_mm: float
    at_spacing_mm: float
    measure: Callable[[], ExcessReport | None]

    @cached_property
    def excess(self) -> ExcessReport | None:
        """The ridge that the excess makes; None where it is not known."""
        return self.measure()

    @property
    def scale(self) -> float:
        """By what the excess grows from the net's own spacing to none, with what the net may miss."""
        if self.excess is None or self.excess.at_spacing_mm <= 0:
            return 1.0
        return max(self.excess.length_mm + 2 * self.excess.missed_mm, 0.0) / self.excess.at_spacing_mm

    def uncertainty_mm(self, recipe: Recipe) -> float:
        """Of the ridge that the excess makes: half of that of the excess."""
        return recipe.verdict.excess_margin_mm if self.excess is None else self.excess.uncertainty_mm

    def most_mm(self, recipe: Recipe) -> float:
        """Return the largest excess of its fibres within the uncertainty."""
        return self.at_spacing_mm * self.scale + 2 * self.uncertainty_mm(recipe)
