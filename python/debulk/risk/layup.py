"""The probability of each pocket and of the layup, to first order.

Pockets are not independent: limit, thickness and the direction of the fibres are common to all of them, and one fold
may draw the excess of several. What is common is integrated over, given which the pockets are independent.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist
from typing import TYPE_CHECKING

import numpy as np

from debulk.arrays import Floats
from debulk.risk.place import FOOT, OF_UNIFORM, STRAYS, Place, place_of

if TYPE_CHECKING:
    from debulk.recipe import Recipe
    from debulk.results.report import PocketReport
    from debulk.results.runs import ExcessRuns

_LIMITS = np.array([NormalDist().inv_cdf((k + 0.5) / 12) for k in range(12)])  # equally likely
_ANGLES, _WEIGHTS = np.polynomial.hermite_e.hermegauss(3)
_Z = np.linspace(-9, 9, 1801)
_BELOW = np.array([math.erfc(-z / math.sqrt(2)) / 2 for z in _Z])
# How much of other places' excess one fold draws depends on the vacuum: evenly between none and all of it. In few steps
# for the layup, which has to be integrated over what is common to its pockets, too.
_DRAWN, _DRAWN_OF_LAYUP = ((np.arange(n) + 0.5) / n for n in (16, 4))


@dataclass(frozen=True)
class Risk:
    """Probabilities that a ridge exceeds the limit."""

    pockets: dict[int, float | None]
    """Of each pocket, by its number; None where nothing is known of its ridge."""
    layup: float | None
    """That any does, of those that are known; None if one is not."""


def risk(pockets: Sequence[PocketReport], runs: ExcessRuns | None, recipe: Recipe) -> Risk:
    """Return the probability that each pocket's ridge exceeds the limit, and that any does.

    The limit is ``uncertainty.crease_mm``, which `debulk calibrate` learns from outcomes; ``verdict.max_ridge_mm``
    where that is not set.

    Parameters
    ----------
    pockets
        The pockets of a report.
    runs
        Its fibre lines: which pockets share a fibre, and what the direction of the fibres does. None: not known.
    recipe
        Limits, material, and ``uncertainty``: what is not known of them.

    Examples
    --------
    >>> from debulk.recipe import Recipe
    >>> risk((), None, Recipe())
    Risk(pockets={}, layup=0.0)
    """
    known = {p.id: place_of(p, runs, recipe) for p in pockets}
    places = [place for place in known.values() if place is not None]
    if not places:
        return Risk(dict.fromkeys(known), None if known else 0.0)
    of_limit_mm, of_angle = common_sd_mm(recipe)
    turn = np.array([p.turn_mm for p in places])
    own = np.hypot([p.sd_mm for p in places], recipe.uncertainty.spread_mm)
    every = np.hypot(np.hypot(own, of_limit_mm), turn * of_angle)
    alone = _exceeds(places, every, np.zeros((len(places), 1)), _DRAWN, recipe).mean(axis=(1, 2))
    each = dict(zip((p.pocket for p in places), alone.tolist(), strict=True))
    limit, angle = (axis.ravel() for axis in np.meshgrid(of_limit_mm * _LIMITS, of_angle * _ANGLES, indexing="ij"))
    given = _exceeds(places, own, limit + turn[:, None] * angle, _DRAWN_OF_LAYUP, recipe)
    weights = np.outer(np.ones(len(_LIMITS)), _WEIGHTS).ravel()
    weights /= weights.sum()
    separate, together = np.ones(given.shape[1:]), np.ones(given.shape[1:])
    for group in _groups(places, runs):
        separate = separate * (1 - given[group]).prod(axis=0)
        together = together * (1 - given[group].max(axis=0))
    none = separate + _DRAWN_OF_LAYUP[:, None] * (together - separate)
    any_of = float(1 - none.mean(axis=0) @ weights)
    pocket_risks = {number: None if place is None else each[number] for number, place in known.items()}
    return Risk(pocket_risks, None if None in pocket_risks.values() else max(0.0, any_of))


def crease_mm(recipe: Recipe) -> float:
    """Return the ridge at which half of the pockets crease: what outcomes say, or else the limit as it stands."""
    return recipe.uncertainty.crease_mm or recipe.verdict.max_ridge_mm


def common_sd_mm(recipe: Recipe) -> tuple[float, float]:
    """Return what all ridges share: the standard deviation of limit and scan, mm, and of the fibres, radians.

    The scan's scale counts as much as it moves a ridge at the limit, where alone it matters: an excess goes with the
    square of the heights.
    """
    unsure, foot_mm = recipe.uncertainty, FOOT * recipe.material.thickness_mm
    thickness_mm = foot_mm * unsure.thickness_share / OF_UNIFORM
    height_mm = 2 * max(0.0, crease_mm(recipe) - foot_mm) * unsure.height_share / OF_UNIFORM
    return math.hypot(unsure.limit_mm, thickness_mm, height_mm), math.radians(unsure.angle_deg) / OF_UNIFORM


def _exceeds(places: Sequence[Place], sd_mm: Floats, higher_mm: Floats, drawn: Floats, recipe: Recipe) -> Floats:
    """Return (P, D, K) probabilities of ridges that draw (D,), are (P, K) higher, and scatter by (P,), mm."""
    found = np.empty((len(places), len(drawn), higher_mm.shape[1]))
    for k, place in enumerate(places):
        more_mm, over = place.joined_mm - place.alone_mm, higher_mm[k] - crease_mm(recipe)
        heights = place.alone_mm + np.outer(drawn if more_mm.any() else drawn[:1], more_mm)
        found[k] = _below((heights[:, None, :] + over[:, None]) / sd_mm[k]).mean(axis=2)
        if place.stray_mm > 0:
            far = _below((heights.mean(axis=1)[:, None] + over) / math.hypot(sd_mm[k], place.stray_mm))
            found[k] += STRAYS * (far - found[k])
    return found


def _below(z: Floats) -> Floats:
    """Return the normal law's distribution, within 3e-6."""
    return np.asarray(np.interp(z, _Z, _BELOW))


def _groups(places: Sequence[Place], runs: ExcessRuns | None) -> list[list[int]]:
    """Return the places by number, those together that one run crosses."""
    group = list(range(len(places)))
    index = {place.pocket: k for k, place in enumerate(places)}
    if runs is None:
        return [[k] for k in group]
    for r in np.flatnonzero(runs.spans > 1).tolist():
        along = runs.to_mm[r] - runs.from_mm[r]
        same = (runs.family == runs.family[r]) & (runs.line == runs.line[r]) & (runs.pocket > 0)
        within = (runs.top_mm[same] - runs.from_mm[r]) @ along
        crossed = runs.pocket[same][(within >= 0) & (within <= along @ along)]
        of = {group[index[number]] for number in crossed.tolist() if number in index}
        group = [min(of) if g in of else g for g in group]
    return [[k for k, g in enumerate(group) if g == name] for name in sorted(set(group))]
