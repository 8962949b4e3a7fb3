"""How far a scan spreads the ply's edge, a step of one thickness, which shows how well the scan resolves anything.

Across the edge the heights, as shares u of the step, go from 1 to 0. The integral of u (1 - u) across the edge vanishes
for a sharp step, and is sigma / sqrt(pi) for a step smoothed by a Gaussian of sigma. No fit is needed: the position of
the edge in a window drops out, and so does noise, which contributes as much beside the edge as at it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Bools, Cloud, Floats
from debulk.inspection.clouds.enough import FEW, SEEN
from debulk.inspection.clouds.products import affine, product
from debulk.inspection.clouds.thinning import complete
from debulk.inspection.evidence import medians
from debulk.inspection.evidence.outline import Outline
from debulk.inspection.evidence.sample import sample_of
from debulk.inspection.ply.ply_on_mold import Setup


@dataclass(frozen=True)
class Limits:
    """Of the spread of the ply's edge; bench/trust/smoothing.py has what scans and filters show."""

    allowed: float = 0.9  # sigma over clean.fine_mm, or the pitch if larger: a box over three pixels has 0.8
    most_windows: int = 64  # evenly along the outline
    half_pixels: int = 12  # from a window's middle to its sides: its inner half shows the spread, the rest the noise
    miss_pixels: float = 2.0  # by which the pixel in a window's middle may miss the outline
    beside_pixels: float = 4.0  # from the edge: beyond it the levels are read
    least_points: int = 60  # in each part of a window, and for the first estimate
    step_thicknesses: tuple[float, float] = (0.5, 1.6)  # along z: steps of such a height are the edge of this ply alone
    off_steps: float = 0.7  # beyond the step's two levels a point is not used, and a lower level off the reference


LIMITS = Limits()
_NEWTON = 4  # steps from that estimate to the pixel that shows a place


class EdgeSpread:
    """Measures the spread of the ply's edge in scan after scan."""

    def __init__(self, setup: Setup, outline: Outline) -> None:
        count = len(outline.places_mm)
        some = np.linspace(0, count, min(LIMITS.most_windows, count), endpoint=False).astype(int)
        self._setup, self._places, self._normals = setup, outline.places_mm[some], outline.normals[some]

    def least_mm(self, scan: Cloud) -> float:
        """Return a lower bound, mm, of the sigma of a Gaussian that would spread the edge as much; NaN: not known.

        It is that of all windows, or the greater one of those whose edges run along the image's rows or its columns: a
        scanner that is shaken blurs one way only.
        """
        if min(scan.shape[:2]) <= 2 * LIMITS.half_pixels:
            return float("nan")
        pixels, kept = self._pixels_at(scan)
        if len(kept) < FEW:
            return float("nan")
        around = np.arange(-LIMITS.half_pixels, LIMITS.half_pixels + 1)
        at = pixels[:, 0, None, None] + around[:, None], pixels[:, 1, None, None] + around
        points = scan[at].reshape(len(pixels), -1, 3)
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):  # NaN stays NaN
            spreads, by_rows = self._spreads(points, self._places[kept], self._normals[kept])
        known = np.isfinite(spreads)
        if np.count_nonzero(known) < FEW:
            return float("nan")
        each = [spreads[known], *(spreads[known & one] for one in (by_rows, ~by_rows))]
        known_mm = (medians.with_error(one) for one in each if len(one) >= FEW)
        return max(middle_mm - error_mm for middle_mm, error_mm in known_mm)

    def _pixels_at(self, scan: Cloud) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return rows and columns (N, 2) of the pixels that show places on the outline, and those places' indices."""
        most = np.array(scan.shape[:2]) - 1
        rows, columns = np.meshgrid(*(np.linspace(0, m, FEW).astype(int) for m in most))
        image = np.stack([rows.ravel(), columns.ravel()], axis=1)
        mold = self._in_mold(scan[rows.ravel(), columns.ravel()])[:, :2]
        seen = np.isfinite(mold).all(axis=1)
        if np.count_nonzero(seen) < LIMITS.least_points:
            return np.empty((0, 2), dtype=np.int64), np.empty(0, dtype=np.int64)
        image_of = affine(mold[seen], image[seen])  # the steps below correct the rest
        at = product(np.column_stack([self._places, np.ones(len(self._places))]), image_of)
        for _ in range(_NEWTON):
            pixel = np.clip(np.rint(at), LIMITS.half_pixels, most - LIMITS.half_pixels).astype(np.int64)
            off = product(self._places - self._in_mold(scan[pixel[:, 0], pixel[:, 1]])[:, :2], image_of[:2])
            at = np.asarray(pixel + np.where(np.isfinite(off), off, 0.0), dtype=np.float64)
        kept = np.flatnonzero(np.hypot(*off.T) < LIMITS.miss_pixels)  # False where the distance is NaN
        return pixel[kept], kept

    def _in_mold(self, points: Cloud) -> Floats:
        plain, pose = points.astype(np.float64), self._setup.mold_from_scanner
        return plain if pose is None else product(plain, pose[:3, :3].T) + pose[:3, 3]

    def _spreads(self, points: Cloud, places: Floats, normals: Floats) -> tuple[Floats, Bools]:
        """Return the sigma, mm, of each of the windows, (N, M, 3), that are seen, and whether rows cross its edge.

        NaN: not the edge of this ply.
        """
        seen = complete(np.isfinite(points))
        whole = np.flatnonzero(np.mean(seen, axis=1) >= SEEN)
        if len(whole) < FEW:
            return np.empty(0), np.empty(0, dtype=bool)
        points, seen = points[whole], seen[whole]
        setup = self._setup
        sample = sample_of(points[seen], setup)
        height, at = np.full(seen.shape, np.nan), np.full((*seen.shape, 2), np.nan)
        height[seen], at[seen] = sample.height_mm, sample.points_mm[:, :2]
        size = np.fmax.reduce(at, axis=1) - np.fmin.reduce(at, axis=1)
        pitch = np.sqrt(np.prod(size, axis=1)) / (2 * LIMITS.half_pixels)
        away = at - places[whole][:, None]
        known = np.nan_to_num(away)
        outwards = np.einsum("nmk,nk->nm", away, normals[whole])
        around = np.arange(-LIMITS.half_pixels, LIMITS.half_pixels + 1.0)
        along_row, down_column = (
            np.abs(np.einsum("nmk,m,nk->n", known, index.ravel(), normals[whole]))
            for index in np.meshgrid(around, around)
        )
        thickness_mm = setup.recipe.material.thickness_mm
        return _sigmas(height / thickness_mm, outwards / pitch[:, None]) * pitch, along_row > down_column


