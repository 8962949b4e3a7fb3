"""What is not known of the ridge of one pocket: a height with its scatter, and what of it other pockets share."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from debulk.results.report import PocketReport
from debulk.verdict import Verdict

if TYPE_CHECKING:
    from debulk.recipe import Recipe
    from debulk.results.runs import ExcessRuns

FOOT = 2 - math.pi / 2  # thicknesses of the ply in the ridge formula h = dL/2 + 0.43 t
OF_UNIFORM = math.sqrt(3.0)  # half the width of a range over its standard deviation
EIGHTHS = (np.arange(8) + 0.5) / 8
_LEAST_SD_MM = 0.002  # what the steps between the eighths below leave open
SHARES = np.array([0.687, 0.889, 0.927, 0.940, 0.955, 0.967, 0.978, 0.986])
"""Share of the largest excess that one fold gathers, in eighths of the referee's members (bench/risk/risk.py)."""
READING = np.array([0.8661, 0.9854, 0.9976, 0.9987, 0.9998, 1.0067, 1.0231, 1.0761])
"""True excess over that of the lines, in eighths of pockets of layups without a fault (bench/risk/risk.py)."""


@dataclass(frozen=True)
class Place:
    """The ridge of one pocket."""

    pocket: int
    """Its number."""
    excess_mm: float = 0.0
    joined_mm: float = 0.0
    """`excess_mm`, `joined_mm`: excess of its worst fibre, alone and with what one fold may draw from other places. 0
    if it is not judged by it."""
    range_mm: tuple[float, float] | None = None
    """Heights between which the ridge lies, equally likely; None: the excess gives it."""
    sd_mm: float = 0.0
    """Standard deviation of the height by the scan and its reading, of this pocket alone."""
    turn_mm: float = 0.0
    """Change of the height per radian by which the fibres run otherwise than said."""

    def heights_mm(self, recipe: Recipe) -> tuple[np.ndarray, np.ndarray]:
        """Return (64,) heights that are equally likely, alone and joined, before anything scatters."""
        if self.range_mm is not None:
            heights = np.interp((np.arange(64) + 0.5) / 64, (0, 1), self.range_mm)
            return heights, heights
        gathered, foot = np.outer(SHARES, READING).ravel() / 2, FOOT * recipe.material.thickness_mm
        if recipe.uncertainty.crease_mm is not None:  # outcomes over the ridge of the whole excess hold both factors
            gathered = np.full_like(gathered, 0.5)
        return gathered * self.excess_mm + foot, gathered * self.joined_mm + foot

    @staticmethod
    def sd_of(noise_mm: float, missed_mm: float) -> float:
        """Return the scatter by the scan's noise, and by what the filters may have missed, evenly up to so much."""
        return math.hypot(noise_mm, max(0.0, missed_mm) / OF_UNIFORM, _LEAST_SD_MM)


def place_of(pocket: PocketReport, runs: ExcessRuns | None, recipe: Recipe) -> Place | None:
    """Return what is known of a pocket's ridge; None if nothing is, as of a pocket that is INVALID."""
    known, ridge = pocket.excess, pocket.deciding_ridge
    if pocket.verdict is Verdict.INVALID or ridge is None:
        return None
    if pocket.decided_by == "paper" or known is None or pocket.half_seen is not None:
        return Place(pocket.id, range_mm=ridge.range_mm, sd_mm=recipe.verdict.ridge_margin_mm / 2)
    joined_mm = known.length_mm + 2 * max(0.0, known.range_mm[1] - known.alone_mm)
    missed_mm = known.missed_mm - max(0.0, known.range_mm[1] - known.alone_mm)
    return Place(
        pocket.id,
        known.length_mm,
        joined_mm,
        None,
        Place.sd_of(known.noise_mm, missed_mm),
        _turn_mm(pocket.id, runs),
    )


def _turn_mm(number: int, runs: ExcessRuns | None) -> float:
    """Return by how much a ridge changes per radian; 0 if the report keeps no line over the pocket."""
    if runs is None or not (own := runs.pocket == number).any():
        return 0.0
    return float(runs.turn_mm[own][np.argmax(runs.excess_mm[own])]) / 2
