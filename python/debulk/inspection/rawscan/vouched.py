"""Parts of a scan that its own noise does not vouch for, so that they were not measured.

A scanner measures each point for itself: what it sees differs from what the point's neighbours foretell, by its noise.
Where software filled a hole, took a bump out or clipped the depths, it made a point of its neighbours, and the
difference shows how: an interpolation leaves next to none, a copy repeats a neighbour's depth, and a guess that went
wrong is off by many times the noise. One number decides over each small part of the ply: the odds that its points were
made, given how many of them are quiet, copied or wild there, and in the whole scan.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Bools, Cloud, Floats, Whole
from debulk.grid import Grid
from debulk.inspection.clouds.thinning import complete
from debulk.inspection.evidence.cloud_image import ROUNDING, CloudImage
from debulk.inspection.evidence.pieces import pieces_of
from debulk.inspection.evidence.smooth_patches import steps_hide
from debulk.inspection.find.found import Found
from debulk.inspection.holes.unseen import most_ridge_mm
from debulk.recipe import Recipe
from debulk.results.area import in_cm2
from debulk.results.finding import Finding
from debulk.verdict import Verdict


@dataclass(frozen=True)
class Limits:
    """Of points that the noise vouches for; bench/trust/foreign.py replaces bumps by all that such filters use."""

    cell_mm: float = 0.8  # side of the cells in which one point is asked
    window_cells: int = 7  # along the side of the parts of the ply that are judged
    # Of the median of all fourth differences, which is 5.6 sigma: smaller is quiet, greater is wild. Of noise 0.13 is
    # quiet, of half of it 0.26; of noise ten times as strong 0.05 is wild.
    quiet: float = 0.25
    wild: float = 30.0
    copied_share: float = 0.1  # of all points: if more repeat a neighbour, the scan's depths are rounded
    least_mm: float = 1e-3  # median of the fourth differences: below is no noise that a part could lack
    # Probabilities of a made point to be copied or wild, and to be quiet, as if nothing more was known of it: of
    # inpainted points 0.4 to 1 are one of the two, and of those on folds, kinks and edges of a ply 0.1 to 0.4.
    made_copied: float = 0.35
    made_quiet: float = 0.35
    rarest: float = 0.01  # probability of what a measured point hardly ever is
    least_share: float = 0.3  # of a part's cells in which a point was asked


LIMITS = Limits()
_FOURTH = tuple(zip((1.0, -4.0, 6.0, -4.0, 1.0), range(-2, 3), strict=True))
_BESIDE = tuple((down, right) for down in (-1, 0, 1) for right in (-1, 0, 1) if down or right)


class Asked(NamedTuple):
    """Some points of a scan, and how they differ from their neighbours."""

    points: Cloud
    """(N, 3), all finite."""
    apart_mm: Floats
    """(2, N) fourth differences along the image's columns and rows; NaN where a neighbour was not seen."""
    copied: Bools
    """(N,) whether a neighbour has the same depth, to the resolution of a float32."""
    cell_mm: float
    """Side of the square that each of them has for itself."""

    def of(self, index: Whole) -> Asked:
        """Return those with these numbers."""
        return Asked(self.points[index], self.apart_mm[:, index], self.copied[index], self.cell_mm)


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
        if self.copied >= max(self.quiet, self.wild):
            return "repeat depths of their neighbours"
        return "carry no measuring noise" if self.quiet >= self.wild else "scatter many times as much"


def asked_in(image: CloudImage, mask: Bools | None) -> Asked:
    """Ask points of a scan's image, about one in each cell, but none at which the scan's (H, W) mask is True."""
    points, depth, shape = image.points, image.heights[..., 2], image.points.shape[:2]
    step = max(1, round(LIMITS.cell_mm / image.pitch_mm))
    rows, columns = np.ix_(*(np.arange(2, n - 2, step) for n in shape))

    def at(of: NDArray[np.float32], down: int, right: int) -> Floats:
        return np.asarray(of[rows + down, columns + right], dtype=np.float64).reshape(-1)

    here = points[rows, columns].reshape(-1, 3)
    seen = complete(np.isfinite(here))
    if mask is not None and mask.shape == shape:
        seen &= ~mask[rows, columns].reshape(-1)
    apart_mm = np.stack(
        [sum((w * at(depth, *k) for w, k in along), np.zeros(len(here))) for along in (_along(0), _along(1))]
    )
    same_mm = ROUNDING * float(np.spacing(np.abs(here[seen, 2]).max(initial=np.float32(0.0))))
    copied = np.zeros(len(here), np.bool_)
    for beside in _BESIDE:
        copied |= np.abs(at(points[..., 2], *beside) - here[:, 2]) <= same_mm
    return Asked(here[seen], apart_mm[:, seen], copied[seen], step * image.pitch_mm)


