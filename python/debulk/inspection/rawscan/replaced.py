"""Patches of a ply inside a closed line of jumps, which a filter put in place of what stood out there.

A laid ply is one surface: between neighbouring samples its height bends, but it does not jump, unless the mold does.
A filter that takes what stands out for outliers, and sets it to a median, a mean or a plane, leaves a closed line of
jumps where measured heights end and made ones begin. What was there before is not known: the patch was not seen, as if
it were a hole.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Bools
from debulk.inspection.evidence.medians import OF_MEDIAN
from debulk.inspection.evidence.pieces import grown, pieces_of
from debulk.inspection.find.found import Found
from debulk.inspection.holes.unseen import most_ridge_mm
from debulk.inspection.ply.hidden import steepest_bell_mm
from debulk.recipe import Recipe
from debulk.results.area import in_cm2
from debulk.results.finding import Finding
from debulk.verdict import Verdict

Heights = NDArray[np.float32]
Marks = NDArray[np.uint8]


@dataclass(frozen=True)
class Limits:
    """Of jumps along a closed line; bench/trust/foreign.py replaces bumps by all that such filters use."""

    sigmas: float = 8.0  # of the samples' noise: of noise alone, one sample in 2000 jumps so far
    flies: float = 4.0  # times the least jump: what stands off all of its neighbours by more is a flying pixel
    mold_share: float = 0.5  # of the least jump: where the mold bends more, the ply on it may seem to jump
    mold_samples: int = 2  # from such a bend, as far as scan and reference may lie apart
    steps: float = 2.5  # of rounded depths: contour lines on level ply are closed, and one step high
    gap_samples: int = 5  # side of the square that closes gaps in a line: some jumps along it are small
    least_samples: int = 10  # of a line
    directions: int = 24  # from the middle of a patch, in which its line is looked for
    # Of the directions, in which it is seen: a median may meet a bump's foot without a jump. A corner of the ply's edge
    # is seen in 0.6 of them.
    round_share: float = 0.75
    rim_samples: float = 2.0  # from the hull of a line, in which it lies
    beside_samples: int = 8  # round it, where its surroundings end
    other_share: float = 0.1  # of the samples inside it, and round it, that may jump: among flying pixels more do
    least_mm: float = 6.0  # width of a patch: what is narrower hides half of the excess that creases
    widest_mm: float = 60.0  # a window that replaces more is no filter of outliers; a whole ply has an edge, too


LIMITS = Limits()
_SOME = 16  # of so many rows, one is read for the noise
_CELL = 4  # samples along the side of the cells by which lines are found first
_LEAST_CELLS, _LEAST_ACROSS = 6, 3  # of a line round a patch 9 samples wide
_CROSS = ((0, 0), (-1, 0), (1, 0), (0, -1), (0, 1))
_AROUND = (*_CROSS[1:], (-1, -1), (-1, 1), (1, -1), (1, 1))
_BEND = np.array([[1.0, -2.0, 1.0]], dtype=np.float32)
_WIDE = np.array([[1.0, 0.0, 0.0, -2.0, 0.0, 0.0, 1.0]], dtype=np.float32)  # over the cells of a reference's grid
_TO_SIGMA = OF_MEDIAN / math.sqrt(6.0)  # of the median of second differences of white noise


@dataclass(frozen=True)
class Replaced:
    """A patch inside a closed line of jumps."""

    centre_mm: tuple[float, float]
    """Mold XY."""
    area_mm2: float
    thickness_mm: float
    """Width of the widest disc that fits into it; as in `area_mm2`, the line itself included."""
    box_mm: NDArray[np.float64]
    """(2, 2) lowest and highest mold XY."""


def replaced(
    height: Heights,
    mold: Heights,
    xy_mm: Heights,
    sample_mm: float,
    narrowest_mm: float,
    step_mm: Callable[[], float],
) -> tuple[Replaced, ...]:
    """Find the patches in heights (H, W) above those of the mold, NaN where nothing is known, at mold XY (H, W, 2).

    `narrowest_mm` is the width of the narrowest bump that creases. `step_mm` returns to what the scan's depths were
    rounded; it is called only where patches are found.
    """
    least_mm = max(LIMITS.sigmas * _noise_mm(height[::_SOME]), _bent_mm(sample_mm, narrowest_mm))
    jumps, out = _jumps(height, least_mm), []
    for window in _windows(jumps):
        part, at = height[window], xy_mm[window]
        if _surrounded(jumps[window], at, sample_mm):  # they are few
            here_mm = max(least_mm, LIMITS.sigmas * _noise_mm(part), LIMITS.steps * step_mm())
            smooth = ~_sharp(mold[window], LIMITS.mold_share * least_mm)
            out += _surrounded(_jumps(part, here_mm) & smooth, at, sample_mm)
    return tuple(out)


def findings(patches: tuple[Replaced, ...], found: Found, recipe: Recipe) -> list[Finding]:
    """Judge each patch by the ridge of what the fibres show there and what it can hide besides, as a hole is judged."""
    out, limit_mm = [], recipe.verdict.max_ridge_mm
    for patch in patches:
        most_mm = most_ridge_mm(patch.box_mm, patch.thickness_mm, found, recipe)
        if most_mm > limit_mm:
            x, y = patch.centre_mm
            reason = (
                f"some {in_cm2(patch.area_mm2)} at ({x:.0f}, {y:.0f}) mm lie inside a closed line along which the "
                f"heights jump, as no ply does: a ridge of {most_mm:.2f} mm could have been replaced there by the "
                "scanner's software. Switch its removal of outliers off, or give the raw cloud"
            )
            out.append(Finding("filled", Verdict.UNDECIDED, reason, most_mm, limit_mm, "mm", patch.centre_mm))
    return out


def _jumps(height: Heights, least_mm: float) -> Marks:
    """Return the mask of the samples beside which heights jump along rows or columns; a bend is no jump.

    At a jump, two neighbouring second differences are large and of opposite signs; where a surface bends, however
    sharply, they have one sign. Flying pixels, which stand by themselves, are left out.
    """
    out, highs, lows = np.zeros(height.shape, dtype=np.uint8), [], []
    for kernel, turn in ((_BEND, False), (_BEND.T, True)):
        bends = cv2.filter2D(height, -1, kernel, borderType=cv2.BORDER_REPLICATE)
        high, low = (bends < -least_mm).view(np.uint8), (bends > least_mm).view(np.uint8)
        highs.append(high)
        lows.append(low)
        into, above, below = (np.swapaxes(one, 0, 1) if turn else one for one in (out, high, low))
        jump = (above[:, 1:] & below[:, :-1]) | (below[:, 1:] & above[:, :-1])
        into[:, 1:] |= jump
        into[:, :-1] |= jump
    _take_flying(out, height, (highs[0] & highs[1]) | (lows[0] & lows[1]), LIMITS.flies * least_mm)
    return out


def _sharp(mold: Heights, least_mm: float) -> Bools:
    """Return the mask of the samples beside which the mold bends by more than this."""
    bends = [cv2.filter2D(mold, -1, kernel, borderType=cv2.BORDER_REPLICATE) for kernel in (_WIDE, _WIDE.T)]
    return grown(np.abs(bends[0]) + np.abs(bends[1]) > least_mm, LIMITS.mold_samples)


def _take_flying(jumps: Marks, height: Heights, tops: Marks, least_mm: float) -> None:
    """Unmark the crosses of flying pixels: of those `tops` that stand off all of their neighbours, on one side."""
    inner = np.zeros_like(tops)
    inner[1:-1, 1:-1] = tops[1:-1, 1:-1]
    at = cv2.findNonZero(inner)
    if at is None:
        return
    column, row = at.reshape(-1, 2).T
    around = np.stack([height[row + down, column + right] for down, right in _AROUND])
    here = height[row, column]
    flies = (here > np.fmax.reduce(around) + least_mm) | (here < np.fmin.reduce(around) - least_mm)
    for down, right in _CROSS:
        jumps[row[flies] + down, column[flies] + right] = 0


def _noise_mm(height: Heights) -> float:
    """Return the standard deviation of the noise that samples have each for themselves."""
    sizes = np.abs(height[:, 2:] - 2 * height[:, 1:-1] + height[:, :-2])
    sizes = sizes[np.isfinite(sizes)]
    return _TO_SIGMA * float(np.median(sizes)) if sizes.size else 0.0


def _bent_mm(sample_mm: float, wide_mm: float) -> float:
    """Return what looks like a jump of the steepest bell of a width, between samples where its slope is steepest."""
    per_sample = 2 * math.pi * min(sample_mm / wide_mm, 0.5)
    return steepest_bell_mm(wide_mm) * (1 - math.cos(per_sample)) * math.sin(per_sample / 2)


def _windows(jumps: Marks) -> Iterator[tuple[slice, slice]]:
    """Yield the parts of an image in which lines of jumps may go round something, with their surroundings."""
    side = np.ones((_CELL, _CELL), np.uint8)
    cells = pieces_of(cv2.dilate(jumps, side, anchor=(0, 0))[::_CELL, ::_CELL].view(np.bool_), 8)
    for number in cells.of_size(_LEAST_CELLS):
        top, bottom, left, right = cells.boxes[number].tolist()
        if min(bottom - top, right - left) >= _LEAST_ACROSS:
            beside = LIMITS.beside_samples
            rows, columns = (
                slice(max(0, _CELL * first - beside), _CELL * last + beside)
                for first, last in ((top, bottom), (left, right))
            )
            yield rows, columns


def _surrounded(jumps: Marks, xy_mm: Heights, sample_mm: float) -> list[Replaced]:
    """Return the patches round which samples jump: the hulls of lines of such samples that go round them."""
    square, out = np.ones((LIMITS.gap_samples,) * 2, np.uint8), []
    pieces = pieces_of(cv2.morphologyEx(jumps, cv2.MORPH_CLOSE, square).view(np.bool_), 8)
    numbers = np.array(pieces.of_size(LIMITS.least_samples), dtype=np.int64)
    across_mm = sample_mm * np.diff(pieces.boxes[numbers])[:, ::2].min(axis=1)
    for number in numbers[(across_mm >= LIMITS.least_mm) & (across_mm < 2 * LIMITS.widest_mm)]:
        window = pieces.window(int(number), LIMITS.beside_samples)
        own = (pieces.labels[window] == number) & jumps[window].view(np.bool_)
        hull = _hull(own)
        within = cv2.distanceTransform(hull, cv2.DIST_L2, 5)
        wide_mm = 2 * float(within.max()) * sample_mm
        inner, beyond = within > LIMITS.rim_samples + 1, cv2.distanceTransform(1 - hull, cv2.DIST_L2, 5)
        beside = (beyond > LIMITS.rim_samples) & (beyond <= LIMITS.beside_samples)
        alone = all(_share(jumps[window], where) <= LIMITS.other_share for where in (inner, beside))
        if not alone or not LIMITS.least_mm < wide_mm < LIMITS.widest_mm or not _goes_round(own, inner):
            continue
        places = xy_mm[window][within > 0].astype(np.float64)
        places = places[np.isfinite(places).all(axis=1)]
        if len(places):
            x, y = places.mean(axis=0).tolist()
            box_mm = np.stack([places.min(axis=0), places.max(axis=0)])
            out.append(Replaced((x, y), np.count_nonzero(within > 0) * sample_mm**2, wide_mm, box_mm))
    return out


def _hull(own: Bools) -> Marks:
    """Return the mask of the convex hull of marked samples."""
    rows, columns = np.nonzero(own)
    hull = cv2.convexHull(np.stack([columns, rows], axis=1).astype(np.int32))
    mask = np.zeros(own.shape, dtype=np.uint8)
    cv2.fillConvexPoly(mask, hull, 1)
    return mask


def _share(marks: Marks, where: Bools) -> float:
    """Return the share of samples that are marked; 1 if there are none."""
    return float(np.mean(marks[where])) if where.any() else 1.0


def _goes_round(own: Bools, inner: Bools) -> bool:
    """Return whether marked samples surround the inner part of their hull."""
    middle = np.argwhere(inner).mean(axis=0)
    y, x = (np.argwhere(own & ~inner) - middle).T
    bins = np.floor(LIMITS.directions * (np.arctan2(y, x) / (2 * math.pi) + 0.5)).astype(int) % LIMITS.directions
    return len(np.unique(bins)) >= LIMITS.round_share * LIMITS.directions
