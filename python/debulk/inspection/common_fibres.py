"""Fibres that cross several pockets: what those have to spare may gather in one fold (docs/verdicts.md).

The ply between two pockets lies on the mold, and friction holds it there up to some way only. Whether the excess of the
one is drawn into the fold of the other depends on the history of the vacuum; so where both together would exceed the
limit nothing is decided.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk import _core, pocket
from debulk.inspection import excess
from debulk.inspection.found import FoundPocket
from debulk.inspection.net_fibres import fibres
from debulk.inspection.ply_on_mold import PlyOnMold
from debulk.inspection.spare import SpareNet
from debulk.inspection.tolerances import Bump, bump_name
from debulk.results.report import PocketReport
from debulk.verdict import Verdict, natural_length

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["friction_length", "without_shared_folds"]

Floats = NDArray[np.float64]

_FIXED = 1  # kind of a node that is held
# Cosine between the ends of one fibre on either side of a gap: those of the other direction cross it.
_FACING = -math.sqrt(0.5)


class _End(NamedTuple):
    """Where a fibre leaves the foot of its pocket, and the unit vector in which it goes on, mold XY."""

    xy: Floats
    way: Floats


class _Fibre(NamedTuple):
    """A fibre that is held at both ends: what it has to spare, and where it leaves the foot."""

    spare_mm: float
    ends: tuple[_End, _End]


@dataclass(frozen=True, eq=False)
class _Spare:
    """The fibres of a pocket or a bump, with the standing uncertainty of what they have to spare."""

    numbers: frozenset[int]  # its own, and those of the pockets whose foot is the same
    number: int
    spacing_mm: float
    uncertainty_mm: float
    fibres: tuple[_Fibre, ...]


class _Shared(NamedTuple):
    """What a fibre has to spare in other pockets."""

    spare_mm: float = 0.0
    variance_mm2: float = 0.0
    numbers: tuple[int, ...] = ()
    taken: frozenset[int] = frozenset()


def without_shared_folds(
    reports: Sequence[PocketReport], pockets: Sequence[FoundPocket], bumps: Sequence[Bump], ply: PlyOnMold
) -> tuple[PocketReport, ...]:
    """Take CEASE from the pockets whose fibres have too much to spare together with those of others nearby.

    `bumps`: those below the tolerances; what they have to spare counts, as far as a net was laid on them.
    """
    reports = tuple(reports)
    if ply.recipe.verdict.criterion != "excess":
        return reports
    way_mm = friction_length(ply.recipe)
    nets = {p.id: laid for p in reports if (laid := _of_pocket(p)) is not None}
    same_foot = {found.number: frozenset((found.number, *found.joined)) for found in pockets}
    names = {p.id: str(p.id) for p in reports}
    for number, bump in enumerate(bumps, start=len(reports) + 1):
        if bump.spare is not None and bump.found is None:
            nets[number], same_foot[number] = bump.spare, frozenset((number,))
            names[number] = f"the {bump_name(bump.dropped)}"
    close = _close_by(nets, way_mm)
    near = {
        p.id: _near(p.id, nets, close, same_foot[p.id], ply.recipe)
        for p in reports
        if p.verdict is Verdict.CEASE and p.id in nets
    }
    wanted = {number for numbers in near.values() for number in numbers}
    spare = {number: _spare(number, nets[number], same_foot[number], ply) for number in sorted(wanted)}
    out = []
    for p in reports:
        others = [spare[number] for number in sorted(near.get(p.id, ())) if number != p.id]
        doubt = _doubt(spare[p.id], others, names, way_mm, ply.recipe) if others else ""
        out.append(replace(p, verdict=Verdict.UNDECIDED, reason=doubt, decided_by="") if doubt else p)
    return tuple(out)


def friction_length(recipe: Recipe) -> float:
    """Return how much of a flat ply, mm, the fold of the limit's height pushes or draws against friction: H / (mu P).

    Its end force H is by the closed form for small folds, which lies above the exact one (docs/model.md, section 6).
    """
    material, limits, pressure_mpa = recipe.material, recipe.verdict, recipe.loads.pressure_mpa
    if material.friction == 0:
        return math.inf
    natural_mm = natural_length(material.young_mpa, material.thickness_mm, pressure_mpa)
    held_mm = max(2 * limits.max_ridge_mm - (4 - math.pi) * material.thickness_mm, 1e-3 * natural_mm)
    return 3.441 * natural_mm / material.friction * math.pow(held_mm / natural_mm, -2 / 7)


def _of_pocket(p: PocketReport) -> SpareNet | None:
    if p.net is None:
        return None
    assert p.spacing_mm is not None and p.foot_outline_mm is not None  # it has a net
    at_spacing_mm = p.excess_length_mm if p.excess is None else p.excess.at_spacing_mm
    return SpareNet(p.net, p.spacing_mm, p.foot_outline_mm, at_spacing_mm or 0.0, lambda: p.excess)


def _close_by(nets: Mapping[int, SpareNet], way_mm: float) -> dict[int, list[int]]:
    """Return, by number, the others to whose feet it is no farther than a way."""
    numbers, feet = list(nets), [one.foot_outline_mm for one in nets.values()]
    close: dict[int, list[int]] = {number: [] for number in numbers}
    if len(numbers) < 2:
        return close
    low, high = (np.array([end(foot, axis=0) for foot in feet]) for end in (np.min, np.max))
    boxes_apart = np.maximum(0.0, np.maximum(low[:, None] - high, low - high[:, None]))
    for i, j in np.argwhere(np.hypot(*np.moveaxis(boxes_apart, -1, 0)) <= way_mm).tolist():
        facing = feet[j][((feet[j] >= low[i] - way_mm) & (feet[j] <= high[i] + way_mm)).all(axis=1)]
        if i < j and len(facing) and pocket.distance_to_outline(feet[i], facing).min() <= way_mm:
            close[numbers[i]].append(numbers[j])
            close[numbers[j]].append(numbers[i])
    return close


def _near(
    number: int, nets: Mapping[int, SpareNet], close: dict[int, list[int]], same_foot: frozenset[int], recipe: Recipe
) -> set[int]:
    """Return what may share a fold with one, and that itself; none where all of their excess would not do."""
    within, open_ones, whole_mm = {number}, [number], nets[number].most_mm(recipe)
    while open_ones:
        for other in close[open_ones.pop()]:
            if other not in within | same_foot:
                within.add(other)
                open_ones.append(other)
                whole_mm += nets[other].most_mm(recipe)
    enough = len(within) > 1 and excess.ridge_of(whole_mm, recipe) > recipe.verdict.max_ridge_mm
    return within if enough else set()


def _spare(number: int, one: SpareNet, numbers: frozenset[int], ply: PlyOnMold) -> _Spare:
    nodes_mm, kinds = one.net.nodes_mm, one.net.kinds
    xy = nodes_mm[:, :2]
    inside, away = pocket.inside(one.foot_outline_mm, xy), pocket.distance_to_outline(one.foot_outline_mm, xy)
    held = []
    for _, nodes in fibres(one.net.neighbours):
        if len(nodes) < 2 or not inside[nodes].any() or (kinds[[nodes[0], nodes[-1]]] != _FIXED).any():
            continue
        ends = (
            _end(xy[nodes], inside[nodes], away[nodes]),
            _end(xy[nodes[::-1]], inside[nodes[::-1]], away[nodes[::-1]]),
        )
        held.append(_Fibre(one.scale * _excess_mm(nodes_mm[nodes], ply), ends))
    return _Spare(numbers, number, one.spacing_mm, one.uncertainty_mm(ply.recipe), tuple(held))


def _end(xy: Floats, inside: NDArray[np.bool_], away: Floats) -> _End:
    """Find where a fibre that begins at the first of the points comes into the foot."""
    k = int(np.argmax(inside))
    out, within = (0, 1) if k == 0 else (k - 1, k)
    share = away[out] / (away[out] + away[within]) if k and away[out] + away[within] > 0 else 0.0
    way = xy[out] - xy[within]
    return _End(xy[out] - share * way, way / np.linalg.norm(way))


def _excess_mm(points: Floats, ply: PlyOnMold) -> float:
    """Length of one fibre beyond that of the mold."""
    chain = np.full((len(points), 4), -1, dtype=np.int32)
    chain[:-1, 0] = np.arange(1, len(points))
    chain[1:, 1] = np.arange(len(points) - 1)
    return float(_core.ridge.largest_fibre_excess(points, chain, ply.reference))


def _doubt(one: _Spare, others: Sequence[_Spare], names: Mapping[int, str], way_mm: float, recipe: Recipe) -> str:
    """Say with which others a fibre has more to spare than the limit allows; empty: with none."""
    worst_mm, worst, limit_mm = recipe.verdict.max_ridge_mm, _Shared(), recipe.verdict.max_ridge_mm
    whole_mm = 0.0
    for fibre in one.fibres:
        shared = _Shared(taken=one.numbers)
        for end in fibre.ends:
            shared = _beyond(end, others, way_mm, shared)
        total_mm = fibre.spare_mm + shared.spare_mm
        # Of the ridge u, of the excess 2u.
        most_mm = total_mm + 2 * math.sqrt(one.uncertainty_mm**2 + shared.variance_mm2)
        if shared.spare_mm > 0 and (ridge_mm := excess.ridge_of(most_mm, recipe)) > worst_mm:
            worst_mm, worst, whole_mm = ridge_mm, shared, total_mm
    if not worst.numbers:
        return ""
    pockets, bumps = ([names[n] for n in sorted(worst.numbers) if names[n].isdigit() is told] for told in (True, False))
    named = [f"pocket{'s' * (len(pockets) > 1)} {' and '.join(pockets)}"] if pockets else []
    return (
        f"a fibre over it and {' and '.join(named + bumps)} is {whole_mm:.2f} mm longer than the mold: "
        f"a ridge of up to {worst_mm:.2f} mm, above the limit of {limit_mm:.2f} mm, if one fold draws it all together; "
        f"only more than {way_mm:.3g} mm of flat ply between them would hold it apart by friction"
    )


def _beyond(end: _End, others: Sequence[_Spare], way_mm: float, shared: _Shared) -> _Shared:
    """Add what a fibre that leaves a foot has to spare in the pockets beyond, over all of whose gaps it is drawn."""
    most = shared
    for other in others:
        if other.numbers & shared.taken:
            continue
        found = _continued(end, other)
        if found is None or found[0] > way_mm or found[1] <= 0:
            continue
        gap_mm, spare_mm, far = found
        more = _Shared(
            shared.spare_mm + spare_mm,
            shared.variance_mm2 + other.uncertainty_mm**2,
            (*shared.numbers, other.number),
            shared.taken | other.numbers,
        )
        most = max(most, _beyond(far, others, way_mm - gap_mm, more), key=lambda one: one.spare_mm)
    return most


def _continued(end: _End, other: _Spare) -> tuple[float, float, _End] | None:
    """Follow a fibre straight on into another pocket: the gap, what it has to spare there, and where it comes out."""
    facing = [
        (fibre, fibre.ends[k], fibre.ends[1 - k])
        for fibre in other.fibres
        for k in (0, 1)
        if fibre.ends[k].way @ end.way < _FACING
    ]
    if not facing:
        return None
    off = np.array([near.xy for _, near, _ in facing]) - end.xy
    ahead, aside = off @ end.way, off @ np.array([-end.way[1], end.way[0]])
    order = np.argsort(aside)
    step = other.spacing_mm  # beyond the outermost fibres there is nothing to spare
    places = np.array([aside[order[0]] - step, *aside[order], aside[order[-1]] + step])
    if not places[0] < 0 < places[-1]:
        return None
    gap_mm = float(np.interp(0.0, places, ahead[[order[0], *order, order[-1]]]))
    if gap_mm < -step / 2:  # it lies behind
        return None
    # Of the fibres on either side the one with more: between them it may be as much.
    k = int(np.searchsorted(places, 0.0))
    spare = [0.0, *(facing[n][0].spare_mm for n in order), 0.0]
    return max(gap_mm, 0.0), max(spare[k - 1 : k + 1]), facing[int(np.argmin(np.abs(aside)))][2]
