"""A check that the ply's edge in the scan lies on the outline: the ply just inside, the reference just outside.

Along the outline, stretch by stretch, the scan's heights are gathered in strips parallel to it. The edge is located
where a step from the ply's thickness down to the reference fits them best.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk import pocket
from debulk.arrays import Floats
from debulk.grid import Grid


@dataclass(frozen=True)
class Limits:
    """Of the ply's edge along the outline; bench/trust/outlines.py has outlines that are not the ply's."""

    stretch_mm: float = 40.0  # length of a stretch along the outline, and of the strips' reach to each side of it
    strip_mm: float = 4.0  # width of a strip, and distance of the places along the outline
    least_cells: int = 5  # known cells that a strip of a stretch needs
    least_strips: int = 3  # that must be known on each side
    blur_mm: float = 6.0  # a step nearer to the outline than this counts as on it: a map's cells are up to 8 mm wide
    clear_share: float = 0.5  # of the step's squared height: a shift that reduces the misfit by less is no evidence
    far_mm: float = 20.0  # an edge that is off by so much hides a pocket or makes its edge free
    far_stretches: int = 3  # in a row; of 305 right layups one had a single one, and none had two


LIMITS = Limits()


@dataclass(frozen=True, eq=False)
class EdgeFit:
    """How the outline fits the scan."""

    judged: int
    """Number of the stretches that were judged: the scan shows ply and reference beside them, and no pocket."""
    off_share: float
    """Share of these in which the edge does not lie on the outline."""
    far_row: int
    """Largest number of consecutive ones in which the edge lies 20 mm or more away, as where the outline cuts off a
    side of the ply."""
    off_mm: float
    at_mm: Floats
    """`off_mm`, `at_mm`: distance of the edge from the outline, positive outside it, and (2,) the place, both in the
    middle of the longest row of stretches in which the edge does not lie on the outline; NaN if there is no such
    stretch."""


class Outline:
    """The outline with its strips, prepared once and used for scan after scan.

    `bare_mm` gives the heights (N,) of the bare mold above the datum at (N, 2) places; None: 0 everywhere.

    `places_mm` and `normals` are (N, 2) points along it, `step_mm` apart, and the outward unit normals there;
    `offsets_mm` (K,) are the distances of the strips' middles from it, positive outside it.
    """

    def __init__(self, corners_mm: Floats, bare_mm: Callable[[Floats], Floats] | None = None) -> None:
        ends = np.roll(corners_mm, -1, axis=0)
        lengths = np.linalg.norm(ends - corners_mm, axis=1)
        along_mm = np.concatenate([[0.0], np.cumsum(lengths)])
        count = max(3, round(along_mm[-1] / LIMITS.stretch_mm))
        steps = max(2, round(along_mm[-1] / count / LIMITS.strip_mm))
        at = (np.arange(count * steps) + 0.5) / (count * steps) * along_mm[-1]
        side = np.clip(np.searchsorted(along_mm, at, side="right") - 1, 0, len(corners_mm) - 1)
        share = ((at - along_mm[side]) / lengths[side])[:, None]
        points = corners_mm[side] + share * (ends - corners_mm)[side]
        # Normals are taken over some 16 mm: the short sides of a noisy outline have no useful normals of their own.
        reach = max(1, round(0.25 * LIMITS.stretch_mm / LIMITS.strip_mm))
        along = np.roll(points, -reach, axis=0) - np.roll(points, reach, axis=0)
        normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
        if _signed_area(corners_mm) < 0:
            normal = -normal
        self.offsets_mm = np.arange(-LIMITS.stretch_mm + 0.5 * LIMITS.strip_mm, LIMITS.stretch_mm, LIMITS.strip_mm)
        xy = points[:, None, :] + self.offsets_mm[None, :, None] * normal[:, None, :]
        # At corners a strip's points may lie on the other side of another stretch; these are not used.
        inside = pocket.inside(corners_mm, xy.reshape(-1, 2)).reshape(xy.shape[:2])
        near = pocket.distance_to_outline(corners_mm, xy.reshape(-1, 2)).reshape(xy.shape[:2])
        own = (inside == (self.offsets_mm < 0)) & (near > 0.7 * np.abs(self.offsets_mm))
        self._xy, self._own = xy, own
        self.places_mm, self.normals = points, normal
        self.step_mm = float(along_mm[-1]) / (count * steps)
        self._stretches = (count, steps)
        bare = np.zeros(own.shape) if bare_mm is None else bare_mm(xy.reshape(-1, 2)).reshape(own.shape)
        self._bare = bare.reshape(count, steps, -1).mean(axis=1)
        self._middles = points.reshape(count, steps, 2).mean(axis=1)

    def strips(self, heights: Grid) -> Floats:
        """Return the (N, K) heights at the places and offsets, from a height map; NaN: nothing known."""
        return np.where(self._own, heights.at(self._xy), np.nan)

    def missed(self, missed_mm: Callable[[Floats], Floats], off_mm: float) -> Floats:
        """Return by how much the reference stands above its surface at the places and offsets, (N, K); 0: not known.

        `missed_mm` is `Prepared.missed_mm`. Within 8 mm of places where the surface is off by more than `off_mm`, the
        result is NaN: a blurred scan stands up there, too.
        """
        out = np.where(self._own, np.nan_to_num(missed_mm(self._xy.reshape(-1, 2)).reshape(self._own.shape)), 0.0)
        edges = cv2.dilate((np.abs(out) > off_mm).astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
        return np.where(edges, np.nan, out)

    def fit(self, values: Floats, thickness_mm: float, cut_height_mm: float) -> EdgeFit:
        """Find the ply's edge in the strips' heights, disregarding pockets, which rise above the cut."""
        count, steps = self._stretches
        middle = _medians(values.reshape(count, steps, -1).transpose(0, 2, 1))
        # A pocket at the edge hides the edge, and so does an object beside the mold that lies far below it.
        middle[np.abs(middle) > max(cut_height_mm, 2 * thickness_mm)] = np.nan
        off = _edges(middle, self.offsets_mm, thickness_mm, self._bare)
        judged = np.isfinite(off)
        wrong = judged & (np.abs(off) > LIMITS.blur_mm)
        number = int(judged.sum())
        if not wrong.any():
            return EdgeFit(number, 0.0, 0, np.nan, np.full(2, np.nan))
        _, far_row = _longest(np.abs(off[judged]) >= LIMITS.far_mm)
        worst, _ = _longest(wrong)
        return EdgeFit(number, float(wrong.sum()) / number, far_row, float(off[worst]), self._middles[worst])


def _medians(strips: Floats) -> Floats:
    """Return the (S, K) medians of the known ones among (S, K, N) values; NaN where too few are known."""
    ranked, known = np.sort(strips, axis=2), np.isfinite(strips).sum(axis=2)  # NaN last
    at = np.stack([np.maximum(known - 1, 0) // 2, np.minimum(known // 2, strips.shape[2] - 1)], axis=2)
    return np.where(known >= LIMITS.least_cells, np.take_along_axis(ranked, at, axis=2).mean(axis=2), np.nan)


def _edges(middle: Floats, offsets: Floats, thickness: float, bare: Floats) -> Floats:
    """Return the distance from the outline of the best step from thickness to bare in each (S, K) row; NaN: unknown."""
    known = np.isfinite(middle)
    inside, outside = (known[:, side].sum(axis=1) for side in (offsets < 0, offsets > 0))
    enough = np.minimum(inside, outside) >= LIMITS.least_strips
    off = np.full(len(middle), np.nan)
    rows, known = np.arange(np.count_nonzero(enough)), known[enough]
    values = np.where(known, middle[enough], 0.0)
    bare = bare[enough]
    most = np.where(known, (thickness - bare) ** 2, 0.0)  # 0 because an unknown value fits anything
    ply, mold = np.minimum((values - thickness) ** 2, most), np.minimum((values - bare) ** 2, most)
    # The misfit of ply up to the k-th strip and none beyond it.
    misfit = np.pad(np.cumsum(ply, axis=1), ((0, 0), (1, 0)))
    misfit += np.pad(np.cumsum(mold[:, ::-1], axis=1)[:, ::-1], ((0, 0), (0, 1)))
    here, best = int(np.searchsorted(offsets, 0.0)), np.argmin(misfit, axis=1)
    # The edge lies midway between the last known strip on the ply and the first known one off it. If only one of the
    # two exists, it lies there.
    number = np.arange(len(offsets))
    before = np.pad(np.maximum.accumulate(np.where(known, number, -1), axis=1), ((0, 0), (1, 0)), constant_values=-1)
    last = len(offsets)
    after = np.minimum.accumulate(np.where(known, number, last)[:, ::-1], axis=1)[:, ::-1]
    after = np.pad(after, ((0, 0), (0, 1)), constant_values=last)
    inner, outer = before[rows, best], after[rows, best]
    inner, outer = np.where(inner < 0, outer, inner), np.where(outer == last, inner, outer)
    edge = 0.5 * (offsets[inner] + offsets[outer])
    clear = misfit[rows, here] - misfit[rows, best] >= LIMITS.clear_share * thickness**2
    off[enough] = np.where(clear, edge, 0.0)
    return off


def _longest(marks: NDArray[np.bool_]) -> tuple[int, int]:
    """Return the middle and the length of the longest row of marks; a row may run on from the end to the start."""
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
