"""Wrinkles that stand already: narrow, long, and taken for noise by the filters, which see one point at a time.

A fold of 2 mm is one to four pixels wide. The outlier filter, the spike filter and the median take such points away, as
they take flying pixels. What parts the two is that a wrinkle goes on from one row of pixels to the next. So the scan
is looked at before any filter, along pairs of adjacent rows and columns of pixels some millimetres apart: points that
stand out narrowly from both sides, in both lines of a pair, are linked from pair to pair where they lie on a straight
way and are about equally high, and such a chain is a wrinkle only where the pixels between its pairs stand up as well.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk import pocket
from debulk.grid import Grid
from debulk.inspection.sample import heights_above
from debulk.recipe import Recipe
from debulk.results.report import Wrinkle
from debulk.ridge import ridge_height
from debulk.surface import Reference
from debulk.verdict import Judgement, Verdict

__all__ = ["WrinkleSearch", "doubts"]

Cloud = NDArray[np.float32]
Floats = NDArray[np.float64]

_PAIRS_MM = 14.0  # between pairs of lines
_SIDE_MM = 10.0  # from a point to those on both sides that it must stand out from
_STANDS_OUT_MM = 1.0
_HIGHEST_MM = 25.0  # what stands out by more is the edge of something else
_WIDEST_MM = 8.0  # at half its height; what is wider survives the filters
_LINKS = 4  # of pairs of lines that a wrinkle crosses at least: about 40 mm
_AHEAD = (1, 2, 3)  # pairs of lines from one crossing to the next: drop-outs on steep flanks hide some
_STEEPEST = 2.0  # of a way through the image that these lines follow; the lines across follow the others
_CONTRAST = 0.6  # share of the height above the reference by which it stands out from both sides
_SOLID_SHARE = 0.7  # of the lines between the pairs in which something stands up on the way
_SUNK_SHARE = 0.2  # of them in which something lies below the reference, at most
_MOST = 20_000  # points that stand out: more of them are no wrinkles but a spoiled scan
_SAME_MM = 15.0  # two chains so near to one another are one wrinkle


@dataclass(frozen=True)
class _Crossing:
    """A point of a pair of lines that stands out: line and place along it in pixels, height over its sides, mm."""

    line: int
    at: int
    height_mm: float


class WrinkleSearch:
    """Looks for wrinkles in scan after scan.

    Parameters
    ----------
    reference, seen
        The smooth surface, and the heights that it was fitted to: nothing is known where they are NaN.
    mold_from_scanner
        (4, 4) or None.
    ply_outline
        (M, 2) or None.
    recipe
        The sections material and verdict.
    """

    def __init__(
        self,
        reference: Reference,
        seen: Grid,
        mold_from_scanner: Floats | None,
        ply_outline: Floats | None,
        recipe: Recipe,
    ) -> None:
        self._reference, self._seen, self._outline, self._recipe = reference, seen, ply_outline, recipe
        self._pose = np.eye(4) if mold_from_scanner is None else mold_from_scanner

    def find(self, scan: Cloud, mask: NDArray[np.bool_] | None) -> tuple[Wrinkle, ...]:
        """Return the wrinkles of an organised scan, longest first; of any other cloud none are known.

        Parameters
        ----------
        scan
            (H, W, 3), scanner frame, mm, NaN = nothing seen.
        mask
            (H, W), True where the image is not to be used, or None.
        """
        if scan.ndim != 3 or min(scan.shape[:2]) < 8:
            return ()
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite stands nowhere
            return self._longest_first(scan, mask)

    def _longest_first(self, scan: Cloud, mask: NDArray[np.bool_] | None) -> tuple[Wrinkle, ...]:
        pitch_mm = self._pitch_mm(scan)
        if not 0 < pitch_mm <= _WIDEST_MM / 2:
            return ()
        found: list[tuple[Wrinkle, Floats]] = []
        for turned in (False, True):
            image = scan.swapaxes(0, 1) if turned else scan
            hidden = mask.T if turned and mask is not None else mask
            found += self._along(image, hidden, pitch_mm)
        found.sort(key=lambda one: (-one[0].length_mm, one[0].start_mm))
        kept: list[tuple[Wrinkle, Floats]] = []
        for one in found:
            if all(_apart_mm(one[1], other[1]) > _SAME_MM for other in kept):
                kept.append(one)
        return tuple(one[0] for one in kept)

    def _pitch_mm(self, scan: Cloud) -> float:
        rows, columns = scan.shape[0] // 2, scan.shape[1] // 2
        middle = scan[rows - rows // 4 : rows + rows // 4 : max(1, rows // 32), columns // 2 : columns + columns // 2]
        steps = np.linalg.norm(np.diff(middle, axis=1), axis=2)
        steps = steps[np.isfinite(steps)]
        return float(np.median(steps)) if steps.size else math.nan

    def _along(
        self, image: Cloud, hidden: NDArray[np.bool_] | None, pitch_mm: float
    ) -> Iterator[tuple[Wrinkle, Floats]]:
        step = max(2, round(_PAIRS_MM / pitch_mm))
        side = max(2, round(_SIDE_MM / pitch_mm))
        if image.shape[1] < 2 * side + 3 or image.shape[0] < 2:
            return
        first = np.arange(0, image.shape[0] - 1, step)
        high, stands = self._standing_out(image, hidden, first, side)
        beside, beside_stands = self._standing_out(image, hidden, first + 1, side)
        high = np.fmax(high, beside)
        stands = (stands & _spread(beside_stands, 2)) | (beside_stands & _spread(stands, 2))
        crossings = _crossings(high, stands, side)
        if len(crossings) > _MOST:
            return
        for chain in _chains(crossings, step):
            wrinkle = self._wrinkle(image, hidden, chain, step, side, pitch_mm)
            if wrinkle is not None:
                yield wrinkle

    def _standing_out(
        self, image: Cloud, hidden: NDArray[np.bool_] | None, lines: NDArray[np.int64], side: int
    ) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """By how much the points but the `side` first and last stand above the middle of both sides; which stand out.

        Only depths are read, since the camera looks down on the ply: what stands up is nearer to it.
        """
        z = np.ascontiguousarray(image[lines, :, 2]) * np.float32(self._pose[2, 2])
        if hidden is not None:
            z[hidden[lines]] = np.nan
        left, right = z[:, : -2 * side], z[:, 2 * side :]
        out = z[:, side:-side] - np.where(np.isnan(left), right, np.where(np.isnan(right), left, 0.5 * (left + right)))
        return out, (out > _STANDS_OUT_MM) & (out < _HIGHEST_MM)

    def _wrinkle(
        self,
        image: Cloud,
        hidden: NDArray[np.bool_] | None,
        chain: Sequence[_Crossing],
        step: int,
        side: int,
        pitch_mm: float,
    ) -> tuple[Wrinkle, Floats] | None:
        lines, ats = self._tops(image, hidden, chain, step)
        profile = self._points(image, hidden, lines, ats[:, None] + np.arange(-side, side + 1))
        above = self._above(profile)
        middle, left, right = above[:, side], above[:, 0], above[:, -1]
        good = (middle - np.fmax(left, right) > _CONTRAST * middle) & (middle > _STANDS_OUT_MM)
        if np.count_nonzero(good) < _LINKS:
            return None
        height_mm = float(np.median(middle[good]))
        along = profile[good, side, :2]
        half = above[good] > 0.5 * middle[good][:, None]
        width_mm = float(np.median([_run_through(row, side) for row in half])) * pitch_mm
        across = np.linalg.norm(np.ptp(along, axis=0)) / max(1, np.ptp(lines[good]) * pitch_mm)
        width_mm /= max(1.0, float(across))  # lines cross it askew
        if width_mm > _WIDEST_MM or not self._solid(image, hidden, lines[good], ats[good], height_mm):
            return None
        if self._outline is not None and np.count_nonzero(pocket.inside(self._outline, along)) < _LINKS:
            return None
        length_mm = float(np.linalg.norm(np.diff(along, axis=0), axis=1).sum())
        half_mm = max(width_mm, pitch_mm)  # from its foot to its top, if its sides are straight
        excess_mm = 2 * (math.hypot(height_mm, half_mm) - half_mm)
        thickness_mm = self._recipe.material.thickness_mm
        span_mm = 2 * thickness_mm + excess_mm
        return Wrinkle(
            start_mm=(float(along[0, 0]), float(along[0, 1])),
            end_mm=(float(along[-1, 0]), float(along[-1, 1])),
            length_mm=length_mm,
            height_mm=height_mm,
            width_mm=width_mm,
            excess_length_mm=excess_mm,
            ridge_height_mm=min(height_mm, ridge_height(span_mm + excess_mm, span_mm, thickness_mm)),
        ), along

    def _tops(
        self, image: Cloud, hidden: NDArray[np.bool_] | None, chain: Sequence[_Crossing], step: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Lines and places of the highest points at the crossings, in either line of the pair."""
        lines = np.array([[c.line * step] * 5 + [c.line * step + 1] * 5 for c in chain])
        ats = np.array([[c.at + k for k in range(-2, 3)] * 2 for c in chain])
        points = self._points(image, hidden, lines.ravel(), ats.reshape(-1, 1))
        above = self._above(points).reshape(lines.shape)
        top = np.argmax(np.nan_to_num(above, nan=-np.inf), axis=1)[:, None]
        return np.take_along_axis(lines, top, 1)[:, 0], np.take_along_axis(ats, top, 1)[:, 0]

    def _points(
        self, image: Cloud, hidden: NDArray[np.bool_] | None, lines: NDArray[np.int64], ats: NDArray[np.int64]
    ) -> Floats:
        ats = np.clip(ats, 0, image.shape[1] - 1)
        points = image[lines[:, None], ats].astype(np.float64) @ self._pose[:3, :3].T + self._pose[:3, 3]
        if hidden is not None:
            points[hidden[lines[:, None], ats]] = np.nan
        return points

    def _above(self, points: Floats) -> Floats:
        """Heights above the reference; NaN where it is not known."""
        return heights_above(self._reference, self._seen, points.reshape(-1, 3)).reshape(points.shape[:-1])

    def _solid(
        self,
        image: Cloud,
        hidden: NDArray[np.bool_] | None,
        lines: NDArray[np.int64],
        ats: NDArray[np.int64],
        height_mm: float,
    ) -> bool:
        """Whether something stands up on the way in most of the lines between the first and the last crossing.

        In a highlight depths are wild: as many points lie below the reference as above. Pixels as wide as the wrinkle
        meet its flanks in some lines.
        """
        least_mm = max(0.25 * height_mm, min(0.5 * height_mm, _STANDS_OUT_MM))
        between = np.arange(lines[0], lines[-1] + 1)
        way = np.rint(np.interp(between, lines, ats)).astype(np.int64)
        above = self._above(self._points(image, hidden, between, way[:, None] + np.arange(-3, 4)))
        with np.errstate(invalid="ignore"):
            stands, sunk = (above > least_mm).any(axis=1), (above < -0.25 * height_mm).any(axis=1)
        return float(np.mean(stands)) >= _SOLID_SHARE and float(np.mean(sunk)) <= _SUNK_SHARE


