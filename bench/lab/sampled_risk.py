"""The same probabilities by drawing everything that is not known, to hold against the first order."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from debulk.risk.layup import Risk, common_sd_mm, crease_mm
from debulk.risk.place import STRAYS, place_of

if TYPE_CHECKING:
    from debulk.recipe import Recipe
    from debulk.results.report import PocketReport
    from debulk.results.runs import ExcessRuns


def sampled(
    pockets: Sequence[PocketReport], runs: ExcessRuns | None, recipe: Recipe, count: int = 1000, seed: int = 0
) -> Risk:
    """Draw layups that fit the report, and return the shares of those in which a ridge exceeds the limit.

    Parameters
    ----------
    pockets, runs, recipe
        As in `risk`.
    count, seed
        Number of draws, and their seed. A share scatters by half over the root of `count` at most.

    Examples
    --------
    >>> from debulk.recipe import Recipe
    >>> sampled((), None, Recipe(), count=10).layup
    0.0
    """
    rng = np.random.default_rng(seed)
    known = {p.id: place_of(p, runs, recipe) for p in pockets}
    of_limit_mm, of_angle = common_sd_mm(recipe)
    common, angle = of_limit_mm * rng.standard_normal(count), of_angle * rng.standard_normal(count)
    share = rng.random(count)  # of other places' excess that one fold draws
    exceeds = np.zeros(count, dtype=bool)
    shares: dict[int, float | None] = {}
    for number, place in known.items():
        if place is None:
            shares[number] = None
            continue
        drawn = rng.integers(len(place.alone_mm), size=count)
        sd_mm = np.hypot(place.sd_mm, recipe.uncertainty.spread_mm)
        sd_mm = np.hypot(sd_mm, np.where(rng.random(count) < STRAYS, place.stray_mm, 0.0))
        alone, joined = place.alone_mm[drawn], place.joined_mm[drawn]
        height = alone + share * (joined - alone) + sd_mm * rng.standard_normal(count)
        over = height + common + place.turn_mm * angle > crease_mm(recipe)
        exceeds |= over
        shares[number] = float(over.mean())
    return Risk(shares, None if None in shares.values() else float(exceeds.mean()))
