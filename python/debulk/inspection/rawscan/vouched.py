"""Parts of a scan that its own noise does not vouch for, so that they were not measured.

A scanner measures each point for itself: what it sees differs from what the point's neighbours foretell, by its noise.
Where software filled a hole, took a bump out or clipped the depths, it made a point of its neighbours, and the
difference shows how: an interpolation leaves next to none, a copy repeats a neighbour's depth, and a guess that went
wrong is off by many times the noise. One number decides over each small part of the ply: the odds that its points were
made, given how many of them are quiet, copied or wild there, and in the whole scan.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk.arrays import Bools, Cloud, Floats
from debulk.inspection.evidence.cloud_image import SAMPLE_MM, CloudImage
from debulk.inspection.evidence.pieces import pieces_of
from debulk.inspection.find.found import Found
from debulk.inspection.holes.unseen import most_ridge_mm
from debulk.recipe import Recipe
from debulk.results.finding import Finding
from debulk.verdict import Verdict
from debulk.words import in_cm2, in_mm, xy_of


@dataclass(frozen=True)
class Limits:
    """Of points that the noise vouches for; bench/trust/foreign.py replaces bumps by all that such filters use."""

    window_cells: int = 7  # along the side of the parts of the ply that are judged
    # Of the median of all fourth differences, which is 5.6 sigma: smaller is quiet, greater is wild. Of noise 0.13 is
    # quiet, of half of it 0.26; of noise ten times as strong 0.05 is wild.
    quiet: float = 0.25
    wild: float = 30.0
    least_mm: float = 1e-3  # median of the fourth differences: below is no noise that a part could lack
    # Probability of a made point to be copied or wild, and that to be quiet, as if nothing more was known of it: of
    # inpainted points 0.4 to 1 are one of the two, and of those on folds, kinks and edges of a ply 0.1 to 0.4.
    made: float = 0.35
    # Probability of what a measured point hardly ever is; if more points repeat a neighbour, by the median over parts,
    # depths were rounded or smoothed.
    rarest: float = 0.02
    least_share: float = 0.3  # of a part's cells in which a point was asked
    seen_pixels: int = 12  # a part so wide is found on nearly any surface


LIMITS = Limits()
UP = (0.0, 0.0, 1.0)
Axes = tuple[tuple[float, float, float], ...]


class Asked(NamedTuple):
    """Some points of a scan, row by row of its image, and how they differ from their neighbours."""

    points: Cloud
    """(R, C, 3), scanner's frame, or of a list that was laid out: mold XY, and heights above the reference."""
    apart_mm: Cloud
    """(2 A, R, C) sizes of fourth differences along the image's columns and rows, of the heights along each of A axes;
    NaN where a neighbour was not seen."""
    copied: Bools
    """(R, C) whether a neighbour has the same depth, bit for bit."""
    cell_mm: float
    """Side of the square that each of them has for itself."""
    pitch_mm: float
    """Side of a pixel."""


class Made(NamedTuple):
    """A part of the ply for which the noise does not vouch."""

    centre_mm: tuple[float, float]
    """Mold XY."""
    area_mm2: float
    wide_mm: float
    """Width of the widest disc that fits into it."""
    box_mm: Floats
    """(2, 2) lowest and highest mold XY."""
    quiet: float
    copied: float
    wild: float
    """`quiet`, `copied`, `wild`: shares of its points that are so."""

    @property
    def how(self) -> str:
        """What is odd about its points."""
        # Where most are quiet, it does not matter that a level place repeats depths.
        if self.quiet > 0.5 or self.quiet >= max(self.copied, self.wild):
            return "carry no measuring noise"
        return "repeat depths of their neighbours" if self.copied >= self.wild else "scatter many times as much"


