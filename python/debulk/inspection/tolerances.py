"""Bumps that the tolerances drop: the excess of each is bounded, and one that could crease is judged as a pocket."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from debulk import _core, net, ridge
from debulk.inspection import bridge_sections, excess, hills, narrow, straight_fibres
from debulk.inspection.bump_place import BumpPlace, looked_at_again
from debulk.inspection.found import Found, FoundPocket
from debulk.inspection.laid_pocket import lay_net
from debulk.inspection.missed import tail_mm
from debulk.inspection.ply_on_mold import PlyOnMold
from debulk.inspection.spare import SpareNet
from debulk.pocket import Dropped, Feet, Segmentation
from debulk.recipe import Net, Recipe, options
from debulk.results.report import LeftOut
from debulk.stopping import stopping
from debulk.verdict import Judgement, Verdict
from debulk.workers import Workers

__all__ = ["Bump", "bump_name", "doubts", "left_out", "promoted", "weigh"]


@dataclass(frozen=True, eq=False)
class Bump:
    """A bump that the tolerances drop, and a bound on what debulking could make of it.

    Attributes
    ----------
    dropped
        The bump as the segmentation lists it.
    excess_mm, ridge_mm, rms_mm
        Largest excess of a fibre over it, and the bounds on ridge and RMS that follow from this; None if no net was
        laid.
    why
        How it was bounded, in words, or why it is judged as a pocket.
    found
        The bump as a pocket that is judged; None: it stays dropped.
    spare
        Its net, with the excess that its fibres can give to a fold in a pocket nearby; None if no net was laid.
    stands
        The place where it stands, with its foot; None if no net was laid.
    late
        Whether the deadline passed before it was bounded.
    """

    dropped: Dropped
    why: str
    excess_mm: float | None = None
    ridge_mm: float | None = None
    rms_mm: float | None = None
    found: FoundPocket | None = None
    spare: SpareNet | None = None
    stands: FoundPocket | None = None
    late: bool = False


def weigh(found: Found, ply: PlyOnMold, stop: _core.Stop) -> tuple[Bump, ...]:
    """Bound what each dropped bump could become: lay a net on it, and take its largest excess as one ridge.

    Fibres are inextensible and their ends are held. Therefore no minimum has more excess than the laid net
    (docs/model.md, section 8). At the ply's edge, where fibres can slip, the bound is not reached.
    """
    cut_mm = ply.recipe.segmentation.cut_height_mm
    places = [
        BumpPlace(d, cut_mm, whole, feet, found.unseen, found.masked)
        for whole, feet in found.parts
        for d in whole.dropped
    ]

    threads = ply.recipe.run.threads or _core.default_threads()
    each = max(1, threads // max(1, len(found.parts)))  # a whole scan is one part

    def look(part: tuple[Segmentation, Feet]) -> list[BumpPlace] | None:
        whole, feet = part
        try:
            lower = hills.find(whole, feet, ply, stop, each)
            return [BumpPlace(*hill, whole, feet, found.unseen, found.masked) for hill in lower]
        except _core.Stopped:
            return None

    with Workers(threads) as pool, stopping(stop):
        looked = list(pool.map(look, found.parts))
        places += [place for part in looked for place in part or ()]
        places.sort(key=lambda place: -place.dropped.area_mm2)
        bumps = tuple(pool.map(lambda place: _weigh(place, ply, stop), places))
    unlooked = any(part is None for part in looked)
    if unlooked and not any(bump.late for bump in bumps):
        bumps += (Bump(Dropped("height", 0.0, 0.0, np.zeros(2)), "the deadline passed before it was found", late=True),)
    return bumps


def promoted(bumps: Sequence[Bump], first_number: int) -> tuple[FoundPocket, ...]:
    """Return the bumps that are judged as pockets, numbered from `first_number`, largest first."""
    taken = [bump.found for bump in bumps if bump.found is not None]
    return tuple(replace(one, number=number) for number, one in enumerate(taken, start=first_number))


def doubts(bumps: Sequence[Bump]) -> list[Judgement]:
    """Return UNDECIDED if a deadline cut off the bounding of bumps, else nothing."""
    late = sum(bump.late for bump in bumps)
    reason = f"the deadline passed before the excess of {late} bump{'s' * (late > 1)} below the tolerances was bounded"
    return [Judgement(Verdict.UNDECIDED, reason)] if late else []


def left_out(bumps: Sequence[Bump], recipe: Recipe) -> tuple[LeftOut, ...]:
    """Name the bumps that stay dropped, each with its bound."""
    wanted = recipe.segmentation
    return tuple(
        LeftOut(
            what=bump_name(bump.dropped),
            why=f"no pocket: below the tolerance on {bump.dropped.reason}; {bump.why}",
            bound=f"stands {bump.dropped.peak_mm:.2f} mm above the reference; limits {wanted.area_tol_mm2 / 100:g} cm² "
            f"at the cut and {wanted.cut_height_mm + wanted.peak_tol_mm:g} mm",
            place_mm=(float(bump.dropped.centroid_mm[0]), float(bump.dropped.centroid_mm[1])),
        )
        for bump in bumps
        if bump.found is None
    )


def bump_name(dropped: Dropped) -> str:
    """Name a bump by its area and place."""
    return (
        f"bump of {dropped.area_mm2 / 100:.2f} cm² at ({dropped.centroid_mm[0]:.0f}, {dropped.centroid_mm[1]:.0f}) mm"
    )


def _weigh(place: BumpPlace, ply: PlyOnMold, stop: _core.Stop) -> Bump:
    dropped, bounding = place.dropped, _resolving(ply)
    try:
        one = looked_at_again(place, ply, stop)
        if one is None:
            return Bump(dropped, "it stands on a pocket's foot, and is judged with that pocket")
        try:
            if not one.foot.closed:
                return _open(dropped, one, ply, stop)
            # A bent or branched bump fills little of its net: a line between the fibres may have twice their excess.
            between_mm = straight_fibres.longest(one, ply, stop=stop).excess_mm
            laid = lay_net(one, bounding, stop)
            short = bridge_sections.over_bump(laid, one, ply, stop)
        except _core.InputError as error:
            why = f"no net could be laid to bound its excess: {error}"
            return Bump(dropped, why, found=_judged(one, dropped, why))
    except _core.Stopped:
        return Bump(dropped, "the deadline passed before its excess was bounded", late=True)
    one = replace(one, net=laid if bounding is ply else None)
    at_nodes_mm = ridge.largest_fibre_excess(laid.nodes_mm, laid.neighbours, ply.reference)
    excess_mm = max(at_nodes_mm, between_mm)
    ridge_mm, rms_mm = _bounds(laid, excess_mm, ply.recipe)
    least_mm = options.counts_from_mm(ply.recipe)
    figures = f"a fibre over it is up to {excess_mm:.2f} mm longer than the mold, a ridge of {ridge_mm:.2f} mm at most"
    measure = partial(excess.of_net, laid, ply, one)
    spare = SpareNet(laid, laid.spacing_mm, one.foot.outline_mm, tail_mm(one), at_nodes_mm, measure)
    bump = Bump(dropped, figures, excess_mm, ridge_mm, rms_mm, spare=spare, stands=one)
    over_ridge = ridge_mm >= least_mm
    # At the ply's edge, `between_mm` also counts lines that nothing holds: there the excess at the nodes is used.
    steps_over = narrow.stands_on_hill(one) and not one.foot.touches_ply_edge
    lowered_mm = excess_mm if steps_over else at_nodes_mm
    # For bumps lower than a hill, the search for narrow bumps in the raw scan covers what the filters have removed.
    is_hill = place.cut_mm >= place.feet.hill_mm
    if is_hill and (true_mm := narrow.true_ridge_mm(one, lowered_mm, ply.recipe)) >= least_mm:
        lowered = "it is so narrow that the filters may have lowered it"
        possible_mm = max(true_mm, ridge_mm)
        one = replace(one, doubt=f"{figures}, but {lowered}: a ridge of {possible_mm:.2f} mm is possible")
        figures, over_ridge = one.doubt, True
    if short is not None:
        figures, over_ridge = f"{figures}, and {short.why}", True
        one = replace(one, doubt=one.doubt or (short.why if short.likely else ""))
    # The excess rule has no limit on the RMS. With the few nodes of a bump, the RMS would exceed its limit when the
    # ridge is at a third of its own.
    limits = ply.recipe.verdict
    over_rms = limits.criterion == "paper" and rms_mm >= limits.max_rms_mm - limits.rms_margin_mm
    return replace(bump, found=_judged(one, dropped, figures)) if over_ridge or over_rms else bump


def _open(dropped: Dropped, one: FoundPocket, ply: PlyOnMold, stop: _core.Stop) -> Bump:
    """Bound a bump on which no net can be laid, by the visible part of straight lines that are held at both ends."""
    why = "its foot is not known all round"
    seen_mm = straight_fibres.longest(one, ply, ply.recipe.net.free_edge_mm, stop).excess_mm
    listed = dropped.touches_unknown and dropped.reason != "height"  # its area is a lower bound
    if excess.ridge_of(seen_mm, ply.recipe) >= options.counts_from_mm(ply.recipe):
        why += f", and what was seen of a fibre over it is {seen_mm:.2f} mm longer than the mold"
        listed = True
    return Bump(dropped, why, found=_judged(one, dropped, why) if listed else None)


def _judged(one: FoundPocket, dropped: Dropped, why: str) -> FoundPocket:
    return replace(one, promoted=f"below the tolerance on {dropped.reason}, but {why}")


def _resolving(ply: PlyOnMold) -> PlyOnMold:
    """Return the ply with settings for a net that resolves a bump, if the recipe's own net may step over it."""
    wanted = ply.recipe.net
    if wanted.spacing_mm is None and wanted.node_target >= Net().node_target:
        return ply
    nodes = max(wanted.node_target, Net().node_target)
    recipe = ply.recipe.model_copy(update={"net": {"spacing_mm": None, "node_target": nodes}})
    return replace(ply, recipe=recipe)


def _bounds(laid: net.Net, excess_mm: float, recipe: Recipe) -> tuple[float, float]:
    """Return ridge and RMS for the case that every fibre has the largest excess, each in one ridge of one node."""
    base_mm = recipe.material.thickness_mm / recipe.material.bulk_factor
    ridge_mm = excess.ridge_of(excess_mm, recipe)
    fibres = sum(len(np.unique(laid.lattice[laid.inside, k])) for k in (0, 1))
    inside = max(1, int(np.count_nonzero(laid.inside)))
    share = min(1.0, fibres / inside)
    return ridge_mm, math.sqrt(base_mm**2 + share * (ridge_mm**2 - base_mm**2))