def _sigmas(height: Floats, out: Floats) -> Floats:
    """Return the sigma in pixels of the edge in each of N windows of M points; NaN where it is not that of one ply.

    `height` (N, M) is in thicknesses above the reference, `out` (N, M) in pixels from the outline, positive outwards.
    """
    known = np.isfinite(height)
    ranked, ranked_out = _ranked(height, known), _ranked(out, known)
    high, low = _quantile(ranked, 0.9), _quantile(ranked, 0.1)
    for _ in range(2):  # the levels determine where the edge is, and the edge where the levels are read
        on_ply = height > 0.5 * (high + low)
        edge = _quantile(ranked_out, np.sum(on_ply, axis=1, keepdims=True) / np.maximum(_count(known), 1))
        inner, outer = known & (out - edge < -LIMITS.beside_pixels), known & (out - edge > LIMITS.beside_pixels)
        high, low = _quantile(_ranked(height, inner), 0.5), _quantile(_ranked(height, outer), 0.5)
    share = (height - low) / (high - low)
    near = np.abs(out - edge) < LIMITS.half_pixels / 2
    used = known & (np.abs(share - 0.5) < 0.5 + LIMITS.off_steps)
    varies = np.where(used, share * (1 - share), 0.0)
    at_edge, of_noise = (
        np.sum(varies * where, axis=1, keepdims=True) / np.maximum(_count(used & where), 1) for where in (near, ~near)
    )
    good = (
        (high - low > LIMITS.step_thicknesses[0])
        & (high - low < LIMITS.step_thicknesses[1])
        & (np.abs(low) < LIMITS.off_steps)
    )
    for where in (inner, outer, used & near, used & ~near):
        good = good & (_count(where) >= LIMITS.least_points)
    return np.ravel(np.where(good, np.sqrt(np.pi) * LIMITS.half_pixels * (at_edge - of_noise), np.nan))


def _count(marks: Bools) -> NDArray[np.int64]:
    return np.asarray(np.sum(marks, axis=1, keepdims=True))


def _ranked(values: Floats, which: Bools) -> tuple[Floats, NDArray[np.int64]]:
    """Return the marked ones among (N, M) values in order, row by row, with NaN last, and their number (N, 1)."""
    return np.sort(np.where(which, values, np.nan), axis=1), _count(which)


def _quantile(of: tuple[Floats, NDArray[np.int64]], share: float | Floats) -> Floats:
    """Return the (N, 1) quantiles of what `_ranked` returns, row by row; NaN if none is marked."""
    ranked, count = of
    place = np.clip(np.asarray(share * count, dtype=np.int64), 0, np.maximum(count - 1, 0))
    return np.asarray(np.take_along_axis(ranked, place, axis=1))
