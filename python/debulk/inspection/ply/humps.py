"""Humps of the reference that look like a pocket of the ply before, which was scanned before it was debulked.

Heights are measured from the reference, so that a pocket that it already holds is invisible: the ply on it lies flat.
A hump counts if all round it the surface is smooth, as a quadratic surface predicts it that is fitted to a ring, or one
that is straight in one direction with any profile across, as a spar's is; and if a fibre over it, together with what
the ply shows there, would make a ridge above the limit. Bosses of a mold look the same: a hump by itself is only named.
Where the ply stands off it, too, it may be one pocket of which the reference holds a part, and the layup is UNDECIDED.
One that it holds wholly is, bit for bit, a mold with a boss: only a mold's nominal shape, or the stack, could tell.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk import pocket
from debulk.arrays import Floats
from debulk.grid import Grid
from debulk.inspection.clouds.products import least_squares, paraboloid, product
from debulk.inspection.ply.excess import LEAST_ERROR_MM, ridge_of
from debulk.inspection.ply.fibre_runs import left_by_means
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.recipe import Recipe
from debulk.results.finding import Finding
from debulk.results.number import HIGHEST_MM
from debulk.results.report import LeftOut
from debulk.verdict import Verdict
from debulk.words import in_cm2, in_mm, xy_of

_CELLS = 12.0  # of the coarse map along a radius: with half as many, a bell 24 mm wide loses half of its excess
_RADII_MM = (25.0, 40.0, 65.0, 100.0)  # of the hump; the ring reaches to twice as far
_OUTER = 1.8  # radii: outer edge of the ring
_SEEN = 0.9  # of hump and ring
_SMOOTH = 0.15  # of the hump's height: the ring's root mean square off its quadratic surface, at most
_LEAST_MM = 0.5  # lower humps make no ridge that counts, unless they are narrower than the cells can show
_LEAST_MM2 = 60.0  # above half its height: what is smaller is a flaw of the scan
_MOST = 30  # places that are tried at each radius
_FOOT = 0.05  # of its height: where a hump begins
_EIGHT = ((1, 0), (5, 1), (5, 2), (3, 2), (1, 1), (2, 3), (2, 5), (1, 5))  # cells along x and y, every 11 degrees
_WAYS = tuple(way for right, down in _EIGHT for way in ((right, down), (-down, right)))
_TURNS = np.radians((6.0, 6.0, 6.0, 1.5))  # steps from a way to where the mold is straightest
_AROUND = (2.2, 3.5)  # of the radius of what is half as high: where the ply lies down again
_LEAST_CELLS = 10
_STANDS_MM = 0.03  # on 18 humps that the ply lay on it was at most 0.018 mm more than the ply's scatter
_Top = tuple[int, int, tuple[int, int] | None]  # row, column, and the way along which the mold is straight there


@dataclass(frozen=True)
class Hump:
    """A hump of the reference."""

    place_mm: tuple[float, float]
    """Mold XY of its top."""
    height_mm: float
    area_mm2: float
    """`height_mm`, `area_mm2`: above the surface that its surroundings predict, and the area of what stands above half
    of that."""
    excess_mm: float
    ridge_mm: float
    """`excess_mm`, `ridge_mm`: of the fibre over it that is longest, compared with that surface, and the ridge that
    this makes."""
    shown_mm: float = 0.0
    """Of `excess_mm`, what a scan shows on the hump."""
    gap_mm: float = 0.0
    """By how much the ply surely stands higher on the hump than round it; 0: by no more than it scatters."""

    def covers(self, place_mm: Floats) -> bool:
        """Return whether a place (2,) lies on the hump, or near it."""
        return bool(np.hypot(*(place_mm - self.place_mm)) <= max(_RADII_MM[0], np.sqrt(self.area_mm2)))


def humps_of(seen: Grid, ply: PlyOnMold) -> tuple[Hump, ...]:
    """Return the humps of a reference's heights under the ply, the highest ridge first.

    They are read along its fibres, or along x and y if those turn from place to place.
    """
    recipe = ply.recipe
    angles = (0.0, 90.0) if isinstance(ply.fibre_angles_deg, Grid) else tuple(map(float, ply.fibre_angles_deg))
    coarse, found = seen, list[Hump]()
    for radius in _RADII_MM:
        coarse = _coarse(coarse, radius / _CELLS)
        for row, column, way in _tops(coarse, radius, ply.outline):
            place = coarse.origin_mm + coarse.spacing_mm * np.array([column, row])
            if way is not None and any(one.covers(place) for one in found):
                continue
            hump = _hump(coarse, row, column, way, radius, angles, recipe)
            if hump is not None:
                found.append(hump)
    found.sort(key=lambda one: -one.ridge_mm)
    kept: list[Hump] = []
    for hump in found:
        if not any(one.covers(np.array(hump.place_mm)) for one in kept):
            kept.append(hump)
    return tuple(kept)


def named(
    humps: tuple[Hump, ...], largest: Grid | None, recipe: Recipe, heights: Grid | None = None
) -> tuple[Hump, ...]:
    """Return the humps whose ridge exceeds the limit together with the largest excess that a scan shows on them.

    By the heights above the reference it is seen whether the ply stands off them.
    """
    out = []
    for hump in humps:
        own_mm = 0.0
        if largest is not None:
            nearest_mm = largest.origin_mm + largest.spacing_mm * largest.cells(np.array(hump.place_mm))
            reach_mm = largest.spacing_mm * np.ceil(np.sqrt(hump.area_mm2) / largest.spacing_mm)
            shown = largest.values[largest.around(np.stack([nearest_mm, nearest_mm]), reach_mm)]
            own_mm = max(0.0, float(np.nan_to_num(shown).max(initial=0.0)))
        total_mm = hump.excess_mm + own_mm  # a scan's excess is measured from the reference with the hump in it
        ridge_mm = ridge_of(total_mm, recipe)
        if ridge_mm > recipe.verdict.max_ridge_mm:
            gap_mm = 0.0 if heights is None else _gap(hump, heights, recipe.material.thickness_mm)
            out.append(replace(hump, excess_mm=total_mm, ridge_mm=ridge_mm, shown_mm=own_mm, gap_mm=gap_mm))
    return tuple(out)


def _gap(hump: Hump, heights: Grid, thickness_mm: float) -> float:
    """Return by how much the ply stands higher on a hump than round it, beyond its scatter there.

    A pocket of which the reference holds all but a few hundredths leaves an excess that is lost in the noise of lines,
    but a gap in its shape over an area: one of 3 mm of which 98 % were held, 0.06 mm.
    """
    radius_mm, place = float(np.sqrt(hump.area_mm2 / np.pi)), np.array(hump.place_mm)
    part = heights.part(*heights.around(np.stack([place, place]), _AROUND[1] * radius_mm))
    x, y = np.meshgrid(part.x_mm - place[0], part.y_mm - place[1])
    far = np.hypot(x, y) / radius_mm
    on_ply = part.values > 0.5 * thickness_mm  # and not NaN
    top = part.values[on_ply & (far < 1)]
    ground = part.values[on_ply & (far > _AROUND[0]) & (far < _AROUND[1])]
    if min(len(top), len(ground)) < _LEAST_CELLS:
        return 0.0
    low, level = np.quantile(ground, (0.16, 0.5))  # a standard deviation apart; air beside the hump lifts neither much
    return max(0.0, float(np.median(top) - level - (level - low)))


_AIR_BELOW = "if that is a pocket of the ply before, give the scan that was taken after the ply before was debulked"
_SHAPED_SO = "; if it is a bead or boss of the mold, smooth the ply down onto it and scan again: it then only is named"


def findings(humps: tuple[Hump, ...], recipe: Recipe) -> list[Finding]:
    """Name each hump, with its ridge against the limit; UNDECIDED where the ply stands off it."""
    limit = recipe.verdict.max_ridge_mm
    out = []
    for hump in humps:
        air = hump.shown_mm > LEAST_ERROR_MM or hump.gap_mm > _STANDS_MM  # with less the ply lies on the hump
        stands = f", and the ply stands off it: together a ridge of {hump.ridge_mm:.2f} mm" if air else ""
        remedy = _AIR_BELOW + (_SHAPED_SO if air else "")
        reason = f"the reference has {_what(hump)}{stands}: {remedy}"
        at_best = Verdict.UNDECIDED if air else None
        place = hump.place_mm
        out.append(Finding("reference_humps", at_best, reason, hump.ridge_mm, limit, "mm", place, remedy=remedy))
    return out


def left_out(humps: tuple[Hump, ...]) -> tuple[LeftOut, ...]:
    """Say that what the reference already holds is not judged; the map shows the places."""
    return tuple(
        LeftOut(
            what=f"{_what(hump)} of the reference",
            why="heights are measured from the reference: air that was below the ply before when it was scanned is "
            "not seen",
            bound=f"a fibre over it is as long as for a ridge of {hump.ridge_mm:.2f} mm, unless the mold is so shaped",
            place_mm=hump.place_mm,
        )
        for hump in humps
    )


def _what(hump: Hump) -> str:
    return f"a hump of {in_cm2(hump.area_mm2)} at {in_mm(hump.place_mm)}, {hump.height_mm:.1f} mm high"


def _coarse(seen: Grid, cell_mm: float) -> Grid:
    """Return means over cells of about this size; NaN where less than half was seen."""
    step = max(1, round(cell_mm / float(seen.spacing_mm)))
    ny, nx = (n // step for n in seen.values.shape[:2])
    part = seen.values[: ny * step, : nx * step]
    known = np.isfinite(part)

    def summed(of: NDArray[Any], kind: type) -> NDArray[Any]:
        rows: NDArray[Any] = of[:, ::step].astype(kind)  # NumPy's sum over both axes at once takes longer
        for k in range(1, step):
            rows += of[:, k::step]
        return np.asarray(rows.reshape(ny, step, nx).sum(axis=1))

    count, total = summed(known, np.int64), summed(np.where(known, part, 0), np.float64)
    known = 2 * count >= step**2
    mean = np.where(known, total / np.maximum(count, 1), np.nan)
    level = float(np.median(mean[known])) if known.any() else 0.0
    # A median over three cells takes away what the outlier filter left, which is no wider than one.
    calm = cv2.medianBlur(np.where(known, mean - level, 0.0).astype(np.float32), 3).astype(np.float64) + level
    beside = cv2.erode(known.astype(np.uint8), np.ones((3, 3), np.uint8), borderValue=1) == 1
    values = np.where(beside, calm, mean)
    origin = np.asarray(seen.origin_mm) + 0.5 * (step - 1) * float(seen.spacing_mm)
    return Grid(values, origin, step * float(seen.spacing_mm))


def _tops(coarse: Grid, radius_mm: float, ply_outline: Floats | None) -> list[_Top]:
    """Return the places that stand highest above what the ring round them predicts, or lines through them."""
    cells = radius_mm / coarse.spacing_mm
    reach = int(np.ceil(_OUTER * cells))
    if min(coarse.values.shape) < 2 * reach + 1:
        return []
    v, u = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    ring = (np.hypot(u, v) > cells) & (np.hypot(u, v) <= _OUTER * cells)
    kernel = np.zeros(ring.shape)
    terms = paraboloid(u[ring] / cells, v[ring] / cells)
    kernel[ring] = product(terms, np.linalg.solve(product(terms.T, terms), np.eye(terms.shape[1])[0]))
    known = np.isfinite(coarse.values)
    level = float(np.median(coarse.values[known])) if known.any() else 0.0
    heights = np.where(known, coarse.values - level, 0.0)
    above = heights - cv2.filter2D(heights, -1, kernel, borderType=cv2.BORDER_CONSTANT)
    disc = (np.hypot(u, v) <= _OUTER * cells).astype(np.float64)
    share = cv2.filter2D(known.astype(np.float64), -1, disc / disc.sum(), borderType=cv2.BORDER_CONSTANT)
    able = known & (share >= _SEEN)
    along, ways = _above_lines(np.where(known, heights, np.nan).astype(np.float32), cells, reach)
    tops: list[_Top] = []
    for standing, of in ((above, None), (along, ways)):
        side = 2 * max(1, int(cells / 2)) + 1
        rows, columns = np.nonzero(
            (standing >= cv2.dilate(standing, np.ones((side, side)))) & able & (standing > _LEAST_MM)
        )
        if ply_outline is not None and len(rows):
            xy = coarse.origin_mm + coarse.spacing_mm * np.stack([columns, rows], axis=1)
            on = pocket.inside(ply_outline, xy)
            rows, columns = rows[on], columns[on]
        for k in np.argsort(-standing[rows, columns])[:_MOST]:
            way = None if of is None else _WAYS[of[rows[k], columns[k]]]
            tops.append((int(rows[k]), int(columns[k]), way))
    return tops


def _above_lines(
    heights: NDArray[np.float32], cells: float, reach: int
) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Return by how much each place stands above the calmest of the lines through it, and which of `_WAYS` that is.

    A line predicts a place by a parabola through what lies one to two radii off on both sides. It is calm if its
    neighbours predict their places: on a mold that is straight in one direction, as a spar is, such lines are calm.
    """
    ny, nx = heights.shape
    far = reach + max(max(way) for way in _EIGHT)  # rounding lengthens a line by half of a way
    padded = np.pad(heights, far, constant_values=np.nan)
    best, calmest = np.zeros((ny, nx), np.float32), np.full((ny, nx), np.inf, np.float32)
    ways = np.zeros((ny, nx), np.int64)
    for number, (right, down) in enumerate(_WAYS):
        long = np.hypot(right, down)
        steps = np.unique(np.linspace(np.ceil(cells / long), np.round(_OUTER * cells / long), 3).astype(int))
        weights = np.linalg.pinv(np.stack([np.ones(len(steps)), steps**2.0], axis=1))[0]
        above = heights.copy()
        for k, weight in zip(steps, weights, strict=True):
            for sign in (-k, k):
                i, j = far + sign * down, far + sign * right
                above -= np.float32(weight / 2) * padded[i : i + ny, j : j + nx]
        rows, columns = np.divmod(np.flatnonzero(above > _LEAST_MM), nx)  # no NaN is
        beside = []
        for k in cells * np.outer((-1, 1), np.linspace(1, _OUTER, 5)).ravel() / long:
            i, j = np.rint(rows + k * right).astype(int), np.rint(columns - k * down).astype(int)
            within = (i >= 0) & (i < ny) & (j >= 0) & (j < nx)
            beside.append(np.where(within, above[np.clip(i, 0, ny - 1), np.clip(j, 0, nx - 1)], np.nan))
        off = np.sqrt(np.mean(np.square(beside), axis=0))
        calm = (off <= _SMOOTH * above[rows, columns]) & (off < calmest[rows, columns])
        at = rows[calm], columns[calm]
        best[at], calmest[at], ways[at] = above[at], off[calm], number
    return best, ways


