"""Fibres that cross several pockets: the excess lengths of all of them may gather in one fold (docs/verdicts.md).

The ply between two pockets lies on the mold, and friction holds it there only if there is enough of it. Whether the
excess of one pocket is drawn into the fold of the other depends on the history of the vacuum. So if both together would
exceed the limit, the verdict is UNDECIDED. What a fibre has "to spare" is its excess length.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk import _core, pocket
from debulk.inspection import excess
from debulk.inspection.fibre_walk import CrossingFibres, End, Fibre, FibreWalk, Shared
from debulk.inspection.found import FoundPocket
from debulk.inspection.friction_length import friction_length
from debulk.inspection.missed import tail_mm
from debulk.inspection.near_outlines import come_within
from debulk.inspection.net_fibres import fibres
from debulk.inspection.ply_on_mold import PlyOnMold
from debulk.inspection.spare import SpareNet
from debulk.inspection.tolerances import Bump, bump_name
from debulk.results.report import PocketReport
from debulk.verdict import Judgement, Verdict

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["doubts", "without_shared_folds"]

Floats = NDArray[np.float64]

_INNER, _FIXED = 0, 1  # kinds of nodes: movable within the net, and fixed at its rim by the ply around it
_NAMED = 3  # so many pockets and so many bumps at most are named in a reason


class _Fold(NamedTuple):
    """What one fold may draw together: the height of its ridge, the excess in it, and where the excess comes from."""

    ridge_mm: float
    excess_mm: float
    with_others: Shared


def without_shared_folds(
    reports: Sequence[PocketReport], pockets: Sequence[FoundPocket], bumps: Sequence[Bump], ply: PlyOnMold
) -> tuple[PocketReport, ...]:
    """Turn CEASE into UNDECIDED for pockets whose fibres have too much excess together with those of others nearby.

    `bumps` are those below the tolerances; the excess of those that have a net counts as well.
    """
    reports = tuple(reports)
    nets = {p.id: laid for p, one in zip(reports, pockets, strict=True) if (laid := _of_pocket(p, one)) is not None}
    same_foot = {found.number: frozenset((found.number, *found.joined)) for found in pockets}
    names = {p.id: str(p.id) for p in reports}
    for number, bump in enumerate(bumps, start=len(reports) + 1):
        if bump.spare is not None and bump.found is None:
            nets[number], same_foot[number] = bump.spare, frozenset((number,))
            names[number] = f"the {bump_name(bump.dropped)}"
    ceasing = [p.id for p in reports if p.verdict is Verdict.CEASE and p.id in nets]
    shared = _shared_folds(ceasing, nets, same_foot, ply)
    return tuple(
        replace(p, verdict=Verdict.UNDECIDED, reason=_reason("it", shared[p.id], names, ply.recipe), decided_by="")
        if p.id in shared
        else p
        for p in reports
    )


def doubts(bumps: Sequence[Bump], ply: PlyOnMold) -> list[Judgement]:
    """Say which bumps below the tolerances may crease together, even without a pocket among them."""
    left = {n: bump for n, bump in enumerate(bumps) if bump.spare is not None and bump.found is None}
    nets = {n: bump.spare for n, bump in left.items() if bump.spare is not None}
    shared = _shared_folds(list(nets), nets, {n: frozenset((n,)) for n in nets}, ply)
    names = {n: f"the {bump_name(bump.dropped)}" for n, bump in left.items()}
    judged, told = [], set[int]()
    for n, fold in sorted(shared.items(), key=lambda item: -item[1].ridge_mm):
        if told.isdisjoint((n, *fold.with_others.numbers)):  # all bumps of a row would report the same fold
            judged.append(Judgement(Verdict.UNDECIDED, _reason(names[n], fold, names, ply.recipe)))
        told |= {n, *fold.with_others.numbers}
    return judged


def _shared_folds(
    numbers: Sequence[int], nets: Mapping[int, SpareNet], same_foot: Mapping[int, frozenset[int]], ply: PlyOnMold
) -> dict[int, _Fold]:
    """Return the worst fold of each of these numbers whose fibres have too much excess together with others."""
    if ply.recipe.verdict.criterion != "excess":
        return {}
    way_mm = friction_length(ply.recipe)
    close = _close_by(nets, way_mm)
    near = {number: _near(number, nets, close, same_foot[number], ply.recipe) for number in numbers}
    wanted = {number for within in near.values() for number in within}
    crossing = {number: _crossing(number, nets[number], same_foot[number], ply) for number in sorted(wanted)}
    walk = FibreWalk(list(crossing.values()), way_mm)
    folds = {number: _worst_fold(crossing[number], walk, ply.recipe) for number in numbers if near[number]}
    return {number: fold for number, fold in folds.items() if fold is not None}


def _of_pocket(p: PocketReport, found: FoundPocket) -> SpareNet | None:
    if p.net is None:
        return None
    assert p.spacing_mm is not None and p.foot_outline_mm is not None  # it has a net
    at_spacing_mm = p.excess_length_mm if p.excess is None else p.excess.at_spacing_mm
    return SpareNet(p.net, p.spacing_mm, p.foot_outline_mm, tail_mm(found), at_spacing_mm or 0.0, lambda: p.excess)


def _close_by(nets: Mapping[int, SpareNet], way_mm: float) -> dict[int, list[int]]:
    """Return for each number the others that at most `way_mm` of ply lying on the mold separates from it."""
    numbers, feet = list(nets), [one.foot_outline_mm for one in nets.values()]
    tails = np.array([one.tail_mm for one in nets.values()])
    close: dict[int, list[int]] = {number: [] for number in numbers}
    if len(numbers) < 2:
        return close
    low, high = (np.array([end(foot, axis=0) for foot in feet]) for end in (np.min, np.max))
    boxes_apart = np.maximum(0.0, np.maximum(low[:, None] - high, low - high[:, None]))
    ways_mm = way_mm + tails[:, None] + tails
    for i, j in np.argwhere(np.hypot(*np.moveaxis(boxes_apart, -1, 0)) <= ways_mm).tolist():
        if i < j and come_within(feet[i], feet[j], ways_mm[i, j]):
            close[numbers[i]].append(numbers[j])
            close[numbers[j]].append(numbers[i])
    return close


def _near(
    number: int, nets: Mapping[int, SpareNet], close: dict[int, list[int]], same_foot: frozenset[int], recipe: Recipe
) -> set[int]:
    """Return the numbers that may share a fold with this one, and itself; empty if all their excess is too little."""
    within, open_ones = {number}, [number]
    while open_ones:
        for other in close[open_ones.pop()]:
            if other not in within | same_foot:
                within.add(other)
                open_ones.append(other)
    if len(within) == 1:
        return set()
    whole_mm = sum(nets[one].most_mm(recipe) for one in sorted(within))
    return within if excess.ridge_of(whole_mm, recipe) > recipe.verdict.max_ridge_mm else set()


def _crossing(number: int, one: SpareNet, numbers: frozenset[int], ply: PlyOnMold) -> CrossingFibres:
    nodes_mm, kinds = one.net.nodes_mm, one.net.kinds
    xy = nodes_mm[:, :2]
    inside, away = pocket.inside(one.foot_outline_mm, xy), pocket.distance_to_outline(one.foot_outline_mm, xy)
    held = []
    for _, nodes in fibres(one.net.neighbours):
        if len(nodes) < 2 or not inside[nodes].any() or not _is_held(nodes, kinds, xy, one.spacing_mm, ply):
            continue
        ends = (
            _end(xy[nodes], inside[nodes], away[nodes]),
            _end(xy[nodes[::-1]], inside[nodes[::-1]], away[nodes[::-1]]),
        )
        held.append(Fibre(one.scale * _excess_mm(nodes_mm[nodes], ply), ends))
    return CrossingFibres(numbers, number, one.spacing_mm, one.tail_mm, one.uncertainty_mm(ply.recipe), tuple(held))


def _is_held(nodes: list[int], kinds: NDArray[np.integer], xy: Floats, spacing_mm: float, ply: PlyOnMold) -> bool:
    """Return whether friction holds both ends of a fibre on the mold.

    A net lets nodes near the ply's edge slide, even if the edge lies to the side of the fibre. Where the ply continues
    along the fibre for the length over which an edge slips, the end is held.
    """
    for at, before in ((nodes[0], nodes[1]), (nodes[-1], nodes[-2])):
        if kinds[at] == _FIXED:
            continue
        if kinds[at] == _INNER or ply.outline is None:
            return False
        way = (xy[at] - xy[before]) / np.linalg.norm(xy[at] - xy[before])
        beyond_mm = np.array([0.1, 0.5, 1.0]) * max(ply.recipe.net.free_edge_mm, spacing_mm)
        if not pocket.inside(ply.outline, xy[at] + beyond_mm[:, None] * way).all():
            return False
    return True


def _end(xy: Floats, inside: NDArray[np.bool_], away: Floats) -> End:
    """Find where a fibre that begins at the first of the points enters the foot."""
    k = int(np.argmax(inside))
    out, within = (0, 1) if k == 0 else (k - 1, k)
    share = away[out] / (away[out] + away[within]) if k and away[out] + away[within] > 0 else 0.0
    way = xy[out] - xy[within]
    return End(xy[out] - share * way, way / np.linalg.norm(way))


def _excess_mm(points: Floats, ply: PlyOnMold) -> float:
    """Return by how much one fibre is longer than the mold below it."""
    chain = np.full((len(points), 4), -1, dtype=np.int32)
    chain[:-1, 0] = np.arange(1, len(points))
    chain[1:, 1] = np.arange(len(points) - 1)
    return float(_core.ridge.largest_fibre_excess(points, chain, ply.reference))


def _worst_fold(one: CrossingFibres, walk: FibreWalk, recipe: Recipe) -> _Fold | None:
    """Return the highest fold above the limit that a fibre makes with the excess of others; None if there is none."""
    worst = None
    for k, fibre in enumerate(one.fibres):
        shared = Shared(taken=one.numbers)
        for side in (0, 1):
            shared = walk.beyond(one.number, k, side, shared)
        total_mm = fibre.spare_mm + shared.spare_mm
        # The uncertainties are those of ridges; an excess is uncertain by twice as much.
        most_mm = total_mm + 2 * math.sqrt(one.uncertainty_mm**2 + shared.variance_mm2)
        ridge_mm = excess.ridge_of(most_mm, recipe)
        if shared.spare_mm > 0 and ridge_mm > (recipe.verdict.max_ridge_mm if worst is None else worst.ridge_mm):
            worst = _Fold(ridge_mm, total_mm, shared)
    return worst


def _reason(name: str, fold: _Fold, names: Mapping[int, str], recipe: Recipe) -> str:
    others = sorted(fold.with_others.numbers)
    pockets, bumps = ([names[n] for n in others if names[n].isdigit() is told] for told in (True, False))
    named = [f"pocket{'s' * (len(pockets) > 1)} {_listed(pockets)}"] if pockets else []
    limit_mm, way_mm = recipe.verdict.max_ridge_mm, friction_length(recipe)
    return (
        f"a fibre over {name} and {' and '.join(named + [_listed(bumps)] * bool(bumps))} is {fold.excess_mm:.2f} mm "
        f"longer than the mold: a ridge of up to {fold.ridge_mm:.2f} mm, above the limit of {limit_mm:.2f} mm, if one "
        f"fold draws it all together; only more than {way_mm:.3g} mm of flat ply between them would hold it apart by "
        "friction"
    )


def _listed(names: Sequence[str]) -> str:
    """Name the first few, and count the others."""
    more = [f"{len(names) - _NAMED} more"] if len(names) > _NAMED else []
    return " and ".join([*names[:_NAMED], *more])
