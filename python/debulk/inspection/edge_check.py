"""Whether the ply's edge in the scan lies where the outline has it: just inside, the ply; just outside, what is below.

Along the outline, stretch by stretch, the scan's heights are gathered in strips parallel to it, and the edge is put
where they fit a step from the ply's thickness down to the reference best.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk import pocket
from debulk.grid import Grid

__all__ = ["EdgeFit", "Outline"]

Floats = NDArray[np.float64]

_REACH_MM = 40.0  # to each side
_STRIP_MM = 4.0
_STRETCH_MM = 40.0
_STEP_MM = 4.0  # along the outline
_LEAST_CELLS = 5  # in a strip of a stretch
_NEEDED = 3  # strips that must be known on each side
_BLUR_MM = 6.0  # a step nearer to the outline than this is at it: the map's cells are up to 8 mm wide
_CLEAR = 0.5  # of the step's height: a misfit that a shift reduces by less is no evidence
_FAR_MM = 20.0  # off by so much, an edge hides or frees a pocket


@dataclass(frozen=True, eq=False)
class EdgeFit:
    """How the outline fits the scan.

    Attributes
    ----------
    judged
        Number of the stretches that were judged: the scan shows ply and reference beside them, and no pocket.
    off_share
        Share of them in which the edge lies elsewhere.
    far_row
        Most of them in a row in which it lies 20 mm or more away: a side of the ply that the outline cuts off.
    off_mm, at_mm
        In the middle of the longest row of such stretches: distance of the edge from the outline, positive outside it,
        and (2,) the place; NaN if there is none.
    """

    judged: int
    off_share: float
    far_row: int
    off_mm: float
    at_mm: Floats


class Outline:
    """The outline with its strips, prepared once.

    Parameters
    ----------
    corners_mm
        (M, 2), mold XY.

    Attributes
    ----------
    places_mm, normals
        (N, 2) points every 4 mm along it, and the unit normals there, outwards.
    """

    def __init__(self, corners_mm: Floats) -> None:
        ends = np.roll(corners_mm, -1, axis=0)
        lengths = np.linalg.norm(ends - corners_mm, axis=1)
        way = np.concatenate([[0.0], np.cumsum(lengths)])
        count = max(3, round(way[-1] / _STRETCH_MM))
        steps = max(2, round(way[-1] / count / _STEP_MM))
        at = (np.arange(count * steps) + 0.5) / (count * steps) * way[-1]
        side = np.clip(np.searchsorted(way, at, side="right") - 1, 0, len(corners_mm) - 1)
        share = ((at - way[side]) / lengths[side])[:, None]
        points = corners_mm[side] + share * (ends - corners_mm)[side]
        # Normals over a stretch's length: an outline of short sides with noise has none of its own.
        reach = max(1, round(0.25 * _STRETCH_MM / _STEP_MM))
        along = np.roll(points, -reach, axis=0) - np.roll(points, reach, axis=0)
        normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
        if _signed_area(corners_mm) < 0:
            normal = -normal
        self.offsets_mm = np.arange(-_REACH_MM + 0.5 * _STRIP_MM, _REACH_MM, _STRIP_MM)
        xy = points[:, None, :] + self.offsets_mm[None, :, None] * normal[:, None, :]
        # At corners a strip's points may lie on the other side of another stretch: these say nothing.
        inside = pocket.inside(corners_mm, xy.reshape(-1, 2)).reshape(xy.shape[:2])
        near = pocket.distance_to_outline(corners_mm, xy.reshape(-1, 2)).reshape(xy.shape[:2])
        own = (inside == (self.offsets_mm < 0)) & (near > 0.7 * np.abs(self.offsets_mm))
        self._xy, self._own = xy, own
        self.places_mm, self.normals = points, normal
        self._stretches = (count, steps)
        self._middles = points.reshape(count, steps, 2).mean(axis=1)

    def fit(self, heights: Grid, thickness_mm: float, cut_height_mm: float) -> EdgeFit:
        """Find the ply's edge in a height map, NaN where nothing is known; what stands above the cut is a pocket."""
        count, steps = self._stretches
        ij = np.rint((self._xy - heights.origin_mm) / heights.spacing_mm).astype(np.int64)
        ny, nx = heights.values.shape
        known = self._own & (ij >= 0).all(axis=2) & (ij < [nx, ny]).all(axis=2)
        values = np.full(known.shape, np.nan)
        values[known] = heights.values[ij[known][:, 1], ij[known][:, 0]]
        middle = _medians(values.reshape(count, steps, -1).transpose(0, 2, 1))
        # A pocket at the edge hides it, and so does what lies far below: another thing beside the mold.
        middle[np.abs(middle) > max(cut_height_mm, 2 * thickness_mm)] = np.nan
        off = _edges(middle, self.offsets_mm, thickness_mm)
        judged = np.isfinite(off)
        wrong = judged & (np.abs(off) > _BLUR_MM)
        number = int(judged.sum())
        if not wrong.any():
            return EdgeFit(number, 0.0, 0, np.nan, np.full(2, np.nan))
        _, far_row = _longest(np.abs(off[judged]) >= _FAR_MM)
        worst, _ = _longest(wrong)
        return EdgeFit(number, float(wrong.sum()) / number, far_row, float(off[worst]), self._middles[worst])


