"""The parts of the ply that were not seen, and how they limit the verdict."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from debulk import pocket
from debulk.inspection.find.found import Found, FoundPocket, Hole
from debulk.inspection.holes.pocket_holes import BRIDGE_MM, NEAR_MM, listed_hole
from debulk.pocket import Dropped
from debulk.recipe import Recipe
from debulk.results.area import in_cm2
from debulk.results.finding import Finding
from debulk.results.report import LeftOut, PocketReport, UnseenHole
from debulk.ridge import excess_of_ridge
from debulk.verdict import Verdict


@dataclass(frozen=True)
class Limits:
    """Of holes beside the recipe's limits; bench/trust/holes.py has holes over creases."""

    speck_points: int = 8  # fewer than 3 by 3, as in the C++ core
    # A smaller hole may hide the upper half of a bell, which would be as high again, and its foot as wide again. In a
    # hole of less than this share of the thickness up to which holes are bridged stands what stands at both its sides.
    hides_share: float = 0.5


LIMITS = Limits()


def standing_mm(recipe: Recipe) -> float:
    """Return the height from which a hole's rim stands up: a quarter of the cut, or more if a laid ply may show it."""
    return max(recipe.segmentation.cut_height_mm / 4, recipe.material.thickness_mm + recipe.patch.mold_tol_mm)


def holes(found: Found, pockets: Sequence[PocketReport], recipe: Recipe) -> tuple[UnseenHole, ...]:
    """Return the holes of a scan as the report lists them, without those that the rule for small holes filled in."""
    return tuple(
        UnseenHole(
            centre_mm=_pair(hole.centre),
            area_mm2=hole.area,
            extent_mm=_pair(hole.box[1] - hole.box[0]),
            thickness_mm=hole.thickness,
            rim_height_mm=hole.rim_height,
            of=listed_hole(hole, hidden).of,
            at_ply_edge=hole.at_ply_edge,
            at_best=None if (one := _of_hole(hole, hidden, found, pockets, recipe)) is None else one.at_best,
        )
        for hole, hidden in found.holes
        if not hole.filled
    )


def findings(found: Found, pockets: Sequence[PocketReport], recipe: Recipe) -> list[Finding]:
    """Judge the parts that were not seen.

    A hole whose rim stands up may hide the rest of whatever stands there. A thick hole with a flat rim may hide a whole
    pocket, unless the hole is due to the mask; so may a hole in which single points stand up. A bump whose area and
    height are lower bounds may be a pocket, unless it was judged as one together with the holes beside it, or lies in a
    hole that a pocket was judged with.
    """
    of_holes = (_of_hole(hole, hidden, found, pockets, recipe) for hole, hidden in found.holes)
    out = [one for one in of_holes if one is not None]
    spacing_mm = 0.0 if found.part is None else found.part[0].heights.spacing_mm
    for bump in found.dropped:
        share = bump.measured_share
        if any(_judged_as(bump, one) for one in pockets):
            continue
        seen = share >= recipe.verdict.min_pocket_coverage
        if not bump.touches_unknown and (seen or _may_be_mm2(bump, found, recipe) < recipe.segmentation.area_tol_mm2):
            continue
        why = "borders on what was not seen" if bump.touches_unknown else f"was seen to {100 * share:.0f} % only"
        at_best = Verdict.INVALID
        if not bump.touches_unknown:
            judged = [one for hole in _holes_round(bump, found.holes) if (one := _judged_with(hole, pockets))]
            specks = single_points(bump, found.holes, spacing_mm, recipe)
            why += specks or (f", in a hole that pocket {judged[0].id} was judged with" if judged else "")
            at_best = Verdict.UNDECIDED if specks or judged else at_best
        place = f"({bump.centroid_mm[0]:.0f}, {bump.centroid_mm[1]:.0f}) mm"
        reason = f"a bump of at least {in_cm2(bump.area_mm2)} at {place} {why}: scan again"
        least = recipe.verdict.min_pocket_coverage
        out.append(Finding("holes", at_best, reason, share, least, place_mm=_pair(bump.centroid_mm)))
    return out


