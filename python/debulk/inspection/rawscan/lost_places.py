"""What the narrow places of a raw scan that the height map has lost do to the layup.

The height map does not resolve them, so that no net can be laid on them and no fibre line shows their excess. It is
estimated from height and width, and added to what the lines show at that place, of a pocket below it, say.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from debulk.arrays import Floats
from debulk.grid import Grid
from debulk.inspection.find.found import Found
from debulk.inspection.ply import excess
from debulk.inspection.ply.fibre_angles import looked_up
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.inspection.ply.polyline import direction_deg
from debulk.inspection.rawscan.narrow import Narrow, Standing
from debulk.results.finding import Finding
from debulk.results.report import LeftOut, Wrinkle
from debulk.verdict import Verdict
from debulk.words import in_mm


@dataclass(frozen=True)
class Limits:
    """Of narrow places that the height map has lost; `bench/trust/riders.py` has 60 of them."""

    upper_share: float = 0.65  # of its upper half: by what the map lies below so many samples or less, it is lowered
    seen_share: float = 0.75  # of the excess of such a place: pixels miss its top and its foot
    across_samples: float = 3.0  # 36 of 36 wrinkles so wide were found, and 7 of 12 of 2 samples and 8 mm high
    bump_samples: float = 5.0  # bells so wide at their foot were found, 96 of 100 and more if 2 mm high


LIMITS = Limits()
_LOST_CELLS = 9.0  # bells up to so many grid cells wide at their foot vanish in the filters
_BELL_MM = 2.0  # height of the bell that serves as an example in the reports


@dataclass(frozen=True)
class Lost:
    """A narrow place that the height map has lost, with the excess that it adds, and the ridge of all that is there."""

    place: Narrow
    excess_mm: float
    ridge_mm: float
    """Of a single fold that takes up its excess alone."""
    most_mm: float
    """Of one that takes up all that may be there: what pixels miss of the place, and what the fibre lines show."""

    @property
    def wrinkle(self) -> Wrinkle:
        """The record of a standing wrinkle."""
        place, (start, end) = self.place, self.place.ends_mm
        shape = {name: getattr(place, name) for name in ("length_mm", "height_mm", "width_mm")}
        return Wrinkle(
            start_mm=start, end_mm=end, **shape, excess_length_mm=self.excess_mm, ridge_height_mm=self.ridge_mm
        )

    def finding(self, limit_mm: float) -> Finding:
        """Judge it: no wrinkle closes under vacuum, and the height map resolves none of the narrow bumps."""
        one = self.place
        if one.is_wrinkle:
            reason = (
                f"a wrinkle stands already: {one.height_mm:.1f} mm high, {one.width_mm:.1f} mm wide and "
                f"{one.length_mm:.0f} mm long, from {in_mm(*one.ends_mm)}"
            )
            at_best = Verdict.CREASE if self.ridge_mm > limit_mm else Verdict.UNDECIDED
            return Finding("wrinkles", at_best, reason, self.ridge_mm, limit_mm, "mm", one.ends_mm[0])
        reason = (
            f"{_named(one)} is narrower than what the height map resolves, and with what lies below it its "
            f"fibres could make a ridge of {self.most_mm:.2f} mm: look there, and scan again"
        )
        return Finding("narrow_bumps", Verdict.UNDECIDED, reason, self.most_mm, limit_mm, "mm", one.top_mm)


def bell_excess_mm(height_mm: float, wide_mm: float) -> float:
    """Return how much longer a fibre over a bell is than the bell's foot: a squared cosine `wide_mm` across."""
    x = np.linspace(0.0, wide_mm, 200)
    bell = height_mm * np.sin(np.pi * x / wide_mm) ** 2
    return float(np.hypot(np.diff(x), np.diff(bell)).sum()) - wide_mm


def lost(standing: Standing, found: Found, ply: PlyOnMold) -> tuple[Lost, ...]:
    """Return the places of whose excess the height map has lost so much that the ply could crease, highest first.

    What decides is the excess straight across a wrinkle. That of the fibre which crosses it most steeply is reported:
    only if it is above the limit, too, does the wrinkle surely crease.
    """
    recipe = ply.recipe
    limit_mm, out = recipe.verdict.max_ridge_mm, []
    for place in standing.places:
        whole_mm, height_mm = 2 * place.width_mm, place.height_mm  # a bell is half as wide at half its height
        excess_mm = bell_excess_mm(height_mm, whole_mm)
        lost_mm = excess_mm - bell_excess_mm(max(0.0, height_mm - _lowered_mm(place, found)), whole_mm)
        below_mm = 0.0 if found.runs is None else float(found.runs.largest.at(place.samples_mm[:, :2], 0.0).max())
        alone_mm, most_mm = (
            excess.ridge_of(at_mm + lost_mm / LIMITS.seen_share, recipe) for at_mm in (0.0, max(0.0, below_mm))
        )
        if alone_mm > limit_mm or excess.ridge_of(below_mm, recipe) <= limit_mm < most_mm:
            excess_mm = bell_excess_mm(height_mm, whole_mm / _crossed(place, ply))
            out.append(Lost(place, excess_mm, min(height_mm, excess.ridge_of(excess_mm, recipe)), most_mm))
    return tuple(out)


