"""What the filters take from a pocket that is narrow for the spacing of its heights."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from debulk.inspection import excess
from debulk.inspection.found import FoundPocket

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["Lowered", "lowered", "perimeter_mm", "stands_on_hill", "true_ridge_mm"]

_FILTER_CELLS = 5  # over which single spikes are removed, and with them the tops of what is hardly wider
_HILL_FOOT = 2.0  # bells: a wider foot is that of a hill below
_MORE_BY_MEDIAN = 1  # cells, where the median is taken over 5 of them too


def true_ridge_mm(one: FoundPocket, excess_mm: float, recipe: Recipe) -> float:
    """Return the ridge that a pocket makes if the filters have lowered its excess to what is given, in mm.

    Measured on bumps 1.6 to 4 mm high, heights 1 mm apart: they lower the excess by factors of 4.1, 1.5, 1.8, 1.3, 1.1
    and 1.05 where the foot is 10, 12, 14, 16, 20 and 24 mm wide; this has 4.1, 2.5, 1.8, 1.5, 1.2 and 1.1. No bound:
    on bells and long bumps 3.6 to 7 mm high and 24 to 100 mm wide, heights 0.6 to 3 mm apart, it fell short by up to
    4 %.
    """
    wide_mm = _bell_mm(one) if stands_on_hill(one) else _wide_mm(one.foot.area_mm2, one.foot.outline_mm)
    cells = _FILTER_CELLS + (_MORE_BY_MEDIAN if recipe.clean.median_cells > 3 else 0)
    lost = 1 + 33 * (cells * one.segmentation.heights.spacing_mm / wide_mm) ** 4
    return excess.ridge_of(excess_mm * lost, recipe)


def _bell_mm(one: FoundPocket) -> float:
    """Return the width of a cosine bell as high and, at the cut, as wide."""
    high_mm = one.pocket.peak_mm - one.feet.thickness_mm
    below = (one.segmentation.cut_height_mm - one.feet.thickness_mm) / high_mm
    cut_mm = _wide_mm(one.pocket.area_mm2, one.pocket.outline_mm)
    return cut_mm * math.pi / 2 / math.acos(math.sqrt(min(max(below, 0.0), 1 - 1e-6)))


def _wide_mm(area_mm2: float, outline_mm: NDArray[np.float64]) -> float:
    """Return the diameter of a disc, the width of a strip."""
    around_mm = perimeter_mm(outline_mm)
    return 2 * area_mm2 / around_mm * (1 + 4 * math.pi * area_mm2 / around_mm**2)


def stands_on_hill(one: FoundPocket) -> bool:
    """Tell whether a foot is much wider than the bell on it, so that the net of the whole steps over the bell.

    What is cut by the ply's edge looks narrower than it is.
    """
    if one.pocket.touches_ply_edge:
        return False
    return _wide_mm(one.foot.area_mm2, one.foot.outline_mm) > _HILL_FOOT * _bell_mm(one)


@dataclass(frozen=True)
class Lowered:
    """What the filters may have taken from a pocket: a ridge that may be higher than its heights say.

    Attributes
    ----------
    excess_mm, ridge_mm
        As measured.
    true_mm, uncertain_mm
        The ridge before the filters, and by how much the measured one is uncertain in any case.
    spacing_mm
        Of the heights.
    """

    excess_mm: float
    ridge_mm: float
    true_mm: float
    uncertain_mm: float
    spacing_mm: float

    def reason(self, limit_mm: float) -> str:
        """Say that the pocket may crease all the same; empty where that cannot be."""
        if self.true_mm + self.uncertain_mm < limit_mm:
            return ""
        return (
            f"a fibre over it is {self.excess_mm:.2f} mm longer than the mold, a ridge of {self.ridge_mm:.2f} mm, but "
            f"with heights {self.spacing_mm:.2g} mm apart it is so narrow that the filters may have lowered it: a "
            f"ridge of {self.true_mm:.2f} mm is possible; give a denser scan"
        )


def lowered(one: FoundPocket, excess_mm: float, uncertain_mm: float, recipe: Recipe) -> Lowered:
    """Estimate what the filters have taken from a pocket with this excess, its ridge uncertain by so much."""
    ridge_mm, true_mm = excess.ridge_of(excess_mm, recipe), true_ridge_mm(one, excess_mm, recipe)
    return Lowered(excess_mm, ridge_mm, true_mm, uncertain_mm, one.segmentation.heights.spacing_mm)


def perimeter_mm(outline: NDArray[np.float64]) -> float:
    """Length of a closed (M, 2) outline."""
    return float(np.linalg.norm(outline - np.roll(outline, 1, axis=0), axis=1).sum())