def _surface(part: Floats, ring: NDArray[np.bool_], u: Floats, v: Floats) -> Floats:
    """Return the quadratic surface through a ring."""
    factors = least_squares(paraboloid(u[ring], v[ring]), part[ring])
    return np.asarray(product(paraboloid(u.ravel(), v.ravel()), factors).reshape(part.shape))


def _profile(part: Floats, ring: NDArray[np.bool_], u: Floats, v: Floats) -> Floats:
    """Return the surface f(v) + (a + b u + c v) u through a ring, whose f is any profile across u."""
    count = np.maximum(ring.sum(axis=1), 1)

    def level(of: Floats) -> Floats:
        return np.asarray(np.where(ring, of, 0.0).sum(axis=1) / count)[:, None]

    terms = [u, u * u, u * v]
    apart = np.stack([(one - level(one))[ring] for one in terms], axis=1)
    factors = least_squares(apart, (part - level(part))[ring])
    bent = sum((factor * one for factor, one in zip(factors, terms, strict=True)), np.zeros_like(part))
    return np.asarray(bent + level(part - bent))


def _hump(
    coarse: Grid,
    row: int,
    column: int,
    way: tuple[int, int] | None,
    radius_mm: float,
    angles_deg: tuple[float, ...],
    recipe: Recipe,
) -> Hump | None:
    """Measure a hump; None if its surroundings are not smooth."""
    cells = radius_mm / coarse.spacing_mm
    reach = int(np.ceil(_OUTER * cells))
    v, u = np.mgrid[-reach : reach + 1, -reach : reach + 1] / cells
    far, around = np.hypot(u, v), int(np.ceil(np.sqrt(2) * reach)) + 1
    left, low = max(0, column - around), max(0, row - around)
    near = coarse.values[low : row + around + 1, left : column + around + 1]

    def turned(turn: float) -> tuple[Floats, Floats, float]:
        """Return what is below, the hump above it, and how far the ring is off, on a map turned by an angle."""
        c, s = cells * np.cos(turn), cells * np.sin(turn)
        part = _between(near, column - left + c * u - s * v, row - low + s * u + c * v)
        ring = np.isfinite(part) & (far > 1) & (far <= _OUTER)
        if np.count_nonzero(ring) < 30:
            return part, part, np.inf
        below = (_surface if way is None else _profile)(part, ring, u, v)
        return below, part - below, float(np.sqrt(np.mean((part - below)[ring] ** 2)))

    turn = 0.0
    if way is not None:  # where the mold is straightest: a parabola through the squares of how far the ring is off
        turn = float(np.arctan2(way[1], way[0]))
        for apart in _TURNS:
            less, here, more = (turned(turn + k * apart)[2] ** 2 for k in (-1, 0, 1))
            bend = less + more - 2 * here
            if bend > 0:
                turn += apart * float(np.clip(0.5 * (less - more) / bend, -1, 1))
    below, hump, off = turned(turn)
    height = float(np.nan_to_num(hump[reach, reach]))
    if not _LEAST_MM <= height < HIGHEST_MM or off > _SMOOTH * height:
        return None
    lifted = np.where(far <= 1.1, np.where(hump > _FOOT * height, hump, hump * 0), 0.0)
    excess = max(_excess(below, lifted, reach, angle - float(np.degrees(turn)), coarse) for angle in angles_deg)
    place = coarse.origin_mm + coarse.spacing_mm * np.array([column, row])
    area = float(np.count_nonzero(lifted > height / 2)) * coarse.spacing_mm**2
    if area < _LEAST_MM2:
        return None
    # A bump (1 - r²)² is 3.7 times as wide at its foot as the radius of the circle where it is half as high.
    kept = float(left_by_means(float(coarse.spacing_mm), np.array(3.7 * np.sqrt(area / np.pi))))
    excess = max(0.0, excess) / kept
    return Hump(xy_of(place), height, area, excess, ridge_of(excess, recipe))