def _judged_as(bump: Dropped, one: PocketReport) -> bool:
    """Return whether a bump was judged as this pocket, however the ply lies in the holes beside it."""
    if not one.promoted or one.half_seen is None or not one.half_seen.ways or one.foot_outline_mm is None:
        return False
    return bool(pocket.inside(one.foot_outline_mm, bump.centroid_mm[None])[0])


def single_points(bump: Dropped | pocket.Pocket, listed: Sequence[Hole], spacing_mm: float, recipe: Recipe) -> str:
    """Return words for a bump that is only a few points in a hole round which the ply lies flat; empty: it is more.

    Highlights leave such stray points in the holes that they make. A fold whose flanks were not seen may leave them
    too. As with any hole that has a flat rim, the evidence speaks neither for a fold nor against it.
    """
    points = bump.measured_share * bump.area_mm2 / spacing_mm**2
    high = standing_mm(recipe)
    holes = [hole for hole in _holes_round(bump, listed) if hole.outer_rim_height < high <= bump.peak_mm]
    if bump.measured_share >= recipe.verdict.min_pocket_coverage or points > LIMITS.speck_points or not holes:
        return ""
    return ", in single points amid what was not seen"


def _holes_round(bump: Dropped | pocket.Pocket, listed: Sequence[Hole]) -> list[pocket.UnseenHole]:
    """Return the holes in whose box the middle of a bump lies."""
    return [h for h, _ in listed if (h.box[0] <= bump.centroid_mm).all() and (bump.centroid_mm <= h.box[1]).all()]


def _may_be_mm2(bump: Dropped, found: Found, recipe: Recipe) -> float:
    """Return the area of a bump with the hole that hides the rest of it; if it is below the tolerance, it is no pocket.

    The excess of the known part is read as everywhere (`lines.places`).
    """
    holes = [
        hole.area
        for hole in found.unseen.holes
        if (np.abs(bump.centroid_mm - hole.box.mean(axis=0)) < _reach(hole) + NEAR_MM).all()
    ]
    return bump.area_mm2 + max(holes, default=0.5 * recipe.segmentation.area_tol_mm2)  # smaller ones are not listed


def _of_hole(
    hole: pocket.UnseenHole, hidden: bool, found: Found, pockets: Sequence[PocketReport], recipe: Recipe
) -> Finding | None:
    """Judge one hole; None: it leaves the verdict as it is."""
    area_tol, high = recipe.segmentation.area_tol_mm2, standing_mm(recipe)
    name = _name(hole, hidden)

    def finding(at_best: Verdict, reason: str, number: int | None = None) -> Finding:
        return Finding("holes", at_best, reason, hole.rim_height, high, "mm", _pair(hole.centre), number)

    specks = f"{name}, in which single points stand {hole.rim_height:.1f} mm high: scan again"
    rises = f"{name}, whose rim stands {hole.rim_height:.1f} mm high: what stands there was not seen, scan again"
    flat = hole.outer_rim_height < high
    standing = finding(Verdict.UNDECIDED, specks) if flat else finding(Verdict.INVALID, rises)
    if hole.filled:
        if hole.rim_height >= high and not _in_a_foot(hole, pockets, _reach(hole)):
            if hole.area >= area_tol:
                return standing
            if not flat and _hides_a_bell(hole, recipe):
                return finding(Verdict.UNDECIDED, rises)
    elif hole.rim_height >= high:
        if one := _judged_with(hole, pockets):
            return finding(Verdict.UNDECIDED, f"{name} borders on pocket {one.id}: scan again", one.id)
        if hidden:  # another scan would not show it either
            return finding(Verdict.UNDECIDED, f"{name}, whose rim stands {hole.rim_height:.1f} mm high")
        if hole.thickness > BRIDGE_MM or not _bridged(hole, found, recipe):
            return standing
    elif hole.thickness > BRIDGE_MM and not hidden:
        return finding(Verdict.UNDECIDED, f"{name}, where a pocket could lie unseen: scan again")
    return None


def _hides_a_bell(hole: pocket.UnseenHole, recipe: Recipe) -> bool:
    """Return whether a bell whose upper half lies in the hole makes a ridge above the limit.

    With a rim g high round a hole w wide it is 2 g high and 2 w wide, and half the integral of its squared slopes, its
    excess, is (π g)² / (2 w).
    """
    high_mm = hole.rim_height - recipe.material.thickness_mm
    limit_mm = excess_of_ridge(recipe.verdict.max_ridge_mm, recipe.material.thickness_mm)
    wide = hole.thickness > LIMITS.hides_share * BRIDGE_MM
    return wide and (math.pi * high_mm) ** 2 > 2 * hole.thickness * limit_mm


