"""The ridge that the excess of the fibres makes, read from the runs that cross a pocket (docs/model.md, section 9).

Where nobody saw the ply, the excess is that of the steepest bell that fits in there (docs/verdicts.md).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk import _core, section
from debulk.arrays import Floats
from debulk.fibre import FREE, FibreRuns
from debulk.inspection.ply.polyline import direction_deg
from debulk.recipe import Recipe
from debulk.results.report import ExcessReport
from debulk.ridge import excess_of_ridge


@dataclass(frozen=True)
class Limits:
    """Of what was not seen; bench/trust/holes.py has holes over creases."""

    # The steepest flank of a laid ply, a prior: the steepest hundredth of each of 42 pockets inside the ply of eleven
    # virtual layups has 28.6 degrees or less, but for one with 34.
    steepest_deg: float = 30.0

    @property
    def per_mm(self) -> float:
        """Excess of a bell with such flanks per mm of its width: half the mean of its squared slopes."""
        return math.tan(math.radians(self.steepest_deg)) ** 2 / 4


LIMITS = Limits()

LEAST_ERROR_MM = 0.04  # of a fibre's length; a ridge is half as high as its excess is long


def of_runs(runs: FibreRuns, bridge_bound_mm: float, recipe: Recipe) -> ExcessReport:
    """Return the ridge that the runs over a pocket's foot make, at least one, with its range.

    What surely stands is that of a run with no free end, and with no flat ply in it. The upper end is that of all runs:
    what is free may be held, and what so little flat ply parts may gather in one fold.
    """
    single = alone(runs)
    sure = single & bound(runs)
    low_mm = float((runs.low_mm - runs.uncertainty_mm)[sure].max(initial=0.0))
    high_mm = upper_mm(runs)
    alone_mm = upper_mm(runs[single])
    # A line has a run for each stretch off the mold by itself, so that one without flat ply is always among them.
    worst = int(np.argmax(np.where(sure if sure.any() else single, runs.excess_mm, -np.inf)))
    excess_mm = float(runs.excess_mm[worst])
    (x0, y0), (x1, y1) = runs.from_mm[worst].tolist(), runs.to_mm[worst].tolist()
    return ExcessReport(
        length_mm=excess_mm,
        height_mm=_standing(excess_mm, recipe),
        range_mm=(_standing(low_mm, recipe), _standing(high_mm, recipe)),
        alone_mm=_standing(alone_mm, recipe),
        elastic_mm=section.elastic_height(excess_mm, recipe),
        noise_mm=float(runs.uncertainty_mm[worst]) / 4,
        uncertainty_mm=float(runs.uncertainty_mm[worst]) / 2,
        missed_mm=max(0.0, high_mm - excess_mm - float(runs.uncertainty_mm[worst])) / 2,
        bridge_bound_mm=bridge_bound_mm,
        fibre=int(runs.family[worst]),
        direction_deg=direction_deg(np.array([x1 - x0, y1 - y0])),
        from_mm=(x0, y0),
        to_mm=(x1, y1),
    )


def alone(runs: FibreRuns) -> NDArray[np.bool_]:
    """Return which runs have no flat ply within them, (N,): nothing holds apart what gathers in their fold."""
    return np.asarray(runs.flat_mm <= 0)


def bound(runs: FibreRuns) -> NDArray[np.bool_]:
    """Return which runs have no free end, (N,): neither end lets the ply slide in, as far as is known."""
    return np.asarray((runs.ends != FREE).all(axis=1))


def most_mm(runs: FibreRuns) -> Floats:
    """Return the excess length, mm, that each run may have at most, (N,)."""
    return runs.high_mm + runs.uncertainty_mm


def upper_mm(runs: FibreRuns) -> float:
    """Return the largest excess length, mm, that one of the runs may have; 0 if there is none."""
    return float(most_mm(runs).max(initial=0.0))


def ridge_of(excess_mm: float, recipe: Recipe) -> float:
    """Return the height, mm, of a single ridge that takes up all of an excess length."""
    material = recipe.material
    if excess_mm <= 0:
        return material.consolidated_mm
    return max(material.consolidated_mm, _core.ridge.ridge_height_of_excess(excess_mm, material.thickness_mm))


def of_ridge(height_mm: float, recipe: Recipe) -> float:
    """Return the excess length, mm, that a single ridge of this height takes up."""
    return excess_of_ridge(height_mm, recipe.material.thickness_mm)


def above_limit(excess_mm: Floats, recipe: Recipe) -> Iterator[tuple[int, float]]:
    """Yield the indices of the excess lengths (N,) that make a ridge above the limit, and that ridge; longest first."""
    for n in np.argsort(-excess_mm, kind="stable").tolist():
        ridge_mm = ridge_of(float(excess_mm[n]), recipe)
        if ridge_mm <= recipe.verdict.max_ridge_mm:
            return
        yield n, ridge_mm


def hidden_mm(wide_mm: float) -> float:
    """Return the excess of the steepest bell that a place so wide can hide, its foot at the place's rim."""
    return LIMITS.per_mm * wide_mm


def harmless_mm2(recipe: Recipe) -> float:
    """Return the area of the largest round place that hides no ridge above the limit."""
    return math.pi / 4 * (of_ridge(recipe.verdict.max_ridge_mm, recipe) / LIMITS.per_mm) ** 2


def _standing(excess_mm: float, recipe: Recipe) -> float:
    """Return the ridge's height; 0 if it is within the consolidated ply."""
    height_mm = ridge_of(excess_mm, recipe)
    return height_mm if height_mm > recipe.material.consolidated_mm else 0.0
