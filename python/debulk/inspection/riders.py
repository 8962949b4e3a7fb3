"""Bumps that ride on a pocket and are so narrow that the filters take them for noise.

What stands on even ground is found by `narrow_bumps`; a pocket is none. But its heights, after all filters, tell how
the ply lies without such a bump: where points of the scan next to each other stand above them, with hardly any below,
there is one. It is looked for where a layup would pass.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, NamedTuple

from debulk import _core
from debulk.inspection import excess
from debulk.inspection.found import FoundPocket
from debulk.inspection.narrow_bumps import bell_excess_mm
from debulk.inspection.ply_on_mold import PlyOnMold
from debulk.inspection.raw_points import RawPoints
from debulk.results.report import PocketReport
from debulk.stopping import stopping
from debulk.verdict import Judgement, Verdict

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["Rider", "doubts", "riders_on"]


class Rider(NamedTuple):
    """A bump on a pocket: its place, height above the ply round it, width at its foot, and what it adds."""

    top_mm: tuple[float, float]
    height_mm: float
    wide_mm: float
    excess_mm: float


def doubts(
    raw: RawPoints, pockets: Sequence[FoundPocket], reports: Sequence[PocketReport], ply: PlyOnMold, stop: _core.Stop
) -> list[Judgement]:
    """Say which pockets that cease could crease for a bump on them.

    Parameters
    ----------
    raw
        The scan before any filter.
    pockets, reports
        Of the same places.
    ply
        What they are judged by.
    stop
        Raised from another thread, ends the search with `Stopped`; past its deadline, the pockets that were not looked
        at are in doubt.
    """

    def doubt(place: int) -> Judgement | None:
        known_mm, number = _excess_mm(reports[place], ply.recipe), reports[place].id
        try:
            riders = riders_on(pockets[place], raw, ply, stop)
        except _core.Stopped:
            if stop.cancelled:
                raise
            return Judgement(Verdict.UNDECIDED, f"the deadline passed before bumps on pocket {number} were looked for")
        for rider in riders:
            ridge_mm = excess.ridge_of(known_mm + rider.excess_mm, ply.recipe)
            if ridge_mm > ply.recipe.verdict.max_ridge_mm:
                return Judgement(Verdict.UNDECIDED, _reason(number, rider, ridge_mm))
        return None

    threads = ply.recipe.run.threads or _core.default_threads()
    with ThreadPoolExecutor(threads, "debulk") as pool, stopping(stop):
        return [judged for judged in pool.map(doubt, range(len(pockets))) if judged is not None]


def riders_on(found: FoundPocket, raw: RawPoints, ply: PlyOnMold, stop: _core.Stop | None = None) -> list[Rider]:
    """Find the bumps on one pocket, highest first."""
    core = found.feet._core
    foot, reference = core.feet[found.index], ply.reference
    if not len(found.foot.outline_mm):
        return []
    points = raw.over(found.foot.outline_mm, reference)
    listed = _core.region.riders(points, raw.pitch_mm, core, foot, reference, stop or _core.Stop())
    return [Rider((x, y), high_mm, wide_mm, bell_excess_mm(high_mm, wide_mm)) for x, y, high_mm, wide_mm in listed]


def _excess_mm(report: PocketReport, recipe: Recipe) -> float:
    """Return what its fibres have to spare at most."""
    if report.excess is None:
        return max(report.excess_length_mm or 0.0, 0.0)
    return max(report.excess.length_mm + 2 * (report.excess.missed_mm + report.excess.uncertainty_mm), 0.0)


def _reason(pocket_id: int, rider: Rider, ridge_mm: float) -> str:
    x, y = rider.top_mm
    return (
        f"a bump about {rider.wide_mm:.0f} mm wide at its foot and {rider.height_mm:.1f} mm high, of which the "
        f"filters keep a part, rides on pocket {pocket_id} at ({x:.0f}, {y:.0f}) mm, and together they could make a "
        f"ridge of {ridge_mm:.2f} mm: look there, and scan again"
    )