def _judged_with(hole: pocket.UnseenHole, pockets: Sequence[PocketReport]) -> PocketReport | None:
    """Return a pocket that was judged with every way in which the ply may lie in this hole; its verdict holds."""
    for one in pockets:
        half = one.half_seen
        if half is not None and half.ways and any(of_it.centre_mm == _pair(hole.centre) for of_it in half.holes):
            return one
    return None


def open_rim(found: FoundPocket) -> str:
    """Return what a pocket's open rim borders on, in words: the nearest hole, if one is listed near it."""
    outline = found.foot.outline_mm

    def gap_mm(hole: pocket.UnseenHole) -> float:
        away = float(pocket.distance_to_outline(outline, hole.box.mean(axis=0)[None])[0])
        return away - _reach(hole)

    listed = [pair for pair in found.holes if not pair[0].filled]
    nearest = min(listed, key=lambda pair: gap_mm(pair[0]), default=None)
    name = "a part of the ply that was not seen"
    if nearest is not None and gap_mm(nearest[0]) < NEAR_MM:
        name = _name(*nearest)
    return f"{name} borders on it: scan again"


def left_out(found: Found) -> tuple[LeftOut, ...]:
    """Name every hole above the tolerance on area, and sum up the others."""
    entries = [
        LeftOut(
            what=_name(hole, hidden),
            why="the mask hides it"
            if hidden
            else "the reference is not known there: nothing was seen, or a smooth surface cannot follow it"
            if hole.reference_share > 0.5
            else "nothing was seen there",
            bound=f"{hole.box[1][0] - hole.box[0][0]:.0f} by {hole.box[1][1] - hole.box[0][1]:.0f} mm, "
            f"{hole.thickness:.0f} mm thick; its rim is {hole.rim_height:.2f} mm above the reference",
        )
        for hole, hidden in found.holes
        if not hole.filled
    ]
    if found.unseen.smaller:
        count = found.unseen.smaller
        entries.append(
            LeftOut(
                what=f"{count} smaller {'hole or thin strip' if count == 1 else 'holes and thin strips'}",
                why="nothing was seen there",
                bound=f"{in_cm2(found.unseen.smaller_area)} in all",
            )
        )
    return tuple(entries)


def _name(hole: pocket.UnseenHole, hidden: bool) -> str:
    return str(listed_hole(hole, hidden))


def _in_a_foot(hole: pocket.UnseenHole, pockets: Sequence[PocketReport], reach_mm: float) -> bool:
    """Return whether a hole's middle lies in a pocket's foot (else its outline), or nearer to it than `reach_mm`."""
    for one in pockets:
        outline = one.outline_mm if one.foot_outline_mm is None else one.foot_outline_mm
        if pocket.inside(outline, hole.centre[None])[0]:
            return True
        if pocket.distance_to_outline(outline, hole.centre[None])[0] < reach_mm:
            return True
    return False


def _bridged(hole: pocket.UnseenHole, found: Found, recipe: Recipe) -> bool:
    """Return whether the segmentation bridged a hole: then whatever stands up there is judged, as a pocket or a bump.

    A thin hole whose rim is below half the cut counts as bridged too: its rim is no pocket's, and a thin hole cannot
    hide a pocket that does not show at its rim.
    """
    if found.part is not None:
        heights = found.part[0].heights
        begin, end = cells = heights.cells(hole.box)
        if (
            heights.holds(cells).all()
            and np.isfinite(heights.values[begin[1] : end[1] + 1, begin[0] : end[0] + 1]).all()
        ):
            return True
    return hole.rim_height < recipe.segmentation.cut_height_mm / 2


def _reach(hole: pocket.UnseenHole) -> float:
    return 0.5 * float(np.linalg.norm(hole.box[1] - hole.box[0]))


def _pair(values: np.ndarray) -> tuple[float, float]:
    return float(values[0]), float(values[1])
