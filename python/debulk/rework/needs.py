"""How much length must leave each stretch of a line, so that no run of it exceeds what is wanted: the least in all."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats
from debulk.fibre import FibreRuns
from debulk.rework.places import Places


def leaving_mm(
    runs: FibreRuns,
    places: Places,
    most_mm: Floats,
    wanted: NDArray[np.bool_],
    target_mm: float,
    side: NDArray[np.intp],
) -> Floats:
    """Return the length that is to leave each stretch, (N,), mm.

    Each run is an interval of its line, and asks for a sum over its stretches. Taken in the order in which they end, on
    the side of the way out, and filled from that end, the sums are the least possible. A `wanted` run, (R,), is brought
    down from the most that it may have, (R,), to the target. `side` is (N,) at which end of each stretch the way out
    lies, 0 or 1.
    """
    leaving = np.zeros(len(places.rows))
    most_of = np.maximum(runs.low_mm[places.rows], 0.0)  # with more taken out the fibre would surely be too short
    begins, stops = places.span_mm.T
    asked = np.flatnonzero(wanted & (most_mm > target_mm))
    for line in np.unique(places.line[asked]):
        own = np.flatnonzero(places.line[places.rows] == line)
        ahead = bool(side[own].mean() >= 0.5)
        of_line = asked[places.line[asked] == line]
        for r in of_line[np.argsort(stops[of_line] if ahead else -begins[of_line], kind="stable")]:
            at = places.rows[own]
            within = own[(begins[at] >= begins[r] - 1e-6) & (stops[at] <= stops[r] + 1e-6)]
            lacks = most_mm[r] - target_mm - leaving[within].sum()
            for k in within[::-1] if ahead else within:
                if lacks <= 0:
                    break
                more = min(lacks, most_of[k] - leaving[k])
                leaving[k] += more
                lacks -= more
    return leaving