def asked_in(image: CloudImage, axes: Axes = (UP,), threads: int = 0, stop: _core.Stop | None = None) -> Asked:
    """Ask points of a scan's image, about one in each cell."""
    step = max(1, round(SAMPLE_MM / image.pitch_mm))
    apart, copied = _core.cloud.fourth_differences(
        image.heights, image.points, step, axes, threads=threads, stop=stop or _core.Stop()
    )
    return Asked(beside(image.heights, step, 0, 0), apart, copied.view(np.bool_), step * image.pitch_mm, image.pitch_mm)


def beside(of: NDArray[Any], step: int, down: int, right: int) -> NDArray[Any]:
    """Return the pixels of an image (H, W, …) so many rows below and columns beside those that are asked."""
    rows, columns = of.shape[:2]
    return of[2 + down : rows - 2 + down : step, 2 + right : columns - 2 + right : step]


def not_vouched(
    asked: Asked, xy_mm: Cloud, on_ply: Bools, step_mm: float, threads: int = 0, stop: _core.Stop | None = None
) -> tuple[tuple[Made, ...], str]:
    """Find the parts of a ply, on which points at mold XY (R, C, 2) were asked, for which the noise does not vouch.

    `on_ply` (R, C) says which of them lie on it. `step_mm` is that to which depths were rounded: between two steps
    heights are smooth without having been filled. The second value says why none can be found among those that are
    quiet; empty: they can.
    """
    noisy, rounded, made, marks = _core.cloud.made_points(
        asked.apart_mm, asked.copied, on_ply, step_mm, LIMITS, threads, stop or _core.Stop()
    )
    if not noisy:
        return (), "the scan has too little noise to miss it in a patch"
    return tuple(pieces(made.view(np.bool_), xy_mm, asked, marks)), steps_hide(step_mm) if rounded else ""


def steps_hide(step_mm: float) -> str:
    """Say why a lack of noise goes undetected in depths that were rounded."""
    return (
        f"the scan's depths are rounded to steps of {step_mm:.2g} mm, which hide its noise: what was filled in "
        "before that looks like the rest"
    )


def findings(parts: tuple[Made, ...], found: Found, recipe: Recipe) -> list[Finding]:
    """Judge each part by the ridge of what the fibres show there and what it can hide besides, as a hole is judged."""
    out, limit_mm = [], recipe.verdict.max_ridge_mm
    for part in parts:
        most_mm = most_ridge_mm(part.box_mm, part.wide_mm, found, recipe)
        if most_mm > limit_mm:
            reason = (
                f"some {in_cm2(part.area_mm2)} at {in_mm(part.centre_mm)} {part.how}, unlike the rest of the scan: "
                f"filled in, clipped or replaced by the scanner's software? A ridge of {most_mm:.2f} mm could "
                "have been there. Switch its hole filling and its removal of outliers off, or give the raw cloud"
            )
            out.append(Finding("filled", Verdict.UNDECIDED, reason, most_mm, limit_mm, "mm", part.centre_mm))
    return out


def pieces(made: Bools, xy_mm: Cloud, asked: Asked, marks: NDArray[Any]) -> list[Made]:
    """Measure each connected part; `marks` (3, R, C) are those of points that are quiet, copied and wild."""
    closed = cv2.morphologyEx(made.view(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)).view(np.bool_)
    out = []
    for window, own in pieces_of(closed, 4).each(LIMITS.window_cells, 0):
        area_mm2 = float(np.count_nonzero(own)) * asked.cell_mm**2
        wide_mm = 2 * float(cv2.distanceTransform(np.pad(own, 1).view(np.uint8), cv2.DIST_L2, 5).max()) * asked.cell_mm
        own &= np.isfinite(xy_mm[window][..., 0])
        places = xy_mm[window][own].astype(np.float64)
        if len(places):
            shares = [float(np.mean(one[window][own])) for one in marks]
            if shares[0] > max(shares[1:]):
                wide_mm += 2 * asked.pitch_mm  # differences across its rim have noise from outside
            centre_mm, box_mm = xy_of(places.mean(axis=0)), np.stack([places.min(axis=0), places.max(axis=0)])
            out.append(Made(centre_mm, area_mm2, wide_mm, box_mm, *shares))
    return out
