"""Bumps that ride on a pocket and are so narrow that the filters take them for noise.

What stands on even ground is found by `narrow_bumps`; a pocket is none. But its heights, after all filters, tell how
the ply lies without such a bump: where points of the scan next to each other stand above them, with hardly any below,
there is one. It is looked for where a layup would pass.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk.inspection import excess
from debulk.inspection.found import FoundPocket
from debulk.inspection.narrow_bumps import bell_excess_mm
from debulk.inspection.ply_on_mold import PlyOnMold
from debulk.inspection.raw_points import RawPoints
from debulk.inspection.windows import heights_at, labels_at
from debulk.results.report import PocketReport
from debulk.verdict import Judgement, Verdict

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["Rider", "doubts", "riders_on"]

Floats = NDArray[np.float64]

_STANDS_OUT_MM = 0.3  # above the filtered heights; a bump that stands out by less has hardly lost anything
_NOISE = 6.0  # times the noise of the points, at least
_WIDE_MM = 5.0  # what is narrower covers too few pixels
_FEWEST = 5  # points that stand out side by side: fewer are flying pixels
_OUT_SHARE = 0.6  # of the points within a millimetre and a half of the top
_SUNK_SHARE = 0.05  # of those near it, that may lie as deep below: in a highlight, half of them do
_HIGHEST_MM = 25.0


class Rider(NamedTuple):
    """A bump on a pocket: its place, height above the filtered heights, width at its foot, and what it adds."""

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
        Raised from another thread, ends the search soon; a deadline does not: it takes milliseconds a pocket.
    """
    judged = []
    for found, report in zip(pockets, reports, strict=True):
        if stop.cancelled:
            raise _core.Stopped("the search for bumps on pockets was stopped")
        known_mm = _excess_mm(report, ply.recipe)
        for rider in riders_on(found, raw, ply):
            ridge_mm = excess.ridge_of(known_mm + rider.excess_mm, ply.recipe)
            if ridge_mm <= ply.recipe.verdict.max_ridge_mm:
                continue
            x, y = rider.top_mm
            reason = (
                f"a bump about {rider.wide_mm:.0f} mm wide at its foot, which stands {rider.height_mm:.1f} mm out of "
                f"the filtered heights, rides on pocket {report.id} at ({x:.0f}, {y:.0f}) mm, and together they could "
                f"make a ridge of {ridge_mm:.2f} mm: look there, and scan again"
            )
            judged.append(Judgement(Verdict.UNDECIDED, reason))
            break
    return judged


def riders_on(found: FoundPocket, raw: RawPoints, ply: PlyOnMold) -> Iterator[Rider]:
    """Find the bumps on one pocket, highest first."""
    heights, outline, pitch_mm = found.feet.heights, found.foot.outline_mm, raw.pitch_mm
    if not len(outline):
        return
    near = raw.over(outline, ply.reference)
    near = near[labels_at(found.feet.labels, near[:, :2]) == found.foot.label]
    if not len(near):
        return
    out = near[:, 2] - ply.reference.height(near[:, :2]) - heights_at(heights, near[:, :2])
    seen = np.isfinite(out) & (np.abs(out) < _HIGHEST_MM)
    xy, out = near[seen, :2], out[seen]
    least_mm = max(_STANDS_OUT_MM, _NOISE * 1.4826 * float(np.median(np.abs(out)))) if len(out) else math.inf
    left_over = np.flatnonzero(out > least_mm)
    left_over = left_over[np.argsort(-out[left_over])]
    while len(left_over) >= _FEWEST:
        top = left_over[0]
        away = np.hypot(*(xy - xy[top]).T)
        close, around = away < 1.5 * max(1.0, pitch_mm), away < 2 * _WIDE_MM
        left_over = left_over[away[left_over] >= 2 * _WIDE_MM]
        raised = around & (out > least_mm)
        sunk = np.mean(out[around] < -least_mm)
        if np.mean(out[close] > least_mm) < _OUT_SHARE or sunk > _SUNK_SHARE or np.count_nonzero(raised) < _FEWEST:
            continue
        height_mm = float(np.sort(out[raised])[-2])  # the highest may be a flying one
        half_high = np.count_nonzero(around & (out > 0.5 * height_mm))
        wide_mm = 2 * math.sqrt(4 / math.pi * half_high) * pitch_mm
        if wide_mm >= _WIDE_MM:
            tx, ty = xy[top].tolist()
            yield Rider((tx, ty), height_mm, wide_mm, bell_excess_mm(height_mm, wide_mm))


def _excess_mm(report: PocketReport, recipe: Recipe) -> float:
    """Return what its fibres have to spare at most."""
    if report.excess is None:
        return max(report.excess_length_mm or 0.0, 0.0)
    return max(report.excess.length_mm + 2 * (report.excess.missed_mm + report.excess.uncertainty_mm), 0.0)