def not_vouched(asked: Asked, xy_mm: Floats, step_mm: float) -> tuple[tuple[Made, ...], str]:
    """Find the parts of a ply, on which points at mold XY (N, 2) were asked, for which the scan's noise does not vouch.

    `step_mm` is that to which depths were rounded: between two steps heights are smooth without having been filled.
    The second value says why none can be found among those that are quiet; empty: they can.
    """
    sizes, known = np.abs(asked.apart_mm), np.isfinite(asked.apart_mm)
    middle_mm = np.array([np.median(one[seen]) if seen.any() else 0.0 for one, seen in zip(sizes, known, strict=True)])
    if not (middle_mm > LIMITS.least_mm).all():
        return (), "the scan has too little noise to miss it in a patch"
    rounded = step_mm > LIMITS.quiet * float(middle_mm.min())
    sizes /= middle_mm[:, None]
    quiet, copied = sizes <= LIMITS.quiet, asked.copied
    wild = np.asarray(np.all(sizes > LIMITS.wild, axis=0))  # along both: beside a flying pixel it is along one
    if rounded:
        quiet = np.zeros_like(quiet)
    if np.mean(copied) > LIMITS.copied_share:
        copied = np.zeros_like(copied)
    cells = _cells(xy_mm, asked.cell_mm)
    made = np.zeros(cells.values.shape, np.bool_)
    # A fill that runs from rim to rim along rows or columns lacks noise along these alone.
    for along in ([0, 1], [0], [1]):
        told = np.asarray(np.all(known[along], axis=0))
        made |= _made(cells, xy_mm[told], np.all(quiet[along], axis=0)[told], (copied | wild)[told])
    made = cv2.morphologyEx(made.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((3, 3))).view(np.bool_)
    shares = np.stack([np.all(quiet, axis=0), copied, wild])
    return tuple(_pieces(cells, made, xy_mm, shares)), steps_hide(step_mm) if rounded else ""


def findings(parts: tuple[Made, ...], found: Found, recipe: Recipe) -> list[Finding]:
    """Judge each part by the ridge of what the fibres show there and what it can hide besides, as a hole is judged."""
    out, limit_mm = [], recipe.verdict.max_ridge_mm
    for part in parts:
        most_mm = most_ridge_mm(part.box_mm, part.wide_mm, found, recipe)
        if most_mm > limit_mm:
            x, y = part.centre_mm
            reason = (
                f"some {in_cm2(part.area_mm2)} at ({x:.0f}, {y:.0f}) mm {part.how}, unlike the rest of the scan: "
                f"filled in, clipped or replaced by the scanner's software? A ridge of {most_mm:.2f} mm could "
                "have been there. Switch its filling of holes and its removal of outliers off, or give the raw cloud"
            )
            out.append(Finding("filled", Verdict.UNDECIDED, reason, most_mm, limit_mm, "mm", part.centre_mm))
    return out


def _along(axis: int) -> list[tuple[float, tuple[int, int]]]:
    return [(w, (k, 0) if axis == 0 else (0, k)) for w, k in _FOURTH]


def _cells(xy_mm: Floats, cell_mm: float) -> Grid:
    low, high = (xy_mm.min(axis=0), xy_mm.max(axis=0)) if len(xy_mm) else (np.zeros(2), np.zeros(2))
    columns, rows = np.ceil((high - low) / cell_mm).astype(int) + 1
    return Grid(np.zeros((rows, columns)), low, cell_mm)


def _made(cells: Grid, xy_mm: Floats, quiet: Bools, copied: Bools) -> Bools:
    """Return the cells round which points are likelier to have been made than measured (a naive Bayes classifier)."""
    quiet = quiet & ~copied
    natural = np.array([np.count_nonzero(copied), np.count_nonzero(quiet)]) / max(1, len(quiet))
    natural = np.clip(natural, LIMITS.rarest, 0.5 - LIMITS.rarest)  # by the median, half of them are neither at least
    of_made = np.array([LIMITS.made_copied, LIMITS.made_quiet])
    odds = np.log(np.append(of_made, 1 - of_made.sum()) / np.append(natural, 1 - natural.sum()))
    column, row = cells.cells(xy_mm).T
    at, shape = row * cells.values.shape[1] + column, cells.values.shape

    def around(weights: Floats) -> Floats:
        each = np.bincount(at, weights, minlength=cells.values.size).reshape(shape)
        side = (LIMITS.window_cells, LIMITS.window_cells)
        return np.asarray(cv2.boxFilter(each, -1, side, normalize=False, borderType=cv2.BORDER_CONSTANT))

    enough = around(np.ones(len(at))) >= LIMITS.least_share * LIMITS.window_cells**2
    return enough & (around(np.where(copied, odds[0], np.where(quiet, odds[1], odds[2]))) > 0)


def _pieces(cells: Grid, made: Bools, xy_mm: Floats, shares: Bools) -> list[Made]:
    """Measure each connected part; `shares` (3, N) are marks of points that are quiet, copied and wild."""
    pieces, out = pieces_of(made, 4), []
    column, row = cells.cells(xy_mm).T
    number_of = pieces.labels[row, column]
    for number in pieces.of_size(LIMITS.window_cells):
        own = np.pad(pieces.labels[pieces.window(number, 0)] == number, 1)
        wide_mm = 2 * float(cv2.distanceTransform(own.astype(np.uint8), cv2.DIST_L2, 5).max()) * cells.spacing_mm
        inside = np.flatnonzero(number_of == number)
        if len(inside):
            places = xy_mm[inside]
            x, y = places.mean(axis=0).tolist()
            box_mm = np.stack([places.min(axis=0), places.max(axis=0)])
            area_mm2 = float(pieces.sizes[number]) * cells.spacing_mm**2
            out.append(Made((x, y), area_mm2, wide_mm, box_mm, *np.mean(shares[:, inside], axis=1).tolist()))
    return out
