"""A pocket that borders on a hole in the data, judged for each way in which the ply may lie in the hole.

No scan shows how the ply lies in a hole. If the pocket gets the same verdict in each way, that verdict holds. The ways
are: the hole is filled in by continuing the surface round it; the ply lies on the mold in the hole; and, before the
pocket is called CREASE, the hole is spanned by as little ply as possible, so that all excess is excess that was seen.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from debulk import _core, pocket, verdict
from debulk.grid import Grid
from debulk.inspection.evaluate.evaluated import Evaluation, refused
from debulk.inspection.find.found import FoundPocket
from debulk.inspection.holes.pocket_holes import PocketHoles, rim_share
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.recipe import options
from debulk.results.half_seen import MOLD_UNKNOWN, MOST_OF_RIM, HalfSeen, Way, at_best, hole_names
from debulk.results.report import PocketReport
from debulk.verdict import Judgement, Verdict, criteria_of

Heights = NDArray[np.float32]
Flags = NDArray[np.bool_]
Evaluate = Callable[[FoundPocket], Evaluation]

_FILLED, _ON_MOLD, _SPANNED = "filled in", "on the mold", "spanned"
_AGAIN = "scan again"
# Weights of the first against the second differences of the heights in the hole. A weight near zero gives a plate that
# continues the slopes at the rim; a large one gives a stretched membrane.
_PLATE, _MEMBRANE = 1e-4, 1e4
_AS_SEEN = ("outline_mm", "foot_outline_mm", "area_mm2", "peak_mm", "volume_mm3", "measured_share")


def judged(
    found: FoundPocket, seen: PocketReport, hole: PocketHoles, ply: PlyOnMold, stop: _core.Stop, evaluate: Evaluate
) -> Evaluation:
    """Judge a pocket in each way that the ply may lie in the hole; `seen` is its report, as far as it was seen.

    The evaluation is that of the pocket with the hole filled in, with the verdict that follows from all ways.
    `evaluate` evaluates a pocket whose rim is closed.
    """
    names, half = hole_names(hole.holes), HalfSeen(holes=hole.holes, rim_share=hole.rim_share)
    if lacking := [MOLD_UNKNOWN[one.of] for one in hole.holes if one.of in MOLD_UNKNOWN]:
        return _refused(seen, half, f"{names} borders on it, and the mold under it is not known", lacking[0])
    evaluations: dict[str, list[Evaluation]] = {}
    own = hole.pocket | hole.unknown
    for way, heights in _ways(hole, ply, stop):
        if way == _SPANNED and any(_worst(done).report.verdict is not Verdict.CREASE for done in evaluations.values()):
            break
        pieces = [] if heights is None else list(_pieces(found, own, hole, heights, ply, stop))
        if not pieces or not all(piece.foot.closed for piece in pieces):
            return _refused(seen, half, f"{names} borders on it, and hides where it ends")
        if way == _FILLED:
            stands = np.isin(pieces[0].segmentation.labels.values, [piece.pocket.id for piece in pieces])
            own |= stands  # cells that are one pocket with the hole filled in stay together in the other ways
            measured = 1 - np.count_nonzero(stands & hole.unknown) / np.count_nonzero(stands)
            seen = replace(seen, measured_share=min(seen.measured_share, measured))
            share = max(rim_share(piece.foot.outline_mm, hole.unknown, hole.heights) for piece in pieces)
            half = replace(half, rim_share=share)
            if share > MOST_OF_RIM:
                why = f"{100 * share:.0f} % of its perimeter, more than {100 * MOST_OF_RIM:.0f} %"
                return _refused(seen, half, f"{names} borders on it and hides {why}")
        evaluations[way] = [evaluate(piece) for piece in pieces]
    ways = tuple(_way(name, done) for name, done in evaluations.items())
    return _of_all(seen, replace(half, ways=ways), evaluations, ply)


def _ways(hole: PocketHoles, ply: PlyOnMold, stop: _core.Stop) -> Iterator[tuple[str, Heights | None]]:
    """Yield each way with the window's heights; None if the known heights round the hole do not determine them."""
    unknown, known = hole.unknown.view(np.uint8), np.asarray(hole.heights.values, dtype=np.float32)
    low_mm = np.float32(ply.recipe.material.thickness_mm)

    def bridged(weight: float) -> Heights | None:
        heights = _core.surface.bridged(known, unknown, weight, stop)
        return None if heights is None else np.where(hole.unknown, np.maximum(heights, low_mm), known)

    yield _FILLED, bridged(_PLATE)
    yield _ON_MOLD, np.where(hole.unknown, low_mm, known)
    yield _SPANNED, bridged(_MEMBRANE)


