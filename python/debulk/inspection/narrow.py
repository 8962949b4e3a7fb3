"""How much the filters may lower a pocket that is narrow compared with the spacing of its heights."""

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

_FILTER_CELLS = 5  # window in which single spikes are removed, and with them the tops of bumps that are hardly wider
_HILL_FOOT = 2.0  # times the width of the bell: a wider foot belongs to a hill below the bell
_MORE_BY_MEDIAN = 1  # cells to add if the median is taken over 5 cells too


def true_ridge_mm(one: FoundPocket, excess_mm: float, recipe: Recipe) -> float:
    """Return the ridge, in mm, that a pocket makes if the filters have lowered its excess to the given value.

    On bumps 1.6 to 4 mm high, with heights 1 mm apart, the filters were measured to lower the excess by factors of 4.1,
    1.5, 1.8, 1.3, 1.1 and 1.05 where the foot is 10, 12, 14, 16, 20 and 24 mm wide. The formula used here gives 4.1,
    2.5, 1.8, 1.5, 1.2 and 1.1. The result is not a bound: on bells and long bumps 3.6 to 7 mm high and 24 to 100 mm
    wide, with heights 0.6 to 3 mm apart, it fell short by up to 4 %.
    """
    wide_mm = _bell_mm(one) if stands_on_hill(one) else _wide_mm(one.foot.area_mm2, one.foot.outline_mm)
    cells = _FILTER_CELLS + (_MORE_BY_MEDIAN if recipe.clean.median_cells > 3 else 0)
    lost = 1 + 33 * (cells * one.segmentation.heights.spacing_mm / wide_mm) ** 4
    return excess.ridge_of(excess_mm * lost, recipe)


def _bell_mm(one: FoundPocket) -> float:
    """Return the width of the foot of a cosine bell that is as high as the pocket and, at the cut, as wide."""
    high_mm = one.pocket.peak_mm - one.feet.thickness_mm
    below = (one.segmentation.cut_height_mm - one.feet.thickness_mm) / high_mm
    cut_mm = _wide_mm(one.pocket.area_mm2, one.pocket.outline_mm)
    return cut_mm * math.pi / 2 / math.acos(math.sqrt(min(max(below, 0.0), 1 - 1e-6)))


def _wide_mm(area_mm2: float, outline_mm: NDArray[np.float64]) -> float:
    """Return the width of an outline: exact for the diameter of a disc, and close to the width of a long strip."""
    around_mm = perimeter_mm(outline_mm)
    return 2 * area_mm2 / around_mm * (1 + 4 * math.pi * area_mm2 / around_mm**2)


def stands_on_hill(one: FoundPocket) -> bool:
    """Return whether a foot is much wider than the bell on it, so that the net on the whole foot steps over the bell.

    The answer is False for a pocket at the ply's edge: the edge cuts it off, so that it looks narrower than it is.
    """
    if one.pocket.touches_ply_edge:
        return False
    return _wide_mm(one.foot.area_mm2, one.foot.outline_mm) > _HILL_FOOT * _bell_mm(one)


@dataclass(frozen=True)
class Lowered:
    """How much the filters may have lowered a pocket: its ridge may be higher than its filtered heights show.

    Attributes
    ----------
    excess_mm, ridge_mm
        Excess length and ridge as measured on the filtered heights.
    true_mm, uncertain_mm
        Estimate of the ridge before the filters, and the uncertainty that the measured ridge has in any case.
    spacing_mm
        Spacing of the heights.
    """

    excess_mm: float
    ridge_mm: float
    true_mm: float
    uncertain_mm: float
    spacing_mm: float

    def reason(self, limit_mm: float) -> str:
        """Return why the pocket may crease all the same; empty if it cannot."""
        if self.true_mm + self.uncertain_mm < limit_mm:
            return ""
        return (
            f"a fibre over it is {self.excess_mm:.2f} mm longer than the mold, a ridge of {self.ridge_mm:.2f} mm, but "
            f"with heights {self.spacing_mm:.2g} mm apart it is so narrow that the filters may have lowered it: a "
            f"ridge of {self.true_mm:.2f} mm is possible; give a denser scan"
        )


def lowered(one: FoundPocket, excess_mm: float, uncertain_mm: float, recipe: Recipe) -> Lowered:
    """Estimate how much the filters have lowered a pocket with this excess, whose ridge has this uncertainty."""
    ridge_mm, true_mm = excess.ridge_of(excess_mm, recipe), true_ridge_mm(one, excess_mm, recipe)
    return Lowered(excess_mm, ridge_mm, true_mm, uncertain_mm, one.segmentation.heights.spacing_mm)


def perimeter_mm(outline: NDArray[np.float64]) -> float:
    """Return the length of a closed (M, 2) outline."""
    return float(np.linalg.norm(outline - np.roll(outline, 1, axis=0), axis=1).sum())
