"""What is not known of the ridge of one pocket: a height with its scatter, and what of it other pockets share."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from debulk.arrays import Floats
from debulk.results.report import PocketReport
from debulk.verdict import Verdict

if TYPE_CHECKING:
    from debulk.recipe import Recipe
    from debulk.results.runs import ExcessRuns

FOOT = 2 - math.pi / 2  # thicknesses of the ply in the ridge formula h = dL/2 + 0.43 t
OF_UNIFORM = math.sqrt(3.0)  # half the width of a range over its standard deviation
_LEAST_SD_MM = 0.003  # of a reading without noise
_BETWEEN = 0.3  # standard deviations that the steps between the residuals below leave open
SHARES = np.array([0.662, 0.832, 0.902, 0.935, 0.951, 0.964, 0.974, 0.984])
"""Share of the largest excess that one fold gathers, in eighths of the members of the referee and of the open
benchmark (bench/risk/risk.py)."""
RESIDUALS = np.array([-1.584, -0.950, -0.760, -0.622, -0.523, -0.415, -0.341, -0.211,
                      -0.133, -0.055, 0.043, 0.192, 0.293, 0.570, 0.941, 1.602])  # fmt: skip
"""True ridge less the one that is read, in standard deviations of the reading, in sixteenths (bench/risk/risk.py)."""
STRAYS, STRAY_SHARE = 0.03, 0.1
"""Readings that are off by far more, as 17 of 587 by more than three deviations. How many, and by what share of ΔL."""
_COUNT = SHARES.size * RESIDUALS.size


@dataclass(frozen=True, eq=False)
class Place:
    """The ridge of one pocket."""

    pocket: int
    """Its number."""
    alone_mm: Floats
    joined_mm: Floats
    """`alone_mm`, `joined_mm`: (K,) heights that are equally likely, before what follows scatters them: of its own
    excess, and with what one fold may draw from other places."""
    sd_mm: float
    """Standard deviation of these heights, of this pocket alone."""
    stray_mm: float = 0.0
    """That of the few readings that are off by far more; 0: there are none."""
    turn_mm: float = 0.0
    """Change of the height per radian by which the fibres run otherwise than said."""


def place_of(pocket: PocketReport, runs: ExcessRuns | None, recipe: Recipe) -> Place | None:
    """Return what is known of a pocket's ridge; None if nothing is, as of a pocket that is INVALID."""
    known, ridge = pocket.excess, pocket.deciding_ridge
    unseen = pocket.measured_share < recipe.verdict.min_pocket_coverage  # INVALID only above the tolerances
    if pocket.verdict is Verdict.INVALID or unseen or ridge is None:
        return None
    if pocket.decided_by == "paper" or known is None or pocket.half_seen is not None or ridge.is_bridge:
        heights = np.interp((np.arange(_COUNT) + 0.5) / _COUNT, (0, 1), ridge.range_mm)
        return Place(pocket.id, heights, heights, recipe.verdict.ridge_margin_mm / 2)
    turn_mm, foot = _turn_mm(pocket.id, runs), FOOT * recipe.material.thickness_mm
    more_mm, sd_mm = reading_of(known.noise_mm, known.missed_mm, known.range_mm[1] - known.alone_mm)
    if recipe.uncertainty.crease_mm is not None:
        # Outcomes are counted over the ridge of the whole excess, so their spread holds residuals and shares.
        read = np.full(_COUNT, known.length_mm / 2 + foot)
        return Place(pocket.id, read, read + more_mm, sd_mm, 0.0, turn_mm)
    read = known.length_mm / 2 + sd_mm * RESIDUALS
    alone, joined = (np.outer(SHARES, one).ravel() + foot for one in (read, read + more_mm))
    return Place(pocket.id, alone, joined, _BETWEEN * sd_mm, STRAY_SHARE * known.length_mm / 2, turn_mm)


def reading_of(noise_mm: float, missed_mm: float, joined_mm: float) -> tuple[float, float]:
    """Return, of the ridge that lines read: what joins it, and its standard deviation.

    What the filters may have missed, evenly up to so much, contains what joins it from other places (`joined_mm`). It
    scatters the ridge and does not raise it, because the estimate has the filters' likely share already.
    """
    more_mm = max(0.0, joined_mm)
    missed_mm = max(0.0, missed_mm - more_mm)
    return more_mm, max(_LEAST_SD_MM, math.hypot(noise_mm, missed_mm / math.sqrt(12)))


def _turn_mm(number: int, runs: ExcessRuns | None) -> float:
    """Return by how much a ridge changes per radian; 0 if the report keeps no line over the pocket."""
    if runs is None or not (own := runs.pocket == number).any():
        return 0.0
    return float(runs.turn_mm[own][np.argmax(runs.excess_mm[own])]) / 2