def _pieces(
    found: FoundPocket, own: Flags, hole: PocketHoles, heights: Heights, ply: PlyOnMold, stop: _core.Stop
) -> Iterator[FoundPocket]:
    """Find the pockets where the pocket or the hole is: a single one, or several that the hole separates.

    If all of them fall below the tolerances, they are looked for without the tolerances.
    """
    wanted, lower = options.segment(ply.recipe, ply.outline), options.feet(ply.recipe)
    lower.noise_mm = found.feet.noise_mm  # the noise of the whole scan: a window is too small to estimate it
    window = Grid(heights, hole.heights.origin_mm, hole.heights.spacing_mm)
    for _ in range(2):
        again = pocket.segment_with(wanted, window, 1, stop)
        of_it = {int(label) for label in np.unique(again.labels.values[own])} - {0}
        if of_it:
            feet = pocket.feet_with(lower, again, 1, stop)
            runs = ply.fibres.over(again, feet, stop, whole=False, threads=1)
            for label in sorted(of_it):
                yield replace(found, segmentation=again, feet=feet, index=label - 1, runs=runs)
            return
        wanted.area_tol_mm2, wanted.peak_tol_mm = 0.0, 0.0


def _worst(evaluations: list[Evaluation]) -> Evaluation:
    return max(evaluations, key=lambda one: one.report.verdict)


def _way(name: str, evaluations: list[Evaluation]) -> Way:
    worst = _worst(evaluations).report
    ridge_mm = worst.ridge_range_mm
    if worst.excess is not None and (worst.decided_by == "excess" or ridge_mm is None):
        ridge_mm = worst.excess.range_mm
    return Way(holes=name, verdict=worst.verdict, reason=worst.reason, ridge_range_mm=ridge_mm)


def _of_all(seen: PocketReport, half: HalfSeen, evaluations: dict[str, list[Evaluation]], ply: PlyOnMold) -> Evaluation:
    """Combine the verdicts of all ways; the result is never better than the hole allows."""
    filled = _worst(evaluations[_FILLED])
    names, limits = hole_names(half.holes), ply.recipe.verdict
    best = at_best(half, ply.recipe.segmentation.area_tol_mm2)
    said = ", ".join(f"{way.verdict.name} with it {way.holes}" for way in half.ways)
    late = ", ".join(dict.fromkeys(one.late for done in evaluations.values() for one in done if one.late))
    if late:
        cut = next(one for done in evaluations.values() for one in done if one.late)
        judgement = Judgement(max(Verdict.UNDECIDED, best), cut.report.reason)
    elif best is not Verdict.CREASE and seen.measured_share < limits.min_pocket_coverage:
        # Not asked of CREASE: however little of a pocket was seen, that part may show that it creases.
        judgement = verdict.judge(certified=False, coverage=seen.measured_share, criteria=criteria_of(ply.recipe))
        reason = f"{judgement.reason}: {names} borders on it, {_AGAIN}; {said}"
        judgement = Judgement(judgement.verdict, reason, remedy=_AGAIN)
    elif len({way.verdict for way in half.ways}) > 1:
        judgement = Judgement(best, f"{names} borders on it and decides: {_AGAIN}; {said}", remedy=_AGAIN)
    elif best is not half.ways[0].verdict:
        reason = f"{names} borders on it and may hide more than its rim shows: {_AGAIN}; {said}"
        judgement = Judgement(best, reason, remedy=_AGAIN)
    else:
        judgement = Judgement(best, f"{half.ways[0].reason}, however the ply lies in {names} beside it")
    report = replace(
        filled.report,
        verdict=judgement.verdict,
        reason=judgement.reason,
        remedy=judgement.remedy,
        half_seen=half,
        **{name: getattr(seen, name) for name in _AS_SEEN},
        runtime_ms=sum(one.report.runtime_ms for done in evaluations.values() for one in done),
    )
    left_out = tuple(entry for done in evaluations.values() for one in done for entry in one.left_out)
    return replace(filled, report=report, left_out=tuple(dict.fromkeys(left_out)), late=late)


def _refused(seen: PocketReport, half: HalfSeen, why: str, remedy: str = _AGAIN) -> Evaluation:
    return refused(replace(seen, half_seen=half), f"{why}: {remedy}", remedy)
