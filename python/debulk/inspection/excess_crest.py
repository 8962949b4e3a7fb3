"""The crest that the excess of a pocket's fibres makes, from the laid net alone (docs/verdicts.md).

A fold takes up the excess of every fibre that it crosses. Across a straight crest the ply rises to w(n), n along its
normal; a fibre at the angle a to that normal has the length of w(s cos a) to spare, cos a times what the section along
the normal holds. So where fibres of both directions have some to spare, e1 and e2, one crest serves both: its normal
lies at atan(e2 / e1) from the first fibre, on either side. Followed from fibre to fibre that gives a curve.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk import _core

if TYPE_CHECKING:
    from debulk.net import Net
    from debulk.surface import Reference

__all__ = ["ExcessCrest", "excess_crest"]

_FIXED = 1  # kind of a node that is held
_STEP = 0.5  # of the curve, in node spacings
# Where the fold is half as high: an elastic fold is as high as its excess to the power of 4/7.
_END = 2 ** (-7 / 4)
# Below this correlation of the fibres' coordinates over the pocket it is as long along either diagonal of its fibres,
# and folds along either; the referee's 45 pockets above it all fold along the longer one (bench/referee/crests.txt).
_DIAGONAL = 0.15

Floats = NDArray[np.float64]
Lattice = tuple[float, float]


@dataclass(frozen=True, eq=False)
class ExcessCrest:
    """Where the fold of a pocket runs.

    Attributes
    ----------
    polyline_mm
        (K, 2) from end to end, mold XY.
    mirrored_mm
        The same along the other diagonal of the fibres, where that is as likely; else None.
    peak
        Node of the laid net through which both run: the highest of the fibre with the most to spare.
    """

    polyline_mm: Floats
    mirrored_mm: Floats | None
    peak: int


class _Held(NamedTuple):
    """What fibres of one direction have to spare, mm, by their place in the lattice, from the first on."""

    first: int
    excess_mm: list[float]

    def at(self, place: float) -> float:
        """Between the fibres, and 0 beyond them."""
        k = math.floor(place - self.first)
        share = place - self.first - k
        here, ahead = (self.excess_mm[i] if 0 <= i < len(self.excess_mm) else 0.0 for i in (k, k + 1))
        return (1 - share) * here + share * ahead


def excess_crest(laid: Net, reference: Reference) -> ExcessCrest | None:
    """Return the crest of a laid net whose rim is held; None where no fibre has anything to spare."""
    held, peak_fibre = _held(laid, reference)
    if not peak_fibre:
        return None
    gaps = laid.nodes_mm[:, 2] - reference.height(laid.nodes_mm[:, :2])
    peak = max(peak_fibre, key=lambda node: gaps[node])
    lean = _lean(laid.lattice, gaps)
    place, start = _Places(laid), laid.lattice[peak].tolist()
    sign = 1 if lean >= 0 else -1
    mirrored = _curve(held, place, start, -sign) if abs(lean) < _DIAGONAL else None
    return ExcessCrest(_curve(held, place, start, sign), mirrored, peak)


def _held(laid: Net, reference: Reference) -> tuple[list[_Held], list[int]]:
    """Return what the held fibres of either direction have to spare, and the nodes of that with the most."""
    links, kinds, lattice = laid.neighbours.tolist(), laid.kinds.tolist(), laid.lattice.tolist()
    worst_mm, worst, both = 0.0, [], []
    for direction in (0, 1):
        ahead, back = 2 * direction, 2 * direction + 1
        spare: dict[int, float] = {}
        for first, beside in enumerate(links):
            if kinds[first] != _FIXED or beside[back] >= 0 or beside[ahead] < 0:
                continue
            nodes = [first]
            while (following := links[nodes[-1]][ahead]) >= 0:
                nodes.append(following)
            if kinds[nodes[-1]] != _FIXED:
                continue
            excess_mm = _excess_mm(laid.nodes_mm[nodes], reference)
            number = lattice[first][1 - direction]
            spare[number] = max(excess_mm, spare.get(number, 0.0))
            if excess_mm > worst_mm:
                worst_mm, worst = excess_mm, nodes
        low, high = min(spare, default=0), max(spare, default=-1)
        both.append(_Held(low, [spare.get(number, 0.0) for number in range(low, high + 1)]))
    return both, worst


def _excess_mm(points: Floats, reference: Reference) -> float:
    """Length of one fibre beyond that of the mold."""
    chain = np.full((len(points), 4), -1, dtype=np.int32)
    chain[:-1, 0] = np.arange(1, len(points))
    chain[1:, 1] = np.arange(len(points) - 1)
    return float(_core.ridge.largest_fibre_excess(points, chain, reference))


def _lean(lattice: NDArray[np.int32], gaps: Floats) -> float:
    """Correlation of the fibres' coordinates over the air below the ply: 1 for a pocket along their first diagonal."""
    weight = np.maximum(gaps, 0.0)
    if not weight.any():
        return 0.0
    off = lattice - weight @ lattice / weight.sum()
    (xx, xy), (_, yy) = (weight[:, None] * off).T @ off
    return float(xy / math.sqrt(xx * yy)) if xx * yy > 0 else 0.0


class _Places:
    """Points of the laid ply between the nodes of its lattice, mold XY."""

    def __init__(self, laid: Net) -> None:
        numbers = ((i, j) for i, j in laid.lattice.tolist())
        self._at = dict(zip(numbers, laid.nodes_mm[:, :2].tolist(), strict=True))

    def __call__(self, place: Lattice) -> tuple[float, float] | None:
        """Interpolate in the cell of four nodes; None outside the net."""
        i, j = math.floor(place[0]), math.floor(place[1])
        u, v = place[0] - i, place[1] - j
        x = y = 0.0
        for di, dj, share in ((0, 0, (1 - u) * (1 - v)), (1, 0, u * (1 - v)), (0, 1, (1 - u) * v), (1, 1, u * v)):
            if share > 0:
                node = self._at.get((i + di, j + dj))
                if node is None:
                    return None
                x, y = x + share * node[0], y + share * node[1]
        return x, y


def _curve(held: list[_Held], place: _Places, start: Lattice, sign: int) -> Floats:
    """Follow the crest both ways to where the fold is half as high, or the net ends."""

    def along(at: Lattice) -> tuple[float, float, float]:
        first, second = held[0].at(at[1]), held[1].at(at[0])
        whole = math.hypot(first, second)
        return (sign * second / whole, first / whole, whole) if whole > 0 else (0.0, 0.0, 0.0)

    least = _END * along(start)[2]
    ways = []
    for step in (_STEP, -_STEP):
        at, way = start, [place(start)]
        while len(way) < 4 * len(held[0].excess_mm) + 4 * len(held[1].excess_mm):
            u, v, _ = along(at)
            u, v, _ = along((at[0] + step / 2 * u, at[1] + step / 2 * v))
            at = (at[0] + step * u, at[1] + step * v)
            point = place(at)
            if point is None or along(at)[2] < least:
                break
            way.append(point)
        ways.append(way)
    return np.array([*reversed(ways[1][1:]), *ways[0]], dtype=np.float64)
