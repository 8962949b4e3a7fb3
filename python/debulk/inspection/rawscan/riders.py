"""Riders: bumps that ride on a pocket and are so narrow that the filters take them for noise.

Narrow bumps on even ground are found by `narrow_bumps`. Where the ply stands off the mold, there is no even ground.
But its heights after all filters show how the ply lies without such a rider: where points of the raw scan next to each
other stand above these heights, with hardly any below, there is one. Riders are looked for in layups that would pass.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from debulk import _core
from debulk.inspection.evidence.raw_points import RawPoints
from debulk.inspection.find.found import Found, FoundPocket
from debulk.inspection.lines import places
from debulk.inspection.ply import excess
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.inspection.rawscan.narrow_bumps import bell_excess_mm
from debulk.results.finding import Finding
from debulk.verdict import Verdict
from debulk.workers import Workers


class Carrier(NamedTuple):
    """Something that a narrow bump may ride on: a pocket, or another place off the mold."""

    name: str
    """Its name in words."""
    found: FoundPocket
    """The place where it stands."""
    own_excess_mm: float
    """Largest excess length that its own fibres may have, mm."""


class Rider(NamedTuple):
    """A bump on a pocket: its place, height above the ply round it, width at its foot, and the excess that it adds."""

    top_mm: tuple[float, float]
    height_mm: float
    wide_mm: float
    excess_mm: float


def carriers(found: Found, judged: Sequence[FoundPocket], ply: PlyOnMold, stop: _core.Stop) -> Iterator[Carrier]:
    """Yield what is judged, and the other places off the mold; raises `Stopped`."""
    for one in judged:
        yield Carrier(f"pocket {one.number}", one, _own_excess_mm(one))
    for one in places.standing(found, judged, ply, stop):
        x, y = one.pocket.centroid_mm.tolist()
        yield Carrier(f"the bump at ({x:.0f}, {y:.0f}) mm", one, _own_excess_mm(one))


def findings(
    raw: RawPoints, found: Found, judged: Sequence[FoundPocket], ply: PlyOnMold, stop: _core.Stop
) -> list[Finding]:
    """Judge the carriers: UNDECIDED for each one that would cease but could crease because of a bump on it.

    After the deadline of the stop, carriers that were not searched are in doubt.
    """
    limit_mm = ply.recipe.verdict.max_ridge_mm

    def look_at(carrier: Carrier) -> Finding | None:
        try:
            riders = riders_on(carrier.found, raw, ply, stop)
        except _core.Stopped:
            if stop.cancelled:
                raise
            late = f"the deadline passed before bumps on {carrier.name} were looked for"
            return Finding("deadline", Verdict.UNDECIDED, late)
        for rider in riders:
            ridge_mm = excess.ridge_of(carrier.own_excess_mm + rider.excess_mm, ply.recipe)
            if ridge_mm > limit_mm:
                reason = _reason(carrier.name, rider, ridge_mm)
                return Finding("riders", Verdict.UNDECIDED, reason, ridge_mm, limit_mm, "mm", rider.top_mm)
        return None

    threads = ply.recipe.run.threads or _core.default_threads()
    on: list[Carrier] = []
    out: list[Finding] = []
    with Workers(threads, stop) as pool:
        try:
            on.extend(carriers(found, judged, ply, stop))
        except _core.Stopped:
            if stop.cancelled:
                raise
            late = "the deadline passed before all places were cut out on which narrow bumps may ride"
            out.append(Finding("deadline", Verdict.UNDECIDED, late))
        return out + [one for one in pool.map(look_at, on) if one is not None]


def riders_on(found: FoundPocket, raw: RawPoints, ply: PlyOnMold, stop: _core.Stop | None = None) -> list[Rider]:
    """Find the narrow bumps that ride on one pocket or bump, highest first."""
    core = found.feet._core
    foot, datum = core.feet[found.index], ply.datum
    if not len(found.foot.outline_mm):
        return []
    points = raw.over(found.foot.outline_mm, datum)
    listed = _core.rawscan.riders(points, raw.pitch_mm, core, foot, datum, stop or _core.Stop())
    return [Rider((x, y), high_mm, wide_mm, bell_excess_mm(high_mm, wide_mm)) for x, y, high_mm, wide_mm in listed]


def _own_excess_mm(found: FoundPocket) -> float:
    runs = found.excess
    return 0.0 if runs is None else excess.upper_mm(runs[excess.bound(runs)])


def _reason(name: str, rider: Rider, ridge_mm: float) -> str:
    x, y = rider.top_mm
    return (
        f"a bump about {rider.wide_mm:.0f} mm wide at its foot and {rider.height_mm:.1f} mm high, of which the "
        f"filters keep a part, rides on {name} at ({x:.0f}, {y:.0f}) mm, and together they could make a "
        f"ridge of {ridge_mm:.2f} mm: look there, and scan again"
    )