def doubts(wrinkles: Sequence[Wrinkle], recipe: Recipe) -> list[Judgement]:
    """Judge wrinkles that stand already: none closes, and one above the limit of a ridge decides."""
    limit = recipe.verdict.max_ridge_mm
    return [
        Judgement(
            Verdict.CREASE if w.ridge_height_mm > limit else Verdict.UNDECIDED,
            f"a wrinkle stands already: {w.height_mm:.1f} mm high, {w.width_mm:.1f} mm wide and {w.length_mm:.0f} mm "
            f"long, from ({w.start_mm[0]:.0f}, {w.start_mm[1]:.0f}) to ({w.end_mm[0]:.0f}, {w.end_mm[1]:.0f}) mm",
        )
        for w in wrinkles
    ]


def _spread(mask: NDArray[np.bool_], by: int) -> NDArray[np.bool_]:
    out = mask.copy()
    for shift in range(1, by + 1):
        out[:, shift:] |= mask[:, :-shift]
        out[:, :-shift] |= mask[:, shift:]
    return out


def _crossings(high: NDArray[np.float32], stands: NDArray[np.bool_], side: int) -> list[_Crossing]:
    """Take the highest point of each run of points that stand out."""
    edges = np.diff(np.pad(stands, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    begins, ends = np.argwhere(edges == 1), np.argwhere(edges == -1)
    if len(begins) > _MOST:
        return [_Crossing(0, 0, 0.0)] * (_MOST + 1)
    out = []
    for (line, begin), (_, end) in zip(begins.tolist(), ends.tolist(), strict=True):
        top = begin + int(np.argmax(high[line, begin:end]))
        out.append(_Crossing(line, top + side, float(high[line, top])))
    return out


def _chains(crossings: Sequence[_Crossing], step: int) -> Iterator[list[_Crossing]]:
    """Link crossings of successive pairs of lines on straight ways; each belongs to the longest chain at most."""
    by_line: dict[int, list[_Crossing]] = {}
    for c in crossings:
        by_line.setdefault(c.line, []).append(c)
    used: set[tuple[int, int]] = set()
    for c in sorted(crossings, key=lambda c: (c.line, c.at)):
        if (c.line, c.at) in used:
            continue
        best: list[_Crossing] = []
        for second in (one for ahead in _AHEAD for one in by_line.get(c.line + ahead, ())):
            if abs(second.at - c.at) > _STEEPEST * step * (second.line - c.line) or not _alike(c, second):
                continue
            chain = [c, second]
            while (following := _next(chain, by_line, step)) is not None:
                chain.append(following)
            best = max(best, chain, key=len)
        if len(best) >= _LINKS:
            used |= {(one.line, one.at) for one in best}
            yield best


def _next(chain: Sequence[_Crossing], by_line: dict[int, list[_Crossing]], step: int) -> _Crossing | None:
    """Return the crossing nearest to where the chain points, if near enough and about as high; a pair may lack."""
    last, before = chain[-1], chain[-2]
    slope = (last.at - before.at) / (last.line - before.line)
    for ahead in _AHEAD:
        expected = last.at + ahead * slope
        near = [
            c for c in by_line.get(last.line + ahead, ()) if abs(c.at - expected) <= 3 + 0.3 * step and _alike(c, last)
        ]
        if near:
            return min(near, key=lambda c: (abs(c.at - expected), c.at))
    return None


def _alike(a: _Crossing, b: _Crossing) -> bool:
    return max(a.height_mm, b.height_mm) <= 3 * min(a.height_mm, b.height_mm)


def _run_through(row: NDArray[np.bool_], at: int) -> int:
    """Count the points of the run of True that goes through `at`."""
    begin, end = at, at
    while begin > 0 and row[begin - 1]:
        begin -= 1
    while end + 1 < len(row) and row[end + 1]:
        end += 1
    return end - begin + 1


def _apart_mm(a: Floats, b: Floats) -> float:
    """Smallest distance between the crossings of two wrinkles."""
    return float(np.linalg.norm(a[:, None] - b[None], axis=2).min())