def _excess(below: Floats, lifted: Floats, reach: int, angle_deg: float, coarse: Grid) -> float:
    """Return by how much the longest of the fibres across the hump is longer than the surface below, mm.

    On a flank that is not the one over the top.
    """
    c, s = np.cos(np.radians(angle_deg)), np.sin(np.radians(angle_deg))
    along, beside = np.arange(-reach - 0.5, reach + 1.0), np.arange(-(reach // 2), reach // 2 + 1.0)[:, None]
    x, y = reach + along * c - beside * s, reach + along * s + beside * c
    upper, lower = (_between(one, x, y) for one in (below + lifted, below))
    step = np.diff(along) * coarse.spacing_mm
    longer = np.hypot(np.diff(upper), step) - np.hypot(np.diff(lower), step)
    return float(np.nansum(longer, axis=1).max())


def _between(values: Floats, x: Floats, y: Floats) -> Floats:
    """Return the values between those of a map, at columns x and rows y; NaN where less than half is known."""
    known = np.isfinite(values)
    x, y = x.astype(np.float32), y.astype(np.float32)
    total, share = (
        cv2.remap(one, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
        for one in (np.where(known, values, 0.0), known.astype(np.float64))
    )
    return np.asarray(np.where(share >= 0.5, total / np.maximum(share, 0.5), np.nan))
