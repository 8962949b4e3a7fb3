"""Bumps that the tolerances drop: the excess of each is bounded, and one that could crease is judged as a pocket."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk.inspection.bumps import hills
from debulk.inspection.bumps.bump_place import BumpPlace, looked_at_again
from debulk.inspection.find.found import Found, FoundPocket, runs_over
from debulk.inspection.lines.bridges import bridge_over
from debulk.inspection.ply import excess
from debulk.inspection.ply.fibre_angles import angles_at
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.pocket import Dropped, Feet, Segmentation
from debulk.recipe import Recipe, options
from debulk.results.finding import Finding
from debulk.results.report import LeftOut
from debulk.verdict import Verdict
from debulk.workers import Workers


@dataclass(frozen=True, eq=False)
class Bump:
    """A bump that the tolerances drop, and a bound on what debulking could make of it."""

    dropped: Dropped
    """The bump as the segmentation lists it."""
    why: str
    """How it was bounded, in words, or why it is judged as a pocket."""
    excess_mm: float | None = None
    """Largest excess that a fibre over it may have; None if it was not bounded."""
    found: FoundPocket | None = None
    """The bump as a pocket that is judged; None: it stays dropped."""
    stands: FoundPocket | None = None
    """The place where it stands, with its foot; None if it was not bounded."""
    late: bool = False
    """Whether the deadline passed before it was bounded."""


def weigh(found: Found, ply: PlyOnMold, stop: _core.Stop) -> tuple[Bump, ...]:
    """Bound what each dropped bump could become: the largest excess of a fibre over it, as one ridge.

    Fibres are inextensible and their ends are held. At the ply's edge, where they can slip, the bound is not reached.
    """
    cut_mm = ply.recipe.segmentation.cut_height_mm
    places = [
        BumpPlace(d, cut_mm, whole, feet, found.unseen, found.masked, found.runs)
        for whole, feet in found.parts
        for d in whole.dropped
    ]

    judged = runs_over(found.pockets)
    threads = ply.recipe.run.threads or _core.default_threads()
    each = max(1, threads // max(1, len(found.parts)))  # a whole scan is one part

    def look(part: tuple[Segmentation, Feet]) -> list[BumpPlace] | None:
        whole, feet = part
        try:
            lower = hills.find(whole, feet, ply, stop, each)
            return [BumpPlace(*hill, whole, feet, found.unseen, found.masked, found.runs) for hill in lower]
        except _core.Stopped:
            return None

    with Workers(threads, stop) as pool:
        looked = list(pool.map(look, found.parts))
        places += [place for part in looked for place in part or ()]
        places.sort(key=lambda place: -place.dropped.area_mm2)
        bumps = tuple(pool.map(lambda place: _weigh(place, judged, ply, stop), places))
    unlooked = any(part is None for part in looked)
    if unlooked and not any(bump.late for bump in bumps):
        bumps += (Bump(Dropped("height", 0.0, 0.0, np.zeros(2)), "the deadline passed before it was found", late=True),)
    return bumps


def promoted(bumps: Sequence[Bump], first_number: int) -> tuple[FoundPocket, ...]:
    """Return the bumps that are judged as pockets, numbered from `first_number`, largest first."""
    taken = [bump.found for bump in bumps if bump.found is not None]
    return tuple(replace(one, number=number) for number, one in enumerate(taken, start=first_number))


def findings(bumps: Sequence[Bump]) -> list[Finding]:
    """Return UNDECIDED if a deadline cut off the bounding of bumps, else nothing."""
    late = sum(bump.late for bump in bumps)
    reason = f"the deadline passed before the excess of {late} bump{'s' * (late > 1)} below the tolerances was bounded"
    return [Finding("deadline", Verdict.UNDECIDED, reason)] if late else []


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


def named_places(pockets: Sequence[FoundPocket], bumps: Sequence[Bump]) -> list[tuple[str, FoundPocket]]:
    """Return all places off the mold with their names: the pockets, and the bumps that are not judged as pockets."""
    places = [(f"pocket {one.number}", one) for one in pockets]
    return places + [
        (f"the {bump_name(bump.dropped)}", bump.stands)
        for bump in bumps
        if bump.found is None and bump.stands is not None
    ]


def bump_name(dropped: Dropped) -> str:
    """Name a bump by its area and place."""
    return (
        f"bump of {dropped.area_mm2 / 100:.2f} cm² at ({dropped.centroid_mm[0]:.0f}, {dropped.centroid_mm[1]:.0f}) mm"
    )


def _weigh(place: BumpPlace, judged: NDArray[np.intp], ply: PlyOnMold, stop: _core.Stop) -> Bump:
    dropped, recipe = place.dropped, ply.recipe
    try:
        one = looked_at_again(place, ply, stop)
        if one is None:
            return Bump(dropped, "it stands on a pocket's foot, and is judged with that pocket")
        try:
            angles_at(ply.fibre_angles_deg, one.pocket.centroid_mm)
        except _core.InputError as error:
            why = f"its excess is not known: {error}"
            return Bump(dropped, why, found=_judged(one, dropped, why))
        if not one.foot.closed:
            return _open(dropped, one, ply)
        bridge = bridge_over(one, ply, stop)
    except _core.Stopped:
        return Bump(dropped, "the deadline passed before its excess was bounded", late=True)
    # What fibres share with a pocket is judged with that pocket, and what only bumps share in `shared_runs`.
    runs = None if one.runs is None else one.runs.runs[np.setdiff1d(one.crossing, judged)]
    excess_mm = 0.0 if runs is None else excess.upper_mm(runs[excess.alone(runs)])
    ridge_mm = excess.ridge_of(excess_mm, recipe)
    figures = f"a fibre over it is up to {excess_mm:.2f} mm longer than the mold, a ridge of {ridge_mm:.2f} mm at most"
    bump = Bump(dropped, figures, excess_mm, stands=one)
    # The excess rule has no limit on the RMS. With the few nodes of a bump, the RMS would exceed its limit when the
    # ridge is at a third of its own.
    limits = recipe.verdict
    over_rms = limits.criterion == "paper" and _rms_mm(ridge_mm, recipe) >= limits.max_rms_mm - limits.rms_margin_mm
    bridges = bridge.counts(options.counts_from_mm(recipe))
    if bridges:
        figures += ", and the ply over it may be too short for the hollow below"
    counts = bridges or over_rms or ridge_mm >= options.counts_from_mm(recipe)
    return replace(bump, found=_judged(one, dropped, figures)) if counts else bump


def _open(dropped: Dropped, one: FoundPocket, ply: PlyOnMold) -> Bump:
    """Bound a bump whose foot is not known all round by the runs over it that are held at both ends."""
    why, runs = "its foot is not known all round", one.excess
    held = None if runs is None else runs[runs.held & excess.alone(runs)]
    seen_mm = 0.0 if held is None else float(held.excess_mm.max(initial=0.0))
    listed = dropped.touches_unknown and dropped.reason != "height"  # its area is a lower bound
    if excess.ridge_of(seen_mm, ply.recipe) >= options.counts_from_mm(ply.recipe):
        why += f", and what was seen of a fibre over it is {seen_mm:.2f} mm longer than the mold"
        listed = True
    return Bump(dropped, why, found=_judged(one, dropped, why) if listed else None)


def _judged(one: FoundPocket, dropped: Dropped, why: str) -> FoundPocket:
    return replace(one, promoted=f"below the tolerance on {dropped.reason}, but {why}")


def _rms_mm(ridge_mm: float, recipe: Recipe) -> float:
    """Return the RMS for the case that every fibre of a net has this ridge, each of one node."""
    base_mm = recipe.material.thickness_mm / recipe.material.bulk_factor
    share = min(1.0, 2 / math.sqrt(recipe.net.node_target))  # fibres of both directions per node
    return math.sqrt(base_mm**2 + share * (ridge_mm**2 - base_mm**2))
