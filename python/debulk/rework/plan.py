"""From the runs of a report to the moves that bring every fibre below the limit (docs/rework.md).

A fibre does not stretch, so its excess can leave only over its ends: over the ply's edge, or by laying the ply again.
Each family of fibres keeps its own excess, so a round pocket needs a move along each.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats
from debulk.fibre import HELD, FibreRuns
from debulk.rework.handling import Handling
from debulk.rework.move import Move, Rework
from debulk.rework.needs import leaving_mm
from debulk.rework.places import Numbers, Places, places_of
from debulk.ridge import excess_of_ridge

if TYPE_CHECKING:
    from debulk.recipe import Recipe

_MOST_EDGE = 0.9  # share of a place's lines that must reach the edge, for a way out there to be known
_MOST_ACROSS = 0.4  # of the limit's excess: in the middle of a place a quarter of that acts, a tenth of the limit's


def plan(
    runs: FibreRuns,
    pocket: NDArray[np.int32],
    failing: tuple[int, ...],
    recipe: Recipe,
    ply_outline: Floats | None,
    *,
    apart_mm: float = 2.0,
    handling: Handling | None = None,
) -> Rework:
    """Plan how the length leaves that would become ridges.

    Parameters
    ----------
    runs
        The runs of whole lines.
    pocket
        (N,) number of the pocket that each run crosses; 0: none.
    failing
        Numbers of the pockets that crease, or may.
    recipe
        Limits and material.
    ply_outline
        (M, 2), mold XY, mm. None: no way out is known.
    apart_mm
        Distance of neighbouring lines.
    handling
        None: `Handling()`.

    Returns
    -------
    Rework
        Moves for all runs over failing pockets, and for held runs over no pocket, whose ridge may exceed the limit.
    """
    handling = handling or Handling()
    limits, t = recipe.verdict, recipe.material.thickness_mm
    target_mm, limit_mm = (
        excess_of_ridge(h, t) for h in (limits.max_ridge_mm - limits.ridge_margin_mm, limits.max_ridge_mm)
    )
    if not len(runs):
        return Rework((), failing, target_mm, handling)
    most_mm = runs.high_mm + runs.uncertainty_mm
    fails = np.isin(pocket, failing)
    nowhere = (pocket == 0) & (most_mm > limit_mm) & (runs.ends == HELD).all(axis=1)
    places = places_of(runs, pocket, ply_outline, apart_mm)
    side, known = _ways(places)
    leaving = leaving_mm(runs, places, most_mm, fails | nowhere, target_mm, side)
    mover = _Mover(runs, pocket, places, recipe, apart_mm, handling, _MOST_ACROSS * limit_mm)
    found = sorted(mover.moves(leaving, side, known), key=lambda one: -one[0])
    moves = tuple(move for _, move in found)
    named = {number for move in moves for number in move.pockets}
    return Rework(moves, tuple(number for number in failing if number not in named), target_mm, handling)


def _ways(places: Places) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Return at which end of each stretch its place's way out lies, with the least ply to slide; if any is known."""
    side = np.zeros(len(places.place), dtype=np.intp)
    known = np.zeros(len(places.place), dtype=bool)
    for number in range(places.place.max(initial=-1) + 1):
        own = np.flatnonzero(places.place == number)
        usable = places.to_edge[own].mean(axis=0) >= _MOST_EDGE
        far = np.where(usable, places.away_mm[own].mean(axis=0), np.inf)
        side[own], known[own] = int(far[1] < far[0]), usable.any()
    return side, known


