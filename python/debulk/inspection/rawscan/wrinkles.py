"""Standing wrinkles, already there in the scan: narrow and long, and taken for noise by filters of single points.

A fold of 2 mm is one to four pixels wide. The outlier filter, the spike filter and the median remove such points, as
they remove flying pixels. The difference between the two is that a wrinkle goes on from one row of pixels to the next.
The scan is therefore searched before any filter, along pairs of adjacent rows and columns of pixels; the pairs are some
millimetres apart. Points that stand out narrowly from both sides, in both lines of a pair, are linked from pair to pair
if they lie on a straight line and are about equally high. Such a chain is a wrinkle only if the pixels between its
pairs stand up as well (cpp/debulk/rawscan/standing_wrinkles.hpp).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk import _core, pocket
from debulk.arrays import Cloud, Floats
from debulk.inspection.ply.setup import Setup
from debulk.inspection.rawscan import narrow_bumps
from debulk.inspection.rawscan.narrow_bumps import NarrowBump
from debulk.recipe import Recipe
from debulk.results.finding import Finding
from debulk.results.report import LeftOut, Wrinkle
from debulk.verdict import Verdict

_SEARCH = _core.rawscan.WrinkleOptions()
_BUMPS = _core.rawscan.NarrowBumpOptions()
_FEWEST_PIXELS = 8  # along each side of an image


@dataclass(frozen=True)
class Limits:
    """Of standing wrinkles, which `tests/python/inspection/test_wrinkles.py` has of all widths."""

    same_mm: float = 15.0  # chains nearer to one another than this are one wrinkle
    narrowest_mm: float = 2.0  # a fold of a ply is no narrower
    across_pixels: float = 3.0  # 16 of 16 wrinkles of this width were found, and 6 of 7 of 2 pixels and 8 mm high


LIMITS = Limits()


@dataclass(frozen=True)
class Standing:
    """The result of the search in one scan."""

    wrinkles: tuple[Wrinkle, ...] = ()
    """The wrinkles found, longest first."""
    left_out: tuple[LeftOut, ...] = ()
    """Wrinkles and narrow bumps that could not be looked for, that the search may miss, or that cannot bear a net."""
    unknown: Finding | None = None
    """Why it is not known whether wrinkles stand or not; None if it is known."""
    bumps: tuple[NarrowBump, ...] | None = None
    """Narrow bumps whose ridge could be above the limit, highest first; None: not looked for."""


class WrinkleSearch:
    """Looks for wrinkles in scan after scan.

    The mold is not known where the heights that the smooth surface was fitted to are NaN.
    """

    def __init__(self, setup: Setup) -> None:
        self._outline, self._recipe = setup.outline, setup.recipe
        self._core = _core.rawscan.WrinkleFinder(
            setup.prepared.datum,
            setup.prepared.seen_on_grid(),
            setup.pose,
            np.empty((0, 2)) if setup.outline is None else setup.outline,
            setup.recipe.run.threads,
        )

    def find(self, scan: Cloud, mask: NDArray[np.bool_] | None, stop: _core.Stop | None = None) -> Standing:
        """Find the wrinkles of an organised scan; in any other cloud they cannot be looked for.

        A deadline of the stop ends the search with a finding.
        """
        if scan.ndim != 3 or min(scan.shape[:2]) < _FEWEST_PIXELS:
            return Standing(left_out=(_not_searched("the scan is no image: which points are neighbours is not known"),))
        pitch_mm = _pitch_mm(scan)
        if not pitch_mm > 0:
            return Standing(left_out=(_not_searched("the pitch of the scan's pixels is not known"),))
        if pitch_mm > _SEARCH.widest_mm / 2:
            why = f"the pixels are {pitch_mm:.2g} mm apart, more than half the width of the widest"
            return Standing(left_out=(_not_searched(why),))
        hidden = None if mask is None else mask.view(np.uint8)
        stop = stop or _core.Stop()
        try:
            found, gave_up = self._core.find(scan, hidden, pitch_mm, _SEARCH, stop)
            bumps, wild = self._core.find_bumps(scan, hidden, pitch_mm, _BUMPS, stop)
        except _core.Stopped:
            if stop.cancelled:
                raise
            why = "the deadline passed before the scan was searched for wrinkles that stand already"
            return Standing((), (_not_searched("the deadline passed"),), Finding("deadline", Verdict.UNDECIDED, why))
        wrinkles = self._longest_first(found, pitch_mm)
        narrow = tuple(b for b in narrow_bumps.critical(bumps, pitch_mm, self._recipe) if not _on_any(b, wrinkles))
        if gave_up or wild:
            why = (
                f"the scan is spoiled: in more than {_SEARCH.most} places it stands out sharply from both sides, and "
                "among them no standing wrinkle can be found or ruled out"
            )
            return Standing(wrinkles, (_not_searched(why),), Finding("raw_scan", Verdict.INVALID, f"{why}; scan again"))
        return Standing(wrinkles, _too_narrow(pitch_mm) + narrow_bumps.left_out(narrow, pitch_mm), None, narrow)

    def _longest_first(self, found: Sequence[tuple[Floats, float, float]], pitch_mm: float) -> tuple[Wrinkle, ...]:
        measured = [
            (self._measured(along, height_mm, width_mm, pitch_mm), along)
            for along, height_mm, width_mm in found
            if self._outline is None or np.count_nonzero(pocket.inside(self._outline, along)) >= _SEARCH.links
        ]
        measured.sort(key=lambda one: (-one[0].length_mm, one[0].start_mm))
        kept: list[tuple[Wrinkle, Floats]] = []
        for one in measured:
            if all(_apart_mm(one[1], other[1]) > LIMITS.same_mm for other in kept):
                kept.append(one)
        return tuple(one[0] for one in kept)

    def _measured(self, along: Floats, height_mm: float, width_mm: float, pitch_mm: float) -> Wrinkle:
        half_mm = max(width_mm, pitch_mm)  # across, from its foot to its top, if its sides are straight
        excess_mm = 2 * (math.hypot(height_mm, half_mm) - half_mm)
        thickness_mm = self._recipe.material.thickness_mm
        return Wrinkle(
            start_mm=(float(along[0, 0]), float(along[0, 1])),
            end_mm=(float(along[-1, 0]), float(along[-1, 1])),
            length_mm=float(np.linalg.norm(np.diff(along, axis=0), axis=1).sum()),
            height_mm=height_mm,
            width_mm=width_mm,
            excess_length_mm=excess_mm,
            ridge_height_mm=min(height_mm, _core.ridge.ridge_height_of_excess(excess_mm, thickness_mm)),
        )


def findings(standing: Standing, recipe: Recipe) -> list[Finding]:
    """Judge standing wrinkles: none closes under vacuum, and one whose ridge is above the limit decides the verdict."""
    limit = recipe.verdict.max_ridge_mm
    return [
        Finding(
            "wrinkles",
            Verdict.CREASE if w.ridge_height_mm > limit else Verdict.UNDECIDED,
            f"a wrinkle stands already: {w.height_mm:.1f} mm high, {w.width_mm:.1f} mm wide and {w.length_mm:.0f} mm "
            f"long, from ({w.start_mm[0]:.0f}, {w.start_mm[1]:.0f}) to ({w.end_mm[0]:.0f}, {w.end_mm[1]:.0f}) mm",
            w.ridge_height_mm,
            limit,
            "mm",
            w.start_mm,
        )
        for w in standing.wrinkles
    ]


def _not_searched(why: str) -> LeftOut:
    return LeftOut(
        what="wrinkles that stand already",
        why=why,
        bound=f"one up to {_SEARCH.widest_mm:g} mm wide, which the filters take for noise, would be CREASE whatever "
        "its height; a wider one is a bump or a pocket, and judged as such",
    )


def _too_narrow(pitch_mm: float) -> tuple[LeftOut, ...]:
    across, fold_mm = LIMITS.across_pixels, LIMITS.narrowest_mm
    if across * pitch_mm <= fold_mm:
        return ()
    return (
        LeftOut(
            what=f"standing wrinkles narrower than {across * pitch_mm:.2g} mm",
            why=f"the pixels are {pitch_mm:.2g} mm apart, and what is less than {across:g} pixels wide is missed here "
            "and there",
            bound=f"one of {fold_mm:g} mm, which would be CREASE, needs pixels {fold_mm / across:.2g} mm apart or less",
        ),
    )


def _pitch_mm(scan: Cloud) -> float:
    """Return the median distance of neighbouring pixels in the middle of an image; NaN if nothing was seen there."""
    rows, columns = scan.shape[0] // 2, scan.shape[1] // 2
    middle = scan[rows - rows // 4 : rows + rows // 4 : max(1, rows // 32), columns // 2 : columns + columns // 2]
    with np.errstate(over="ignore", invalid="ignore"):
        steps = np.linalg.norm(np.diff(middle, axis=1), axis=2)
        steps = steps[np.isfinite(steps)]
    return float(np.median(steps)) if steps.size else math.nan


def _on_any(bump: NarrowBump, wrinkles: Sequence[Wrinkle]) -> bool:
    """Return whether a bump is a part of one of the wrinkles."""
    for wrinkle in wrinkles:
        start, end, top = (np.asarray(place) for place in (wrinkle.start_mm, wrinkle.end_mm, bump.top_mm))
        span = end - start
        share = np.clip(np.dot(top - start, span) / max(float(np.dot(span, span)), 1e-9), 0.0, 1.0)
        if float(np.linalg.norm(start + share * span - top)) < LIMITS.same_mm:
            return True
    return False


def _apart_mm(a: Floats, b: Floats) -> float:
    """Return the smallest distance between the points of two wrinkles."""
    return float(np.linalg.norm(a[:, None] - b[None], axis=2).min())
