"""The excess that one fold may draw together, straight on along a fibre from foot to foot, as far as friction allows.

What a fibre has "to spare" is its excess length; a pocket's foot is where its ply comes down to the mold.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["CrossingFibres", "End", "Fibre", "FibreWalk", "Shared"]

Floats = NDArray[np.float64]

# Two fibre ends face each other across a gap if the cosine between their directions is below this. That excludes the
# fibres of the other direction, which run across.
_FACING = -math.sqrt(0.5)


class End(NamedTuple):
    """Where a fibre leaves the foot of its pocket, and the unit vector along which it continues, mold XY."""

    xy: Floats
    way: Floats


class Fibre(NamedTuple):
    """A fibre that is held at both ends: its excess length, and where it leaves the foot."""

    spare_mm: float
    ends: tuple[End, End]


@dataclass(frozen=True, eq=False)
class CrossingFibres:
    """The held fibres of a pocket or a bump.

    Attributes
    ----------
    numbers
        Its own number, and those of the pockets with the same foot.
    number
        Its own number.
    spacing_mm
        Spacing of its net.
    tail_mm
        Distance from where a fibre leaves the foot to where it lies on the mold.
    uncertainty_mm
        Uncertainty of the height of the ridge that the fibres make.
    fibres
        Its held fibres, of both directions.
    """

    numbers: frozenset[int]
    number: int
    spacing_mm: float
    tail_mm: float
    uncertainty_mm: float
    fibres: tuple[Fibre, ...]


class Shared(NamedTuple):
    """What a fibre may draw from other pockets.

    Attributes
    ----------
    spare_mm
        Sum of the excess lengths.
    variance_mm2
        Sum of the squared uncertainties of the ridges that these would make.
    numbers
        The pockets that they are drawn from.
    taken
        All pockets from which nothing more can be drawn.
    """

    spare_mm: float = 0.0
    variance_mm2: float = 0.0
    numbers: tuple[int, ...] = ()
    taken: frozenset[int] = frozenset()


class _Step(NamedTuple):
    """A step straight on into another pocket: the gap before it, the excess there, and the end at which one leaves."""

    gap_mm: float
    pocket: int
    spare_mm: float
    leaves: int


class FibreWalk:
    """Follows fibres from pocket to pocket.

    The ends of all fibres are the nodes of a graph ("places"), and the steps that lead on from each are found once. A
    chain of steps to a place counts only if no other chain reaches that place over less ply with as much excess. So the
    work does not double with each pocket of a long row of small ones, each of which may be included or passed by.

    Parameters
    ----------
    pockets
        The pockets and bumps, with distinct numbers.
    way_mm
        Largest length of ply lying on the mold over which a fold can draw.
    """

    def __init__(self, pockets: Sequence[CrossingFibres], way_mm: float) -> None:
        self._pockets = [one for one in pockets if one.fibres]
        self._way_mm = way_mm
        self._spare_mm = np.repeat([fibre.spare_mm for one in self._pockets for fibre in one.fibres], 2)
        ends = [end for one in self._pockets for fibre in one.fibres for end in fibre.ends]
        self._xy = np.array([end.xy for end in ends]).reshape(-1, 2)
        self._way = np.array([end.way for end in ends]).reshape(-1, 2)
        self._first = np.cumsum([0, *(2 * len(one.fibres) for one in self._pockets)])
        self._spacing_mm = np.array([one.spacing_mm for one in self._pockets])
        self._tail_mm = np.array([one.tail_mm for one in self._pockets])
        boxes = [self._xy[a:b] for a, b in pairwise(self._first)]
        self._low, self._high = (np.array([end(box, axis=0) for box in boxes]) for end in (np.min, np.max))
        self._index = {one.number: k for k, one in enumerate(self._pockets)}
        self._known: dict[int, list[_Step]] = {}

    def beyond(self, number: int, fibre: int, side: int, shared: Shared) -> Shared:
        """Add to `shared` what a fibre of a pocket may draw beyond one of its two ends, except from taken pockets."""
        most, here = shared, int(self._first[self._index[number]]) + 2 * fibre + side
        # Sorted by the ply drawn over, so that a later chain to the same place counts only if it brings more excess.
        waiting, count = [(0.0, -shared.spare_mm, 0, here, shared)], 0
        brought: dict[int, float] = {}
        while waiting:
            over_mm, _, _, place, drawn = heapq.heappop(waiting)
            if drawn.spare_mm <= brought.get(place, -math.inf):
                continue
            brought[place] = drawn.spare_mm
            most = max(most, drawn, key=lambda one: one.spare_mm)
            for step in self._steps(place):
                more = _with(drawn, self._pockets[step.pocket], step.spare_mm)
                if more is not None and over_mm + step.gap_mm <= self._way_mm:
                    count += 1
                    heapq.heappush(waiting, (over_mm + step.gap_mm, -more.spare_mm, count, step.leaves, more))
        return most

    def _steps(self, place: int) -> list[_Step]:
        if place not in self._known:
            self._find_steps(int(np.searchsorted(self._first, place, side="right")) - 1)
        return self._known[place]

    def _find_steps(self, start: int) -> None:
        """Find the steps from all ends of a pocket into the pockets within reach (`way_mm`)."""
        apart_mm = np.maximum(0.0, np.maximum(self._low - self._high[start], self._low[start] - self._high))
        tails_mm = self._tail_mm[start] + self._tail_mm
        near = np.flatnonzero(np.hypot(*apart_mm.T) <= self._way_mm + tails_mm)
        ends = np.concatenate([np.arange(self._first[k], self._first[k + 1]) for k in near])
        first = np.cumsum([0, *np.diff(self._first)[near]])
        here = np.arange(self._first[start], self._first[start + 1])
        off, way = self._xy[ends] - self._xy[here, None], self._way[here]
        ahead, aside = off @ way[:, :, None], off @ np.stack([-way[:, 1], way[:, 0]], axis=1)[:, :, None]
        ahead, aside, facing = ahead[..., 0], aside[..., 0], way @ self._way[ends].T < _FACING
        self._known.update((place, []) for place in here.tolist())
        right = np.minimum.reduceat(np.where(facing, aside, np.inf), first[:-1], axis=1) - self._spacing_mm[near]
        left = np.maximum.reduceat(np.where(facing, aside, -np.inf), first[:-1], axis=1) + self._spacing_mm[near]
        for i, n in np.argwhere((right < 0) & (left > 0)).tolist():
            own = first[n] + np.flatnonzero(facing[i, first[n] : first[n + 1]])
            step = self._step(int(near[n]), ends[own], ahead[i, own], aside[i, own], tails_mm[near[n]])
            if step is not None:
                self._known[int(here[i])].append(step)

    def _step(self, pocket: int, own: NDArray[np.intp], ahead: Floats, aside: Floats, tails_mm: float) -> _Step | None:
        """Return the step into a pocket that the line meets, between two of its fibres or beside the outermost one."""
        order = np.argsort(aside, kind="stable")
        spacing_mm = self._spacing_mm[pocket]  # one spacing beyond the outermost fibres there is no excess
        places = np.array([aside[order[0]] - spacing_mm, *aside[order], aside[order[-1]] + spacing_mm])
        gap_mm = float(np.interp(0.0, places, ahead[[order[0], *order, order[-1]]]))
        # The larger excess of the two fibres on either side counts: between them it may be as large.
        beside = int(np.searchsorted(places, 0.0))
        spare_mm = max([0.0, *self._spare_mm[own[order]].tolist(), 0.0][beside - 1 : beside + 1])
        if gap_mm < -spacing_mm / 2 or gap_mm > self._way_mm + tails_mm or spare_mm <= 0:
            return None  # it lies behind or too far away, or there is nothing to draw
        return _Step(max(gap_mm - tails_mm, 0.0), pocket, spare_mm, int(own[np.argmin(np.abs(aside))]) ^ 1)


def _with(drawn: Shared, other: CrossingFibres, spare_mm: float) -> Shared | None:
    """Add the excess of a fibre in another pocket; None if that has been drawn already."""
    if other.numbers & drawn.taken:
        return None
    return Shared(
        drawn.spare_mm + spare_mm,
        drawn.variance_mm2 + other.uncertainty_mm**2,
        (*drawn.numbers, other.number),
        drawn.taken | other.numbers,
    )
