"""Places off the mold that no pocket covers: cut out where a ridge or a bridge may count, and judged as pockets.

The tolerances of the segmentation name pockets and hide nothing: every stretch of a fibre off the mold is a run
(docs/model.md, section 9). The runs that cross no pocket's foot show whether anything else counts, and where it stands.
Only there is the scan segmented again, without tolerances and at half the height, to give the place an outline.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from debulk import _core, pocket
from debulk.arrays import Bools, Floats
from debulk.fibre import FibreRuns
from debulk.inspection.find.found import Found, FoundPocket, runs_over
from debulk.inspection.lines.bridges import bridge_over
from debulk.inspection.ply import excess, polyline
from debulk.inspection.ply.fibre_angles import angles_at
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.inspection.running.cycle import heed
from debulk.recipe import Recipe, options
from debulk.results.number import HIGHEST_MM
from debulk.results.report import LeftOut
from debulk.surface import HeightMap
from debulk.words import in_mm, xy_of

MARGIN_MM = 60.0  # round a foot: the window must hold a net, its patch and the windows of the smoothing


def judged(found: Found, pockets: Sequence[FoundPocket], ply: PlyOnMold, stop: _core.Stop) -> Iterator[FoundPocket]:
    """Yield the places that are judged besides the pockets, numbered on, the highest first; raises `Stopped`.

    At the ply's edge, where fibres can slip, their excess is only an upper bound on what remains.
    """
    if found.runs is None:
        return
    runs, own = found.runs.runs, _uncovered(found, pockets)
    counts = excess.most_mm(runs) >= excess.of_ridge(_counts_from_mm(ply.recipe), ply.recipe)
    bridges = (runs.low_mm < runs.uncertainty_mm) & (runs.gap_mm > options.bridges_from_mm(ply.recipe))
    wanted = own & (counts | bridges)
    number = len(pockets)
    for place in _cut_out(found, wanted, ply, stop):
        why = _why(place, runs[place.crossing[own[place.crossing]]], ply, stop)
        if why:
            number += 1
            yield replace(place, number=number, promoted=f"below the tolerances, but {why}")


def left_out(found: Found, judged: Sequence[FoundPocket], recipe: Recipe) -> tuple[LeftOut, ...]:
    """Name the bumps that the tolerances drop, and bound the excess of all that stands beside what is judged."""
    if found.runs is None:
        return ()
    rest = found.runs.runs[_uncovered(found, judged)]
    limits = recipe.segmentation
    entries = [
        LeftOut(
            what=f"bump of {bump.area_mm2 / 100:.2f} cm² at {in_mm(bump.centroid_mm)}",
            why=f"no pocket: below the tolerance on {bump.reason}; {_longest(over, recipe)}",
            bound=f"stands {bump.peak_mm:.2f} mm above the reference; limits {limits.area_tol_mm2 / 100:g} cm² "
            f"at the cut and {limits.cut_height_mm + limits.peak_tol_mm:g} mm",
            place_mm=xy_of(bump.centroid_mm),
        )
        for bump in found.dropped
        if len(over := rest[np.linalg.norm(rest.top_mm - bump.centroid_mm, axis=1) ** 2 < bump.area_mm2])
    ]
    if len(rest):
        place = rest.top_mm[np.argmax(excess.most_mm(rest))]
        entries.append(
            LeftOut(
                what="nets where the ply stands off the mold beside what is judged",
                why=f"nothing there is judged: {_longest(rest, recipe)}, at {in_mm(place)}",
                bound=f"the limit is {recipe.verdict.max_ridge_mm:.2f} mm",
                place_mm=xy_of(place),
            )
        )
    return tuple(entries)


def _longest(runs: FibreRuns, recipe: Recipe) -> str:
    most_mm = excess.upper_mm(runs)
    ridge_mm = excess.ridge_of(most_mm, recipe)
    if ridge_mm > HIGHEST_MM:
        return "from points so sparse nothing bounds how much longer than the mold a fibre over it is"
    return f"a fibre over it is up to {most_mm:.2f} mm longer than the mold, a ridge of {ridge_mm:.2f} mm at most"


def _uncovered(found: Found, pockets: Sequence[FoundPocket]) -> Bools:
    """Return which runs cross no foot of the pockets, of those without flat ply (`shared_runs` has the rest)."""
    assert found.runs is not None
    out = excess.alone(found.runs.runs)
    out[runs_over(pockets)] = False
    return out


def _counts_from_mm(recipe: Recipe) -> float:
    """Return the ridge from which a place is judged: under the paper's criterion, also one whose RMS counts.

    With the few nodes of a bump, the RMS exceeds its limit when the ridge is at a third of its own. That is the RMS for
    the case that every fibre of a net has this ridge, each of one node.
    """
    counts_mm, limits = options.counts_from_mm(recipe), recipe.verdict
    if limits.criterion != "paper":
        return counts_mm
    base_mm = recipe.material.consolidated_mm
    share = min(1.0, 2 / math.sqrt(recipe.net.node_target))  # fibres of both directions per node
    over_base = (limits.max_rms_mm - limits.rms_margin_mm) ** 2 - base_mm**2
    return min(counts_mm, math.sqrt(max(0.0, base_mm**2 + over_base / share)))


def _why(place: FoundPocket, own: FibreRuns, ply: PlyOnMold, stop: _core.Stop) -> str:
    """Return why a place is judged, by the runs of its own; empty: nothing that counts can come of it."""
    recipe = ply.recipe
    counts_mm = _counts_from_mm(recipe)
    if not place.foot.closed:
        seen_mm = float(own.excess_mm[excess.bound(own)].max(initial=0.0))
        longer = f"what was seen of a fibre over it is {seen_mm:.2f} mm longer than the mold, and its foot is open"
        return longer if excess.ridge_of(seen_mm, recipe) >= counts_mm else ""
    try:
        angles_at(ply.fibre_angles_deg, place.pocket.centroid_mm)
    except _core.InputError as error:
        return f"its excess is not known: {error}"
    if bridge_over(place, ply, stop).counts(options.counts_from_mm(recipe)):
        return f"{_longest(own, recipe)}, and the ply over it may be too short for the hollow below"
    return _longest(own, recipe) if excess.ridge_of(excess.upper_mm(own), recipe) >= counts_mm else ""


def _cut_out(found: Found, wanted: Bools, ply: PlyOnMold, stop: _core.Stop) -> Iterator[FoundPocket]:
    """Yield the places over which the wanted runs come, the highest first."""
    assert found.runs is not None
    runs, left = found.runs.runs, wanted.copy()
    while left.any():
        heed(stop, "the search for places beside the pockets")
        n = int(np.argmax(np.where(left, runs.gap_mm, -np.inf)))
        left[n] = False
        place = _place_at(runs.top_mm[n], float(runs.gap_mm[n]), float(runs.length_mm[n]), found, ply, stop)
        if place is not None:
            left[place.crossing] = False
            yield place


def _place_at(
    top_mm: Floats, gap_mm: float, length_mm: float, found: Found, ply: PlyOnMold, stop: _core.Stop
) -> FoundPocket | None:
    """Segment a window round the top of a place; None if most of it belongs to a pocket, or only a point stands up."""
    threads = ply.recipe.run.threads
    if found.part is None or not np.isfinite(found.part[0].heights.at(top_mm)):
        return None
    whole, feet = found.part
    wanted, lower = options.segment(ply.recipe, ply.outline), options.feet(ply.recipe)
    lower.noise_mm = feet.noise_mm  # the noise of the whole scan: a window is too small to estimate it
    half_way_mm = ply.recipe.material.thickness_mm + 0.5 * (feet.mold_tol_mm + gap_mm)
    wanted.cut_height_mm = min(wanted.cut_height_mm, half_way_mm)
    wanted.area_tol_mm2 = wanted.peak_tol_mm = 0.0
    half_mm = max(MARGIN_MM, 1.5 * length_mm)  # of the first window; it grows until the place's foot lies in it
    while True:
        rows, columns = whole.heights.around(np.stack([top_mm, top_mm]), half_mm)
        again = pocket.segment_with(wanted, _measured(whole, rows, columns), threads, stop)
        label = int(again.labels.at(top_mm))
        owner = feet.labels.values[rows, columns][again.labels.values == label]
        if label == 0 or 2 * np.count_nonzero(owner) > owner.size:
            return None
        bump = again.pockets[label - 1]
        # Smoothed over the window that suits a pocket, a bump 10 mm wide would lose half of its excess.
        lower.smooth_mm = min(lower.smooth_mm, bump.area_mm2 / polyline.perimeter_mm(bump.outline_mm))
        its_feet = pocket.feet_with(lower, again, threads, stop)
        one = FoundPocket(0, again, its_feet, label - 1, found.holes, runs=found.runs)
        if one.foot.closed or again.labels.values.shape == whole.labels.values.shape:
            return one
        half_mm *= 2


def _measured(whole: pocket.Segmentation, rows: slice, columns: slice) -> HeightMap:
    """Return a part of the heights, with what of them was measured."""
    part = whole.heights.part(rows, columns)
    unmeasured: Bools = whole._core.unmeasured[rows, columns].view(np.bool_)
    return HeightMap(part.values, part.origin_mm, part.spacing_mm, ~unmeasured)