def _medians(strips: Floats) -> Floats:
    """(S, K) medians of what is known in (S, K, N) values; NaN where that is too few."""
    ranked, known = np.sort(strips, axis=2), np.isfinite(strips).sum(axis=2)  # NaN last
    at = np.stack([np.maximum(known - 1, 0) // 2, np.minimum(known // 2, strips.shape[2] - 1)], axis=2)
    return np.where(known >= _LEAST_CELLS, np.take_along_axis(ranked, at, axis=2).mean(axis=2), np.nan)


def _edges(middle: Floats, offsets: Floats, thickness: float) -> Floats:
    """Return where steps from the thickness to 0 fit (S, K) rows best, as distances from the outline; NaN: unknown."""
    known = np.isfinite(middle)
    enough = (known[:, offsets < 0].sum(axis=1) >= _NEEDED) & (known[:, offsets > 0].sum(axis=1) >= _NEEDED)
    off = np.full(len(middle), np.nan)
    rows, known = np.arange(np.count_nonzero(enough)), known[enough]
    values = np.where(known, middle[enough], 0.0)
    most = np.where(known, thickness**2, 0.0)  # 0: what is not known fits anything
    ply, bare = np.minimum((values - thickness) ** 2, most), np.minimum(values**2, most)
    # Ply up to the k-th strip, then none.
    misfit = np.pad(np.cumsum(ply, axis=1), ((0, 0), (1, 0)))
    misfit += np.pad(np.cumsum(bare[:, ::-1], axis=1)[:, ::-1], ((0, 0), (0, 1)))
    here, best = int(np.searchsorted(offsets, 0.0)), np.argmin(misfit, axis=1)
    # Between the last known strip of the ply and the first known one off it; at the only one that there is.
    number = np.arange(len(offsets))
    before = np.pad(np.maximum.accumulate(np.where(known, number, -1), axis=1), ((0, 0), (1, 0)), constant_values=-1)
    last = len(offsets)
    after = np.minimum.accumulate(np.where(known, number, last)[:, ::-1], axis=1)[:, ::-1]
    after = np.pad(after, ((0, 0), (0, 1)), constant_values=last)
    inner, outer = before[rows, best], after[rows, best]
    inner, outer = np.where(inner < 0, outer, inner), np.where(outer == last, inner, outer)
    edge = 0.5 * (offsets[inner] + offsets[outer])
    clear = misfit[rows, here] - misfit[rows, best] >= _CLEAR * thickness**2
    off[enough] = np.where(clear, edge, 0.0)
    return off


def _longest(marks: NDArray[np.bool_]) -> tuple[int, int]:
    """Middle of the longest row of marks, round the end, and its length."""
    if marks.all() or not marks.any():
        return 0, int(marks.sum())
    start = int(np.argmin(marks))
    turned = np.roll(marks, -start)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], turned, [False]]).astype(np.int8)))
    begins, ends = edges[::2], edges[1::2]
    k = int(np.argmax(ends - begins))
    return int((start + (begins[k] + ends[k] - 1) // 2) % len(marks)), int(ends[k] - begins[k])


def _signed_area(corners: Floats) -> float:
    x, y = corners.T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))
