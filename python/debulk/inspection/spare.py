"""A laid net with the excess length that its fibres can give to a fold, on it or in a pocket nearby."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from debulk.forking import kept
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
        The net as laid, and its spacing.
    foot_outline_mm
        (M, 2), mold XY, where the ply comes down to the mold tolerance.
    tail_mm
        Distance beyond that outline at which the ply comes to lie on the mold.
    at_spacing_mm
        Largest excess of its fibres, as laid.
    measure
        Function that returns the ridge that the excess makes; None if it is not known. It is called at most once, and
        only if a fold may reach the net.
    """

    net: Net | PocketNet
    spacing_mm: float
    foot_outline_mm: NDArray[np.float64]
    tail_mm: float
    at_spacing_mm: float
    measure: Callable[[], ExcessReport | None]

    @kept
    def excess(self) -> ExcessReport | None:
        """The ridge that the excess makes; None if it is not known."""
        return self.measure()

    @property
    def scale(self) -> float:
        """Factor by which the excess grows from the net's own spacing to zero spacing, with what the net may miss."""
        if self.excess is None or self.excess.at_spacing_mm <= 0:
            return 1.0
        return max(self.excess.length_mm + 2 * self.excess.missed_mm, 0.0) / self.excess.at_spacing_mm

    def uncertainty_mm(self, recipe: Recipe) -> float:
        """Return the uncertainty of the ridge that the excess makes, half of the uncertainty of the excess itself."""
        return recipe.verdict.excess_margin_mm if self.excess is None else self.excess.uncertainty_mm

    def most_mm(self, recipe: Recipe) -> float:
        """Return the largest excess that its fibres may have, with the uncertainty added."""
        return self.at_spacing_mm * self.scale + 2 * self.uncertainty_mm(recipe)