def _crossed(place: Narrow, ply: PlyOnMold) -> float:
    """Return the largest sine of the angles at which fibres cross a wrinkle; 1: a bump, or they are not known."""
    if not place.is_wrinkle:
        return 1.0
    start, end = np.array(place.ends_mm)
    angles, _ = looked_up(ply.fibre_angles_deg, (start + end) / 2)
    return float(np.abs(np.sin(np.radians(np.nan_to_num(angles - direction_deg(end - start), nan=90.0)))).max())


def _lowered_mm(place: Narrow, found: Found) -> float:
    """Return by how much the height map, which may show nothing of the ply, lies below a place's upper half."""
    upper_mm = place.samples_mm[: place.upper]
    kept = np.full(len(upper_mm), -np.inf)
    if found.part is not None:
        kept = np.fmax(kept, _between(found.part[0].heights, upper_mm[:, :2]))
    by_mm = np.sort(upper_mm[:, 2] - kept)  # infinite where the map shows nothing
    return max(0.0, float(by_mm[int(LIMITS.upper_share * len(by_mm))]))


def _between(heights: Grid, xy_mm: Floats) -> Floats:
    """Return the heights (N,) between the points of a grid, at (N, 2) places; NaN where one of the four is unknown."""
    at = ((xy_mm - heights.origin_mm) / heights.spacing_mm).astype(np.float32)
    values = np.asarray(heights.values, dtype=np.float32)
    column, row = (np.ascontiguousarray(at[:, k : k + 1]) for k in (0, 1))
    edge = cv2.BORDER_CONSTANT
    out = cv2.remap(values, column, row, cv2.INTER_LINEAR, borderMode=edge, borderValue=math.nan)
    return np.asarray(out[:, 0], dtype=np.float64)


def left_out(places: Sequence[Lost], standing: Standing, found: Found) -> tuple[LeftOut, ...]:
    """Name the bumps on which no net could be laid, and what was not seen, or not looked for."""
    if not np.isfinite(standing.sample_mm):
        if found.part is None or not np.isfinite(found.pitch_mm):
            return standing.left_out
        heights_mm = max(found.pitch_mm, float(found.part[0].heights.spacing_mm))
        wide_mm = _LOST_CELLS * heights_mm
        unseen = LeftOut(
            what=f"bumps narrower than {wide_mm:.2g} mm at their foot",
            why=f"the heights are {heights_mm:.2g} mm apart, and the filters take what is so narrow for noise",
            bound=_not_bounded(wide_mm),
        )
        return (*standing.left_out, unseen)
    wide_mm, fold_mm = (n * max(1.0, standing.sample_mm) for n in (LIMITS.bump_samples, LIMITS.across_samples))
    unseen = LeftOut(
        what=f"bumps narrower than {wide_mm:.2g} mm at their foot, standing wrinkles narrower than {fold_mm:.2g} mm, "
        "and both beside a hole",
        why=f"the raw scan was searched every {standing.sample_mm:.2g} mm, and what covers so few samples cannot be "
        "distinguished from flying pixels",
        bound=_not_bounded(wide_mm),
    )
    bumps = (
        LeftOut(
            what=_named(one.place),
            why="it is narrower than what the height map resolves: nothing can be laid on it",
            bound=f"a fibre over a bell of this size is {one.excess_mm:.2g} mm longer than the mold, which makes a "
            f"ridge of {one.ridge_mm:.2f} mm",
            place_mm=one.place.top_mm,
        )
        for one in places
        if not one.place.is_wrinkle
    )
    return (*bumps, unseen)


def _not_bounded(wide_mm: float) -> str:
    longer_mm = bell_excess_mm(_BELL_MM, wide_mm)
    return (
        f"none: a fibre over a bell so wide, {_BELL_MM:g} mm high, is {longer_mm:.2g} mm longer than the mold, and "
        "over a higher one more"
    )


def _named(place: Narrow) -> str:
    return (
        f"a bump about {2 * place.width_mm:.0f} mm wide at its foot and {place.height_mm:.1f} mm high at "
        f"{in_mm(place.top_mm)}"
    )