@dataclass(frozen=True, eq=False)
class _Mover:
    """What the moves are made of."""

    runs: FibreRuns
    pocket: NDArray[np.int32]
    places: Places
    recipe: Recipe
    apart_mm: float
    handling: Handling
    most_across_mm: float

    def moves(self, leaving: Floats, side: NDArray[np.intp], known: NDArray[np.bool_]) -> Iterator[tuple[float, Move]]:
        """Yield the moves, each with its way to the edge, mm: those from farther in pass the others, and come first.

        A place from which the ply can be pulled out passes its length on from place to place. From any other the ply is
        laid again, all the way to the edge.
        """
        pulled = np.zeros(len(leaving), dtype=bool)
        for number in np.unique(self.places.place[(leaving > 0) & known]).tolist():
            own = np.flatnonzero((self.places.place == number) & (leaving > 0))
            away_mm = float(self.places.away_mm[own, side[own[0]]].mean())
            pulled[own] = self._can_pull(self._force_n(leaving[own], away_mm), self._across_mm(own, leaving[own]))
        for end in (0, 1):
            here = known & (side == end)
            yield from self._towards(_carried(self.places, np.where(here & pulled, leaving, 0.0), end), end, "pull")
            yield from self._towards(np.where(here & ~pulled, leaving, 0.0), end, "lift")
        yield from self._towards(np.where(known, 0.0, leaving), 1, "")

    def _towards(self, carried: Floats, end: int, by: str) -> Iterator[tuple[float, Move]]:
        places, known = self.places, bool(by)
        for number in np.unique(places.place[carried > 0]).tolist():
            all_of = np.flatnonzero((places.place == number) & (carried > 0))
            # Of several stretches of the place on one line the last one lets all of it out.
            ordered = all_of if end else all_of[::-1]
            last = dict(zip(places.line[places.rows[ordered]].tolist(), ordered.tolist(), strict=True))
            own = np.sort(np.array(list(last.values())))
            crossed = self.pocket[places.rows[own]]
            start, out = places.ends_mm[own, end], places.exits_mm[own, end]
            following = places.following[own, end]
            onwards = (following >= 0) & (by == "pull")
            to = np.where(onwards[:, None], places.ends_mm[following, 1 - end], out) if known else start
            direction = places.along[own].mean(axis=0) * (1 if end else -1)
            flat_mm = float((places.flat_mm if by == "pull" else places.away_mm)[own, end].mean())
            force_n, across_mm = self._force_n(carried[own], flat_mm), self._across_mm(own, carried[own])
            yield (
                float(np.linalg.norm(out - start, axis=1).mean()),
                Move(
                    pockets=tuple(np.unique(crossed[crossed > 0]).tolist()),
                    fibre=int(self.runs.family[places.rows[own[0]]]),
                    towards_deg=math.degrees(math.atan2(direction[1], direction[0])) % 360 if known else None,
                    length_mm=float(carried[own].max()),
                    band_mm=self.apart_mm * len(own),
                    flat_mm=flat_mm if known else 0.0,
                    force_n=force_n if known else 0.0,
                    across_mm=across_mm,
                    by="pull" if known and self._can_pull(force_n, across_mm) else "lift",
                    into=bool(onwards[np.argmax(carried[own])]),
                    from_mm=start,
                    to_mm=to,
                    lengths_mm=carried[own],
                ),
            )

    def _can_pull(self, force_n: float, across_mm: float) -> bool:
        return force_n <= self.handling.hold_n and across_mm <= self.most_across_mm

    def _across_mm(self, own: Numbers, lengths_mm: Floats) -> float:
        """Return by how much the fibres that cross a band get shorter, as adjacent lines of it move by so much."""
        line = self.places.line[self.places.rows[own]]
        length = np.bincount(line - line.min() + 1, lengths_mm, line.max() - line.min() + 3)
        return float((np.hypot(np.diff(length), self.apart_mm) - self.apart_mm).sum())

    def _force_n(self, lengths_mm: Floats, flat_mm: float) -> float:
        """Return the force that slides a band of flat ply, N.

        The band drags its neighbours: at a slip u, shear stress and the stress q at which the ply slides balance over a
        width b = √(2 G t u / q) on each side, which slides with it.
        """
        material = self.recipe.material
        weight_mpa = 1e-9 * material.density_kg_m3 * self.recipe.loads.gravity_m_s2 * material.thickness_mm
        q_mpa = self.handling.stick_mpa + material.friction * weight_mpa
        aside_mm = math.sqrt(2 * material.shear_mpa * material.thickness_mm * float(lengths_mm.max()) / q_mpa)
        return q_mpa * flat_mm * (self.apart_mm * len(lengths_mm) + 2 * aside_mm)


def _carried(places: Places, leaving: Floats, end: int) -> Floats:
    """Return what passes that end of each stretch: its own length, and that of all stretches farther in."""
    carried = leaving.copy()
    for k in range(len(carried)) if end else range(len(carried) - 1, -1, -1):
        if (following := places.following[k, end]) >= 0:
            carried[following] += carried[k]
    return carried
