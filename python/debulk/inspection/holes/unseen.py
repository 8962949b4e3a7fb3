"""The parts of the ply that were not seen, and how they limit the verdict."""

from __future__ import annotations

from collections.abc import Sequence

from debulk import pocket
from debulk.arrays import Floats
from debulk.inspection.find.found import Found
from debulk.inspection.holes.pocket_holes import BRIDGE_MM, NEAR_MM, listed_hole
from debulk.inspection.ply import excess
from debulk.recipe import Recipe
from debulk.results.finding import Finding
from debulk.results.half_seen import remedy_for
from debulk.results.report import LeftOut, PocketReport, UnseenHole
from debulk.verdict import Verdict
from debulk.words import in_cm2, in_mm, xy_of

_WHY = {
    "mask": "the mask hides it",
    "reference": "the reference is not known there: nothing was seen, or a smooth surface cannot follow it",
    "scan": "nothing was seen there",
    "view": "the scanner sees neither the ply there nor the mold",
}


def holes(found: Found, pockets: Sequence[PocketReport], recipe: Recipe) -> tuple[UnseenHole, ...]:
    """Return the holes of a scan as the report lists them, without those that the rule for small holes filled in."""
    return tuple(
        UnseenHole(
            centre_mm=xy_of(hole.centre),
            area_mm2=hole.area,
            extent_mm=xy_of(hole.box[1] - hole.box[0]),
            thickness_mm=hole.thickness,
            rim_height_mm=hole.rim_height,
            of=of,
            at_ply_edge=hole.at_ply_edge,
            at_best=None if (one := _of_hole(hole, of, found, pockets, recipe)) is None else one.at_best,
        )
        for hole, of in found.holes
        if not hole.filled
    )


def findings(found: Found, pockets: Sequence[PocketReport], recipe: Recipe) -> list[Finding]:
    """Judge the parts that were not seen, and the bumps that end in them, maybe no ply, as at the mold's edge."""
    of_holes = (_of_hole(hole, of, found, pockets, recipe) for hole, of in found.holes)
    out = [one for one in of_holes if one is not None]
    judged = [one for one in pockets if one.half_seen is not None and one.half_seen.ways]
    for bump in found.dropped:
        if bump.touches_unknown and not _in_a_foot(bump.centroid_mm, [one for one in judged if one.promoted]):
            where = f"a bump of at least {in_cm2(bump.area_mm2)} at {in_mm(bump.centroid_mm)}"
            reason = f"{where} borders on what was not seen: scan again"
            beside = _of_judged_hole(bump.centroid_mm, found, judged)
            at_best = Verdict.UNDECIDED if beside else Verdict.INVALID
            out.append(Finding("holes", at_best, reason, place_mm=xy_of(bump.centroid_mm)))
    return out


def _of_judged_hole(place_mm: Floats, found: Found, judged: Sequence[PocketReport]) -> bool:
    """Return whether a place is beside a hole that a pocket was judged with, however the ply lies there."""
    with_it = {beside.centre_mm for one in judged if one.half_seen is not None for beside in one.half_seen.holes}
    return any(
        xy_of(hole.centre) in with_it
        and (hole.box[0] - NEAR_MM <= place_mm).all()
        and (place_mm <= hole.box[1] + NEAR_MM).all()
        for hole, _ in found.holes
    )


def _of_hole(
    hole: pocket.UnseenHole, of: str, found: Found, pockets: Sequence[PocketReport], recipe: Recipe
) -> Finding | None:
    """Judge a hole by the ridge of what the fibres show there and what it can hide besides; None: that is harmless.

    A hole that was filled in or bridged, in a pocket's foot or no farther from it than it is wide, is judged with the
    pocket. One that the mask causes hides nothing, unless something stands at its rim: another scan would not show it.
    """
    material = recipe.material
    if of == "mask" and hole.rim_height < material.thickness_mm + recipe.patch.mold_tol_mm:
        return None
    most_mm = most_ridge_mm(hole.box, hole.thickness, found, recipe)
    limit_mm = recipe.verdict.max_ridge_mm
    if most_mm <= limit_mm:  # most are
        return None
    if (hole.filled or hole.thickness <= BRIDGE_MM) and _in_a_foot(hole.centre, pockets, hole.thickness):
        return None
    reason = f"{listed_hole(hole, of)}, where a ridge of {most_mm:.2f} mm could lie unseen: {remedy_for(of)}"
    return Finding("holes", Verdict.UNDECIDED, reason, most_mm, limit_mm, "mm", xy_of(hole.centre))


def most_ridge_mm(box_mm: Floats, wide_mm: float, found: Found, recipe: Recipe) -> float:
    """Return the ridge of what the fibres show in a box or beside it, and of what a place so wide in it can hide."""
    shown_mm = 0.0
    if found.runs is not None:
        largest = found.runs.largest
        shown_mm = float(largest.values[largest.around(box_mm, largest.spacing_mm)].max(initial=0.0))
    return excess.ridge_of(shown_mm + excess.hidden_mm(wide_mm), recipe)


def left_out(found: Found) -> tuple[LeftOut, ...]:
    """Name every hole above the tolerance on area, and sum up the others."""
    entries = [
        LeftOut(
            what=str(listed_hole(hole, of)),
            why=_WHY[of],
            bound=f"{hole.box[1][0] - hole.box[0][0]:.0f} by {hole.box[1][1] - hole.box[0][1]:.0f} mm, "
            f"{hole.thickness:.0f} mm thick; its rim is {hole.rim_height:.2f} mm above the reference",
        )
        for hole, of in found.holes
        if not hole.filled
    ]
    if found.unseen.smaller:
        count = found.unseen.smaller
        entries.append(
            LeftOut(
                what=f"{count} smaller {'hole or thin strip' if count == 1 else 'holes and thin strips'}",
                why=_WHY["scan"],
                bound=f"{in_cm2(found.unseen.smaller_area)} in all",
            )
        )
    return tuple(entries)


def _in_a_foot(place_mm: Floats, pockets: Sequence[PocketReport], reach_mm: float = 0.0) -> bool:
    """Return whether a place lies in a pocket's foot (else its outline), or nearer to it than `reach_mm`."""
    return any(
        pocket.inside(one.foot_or_outline_mm, place_mm[None])[0]
        or pocket.distance_to_outline(one.foot_or_outline_mm, place_mm[None])[0] < reach_mm
        for one in pockets
    )
