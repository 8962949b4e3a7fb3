"""What one fold may draw together: straight on along a fibre, from foot to foot, as far as friction lets it."""

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

# Cosine between the ends of one fibre on either side of a gap: those of the other direction cross it.
_FACING = -math.sqrt(0.5)


class End(NamedTuple):
    """Where a fibre leaves the foot of its pocket, and the unit vector in which it goes on, mold XY."""

    xy: Floats
    way: Floats


class Fibre(NamedTuple):
    """A fibre that is held at both ends: what it has to spare, and where it leaves the foot."""

    spare_mm: float
    ends: tuple[End, End]


@dataclass(frozen=True, eq=False)
class CrossingFibres:
    """The held fibres of a pocket or a bump.

    Attributes
    ----------
    numbers
        Its own, and those of the pockets whose foot is the same.
    number
        Its own.
    spacing_mm
        Of its net.
    tail_mm
        From where a fibre leaves the foot to where it lies on the mold.
    uncertainty_mm
        Standing, of the ridge that they make.
    fibres
        Of both directions.
    """

    numbers: frozenset[int]
    number: int
    spacing_mm: float
    tail_mm: float
    uncertainty_mm: float
    fibres: tuple[Fibre, ...]


class Shared(NamedTuple):
    """What a fibre has to spare in other pockets."""

    spare_mm: float = 0.0
    variance_mm2: float = 0.0
    numbers: tuple[int, ...] = ()
    taken: frozenset[int] = frozenset()


class _Step(NamedTuple):
    """Straight on into another pocket: the gap before it, what there is to spare, and the end by which one leaves."""

    gap_mm: float
    pocket: int
    spare_mm: float
    leaves: int


class FibreWalk:
    """Follows fibres from pocket to pocket.

    The ends of all fibres are the places of a graph, and the steps on from one are found once. Of the chains of steps
    to a place only those count that no other reaches over less ply with as much to spare. So many small pockets in a
    row, each of which may be passed by or not, do not double the work one by one.

    Parameters
    ----------
    pockets
        With distinct numbers.
    way_mm
        Of ply lying between pockets that a fold draws over.
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
        """Add to `shared` what a fibre of a pocket may draw beyond one of its two ends, but for what is taken."""
        most, here = shared, int(self._first[self._index[number]]) + 2 * fibre + side
        # By the ply drawn over, so that what comes later to a place has to bring more.
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
        """Find the steps from all ends of a pocket: only into what lies no farther off than the way."""
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
        """Go straight on into a pocket, which the line meets: between two fibres, or beside the outermost."""
        order = np.argsort(aside, kind="stable")
        spacing_mm = self._spacing_mm[pocket]  # beyond the outermost fibres there is nothing to spare
        places = np.array([aside[order[0]] - spacing_mm, *aside[order], aside[order[-1]] + spacing_mm])
        gap_mm = float(np.interp(0.0, places, ahead[[order[0], *order, order[-1]]]))
        # Of the fibres on either side the one with more: between them it may be as much.
        beside = int(np.searchsorted(places, 0.0))
        spare_mm = max([0.0, *self._spare_mm[own[order]].tolist(), 0.0][beside - 1 : beside + 1])
        if gap_mm < -spacing_mm / 2 or gap_mm > self._way_mm + tails_mm or spare_mm <= 0:
            return None  # behind, too far, or nothing to draw
        return _Step(max(gap_mm - tails_mm, 0.0), pocket, spare_mm, int(own[np.argmin(np.abs(aside))]) ^ 1)


def _with(drawn: Shared, other: CrossingFibres, spare_mm: float) -> Shared | None:
    """Add what a fibre has to spare in another pocket; None if that is drawn already."""
    if other.numbers & drawn.taken:
        return None
    return Shared(
        drawn.spare_mm + spare_mm,
        drawn.variance_mm2 + other.uncertainty_mm**2,
        (*drawn.numbers, other.number),
        drawn.taken | other.numbers,
    )
