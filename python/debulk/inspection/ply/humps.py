"""Humps of the reference that look like a pocket of the ply before, which was scanned before it was debulked.

Heights are measured from the reference, so that a pocket that it already holds is invisible: the ply on it lies flat.
A hump counts if the surface is smooth all round it, nearly straight in one direction with any profile across, as domes
and spars are, and if a fibre over it, together with what the ply shows there, would make a ridge above the limit.
Bosses of a mold look the same: a hump by itself is only named.
Where the ply stands off it, too, it may be one pocket of which the reference holds a part, and the layup is UNDECIDED.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk import pocket
from debulk.arrays import Floats
from debulk.grid import Grid
from debulk.inspection.clouds.products import least_squares
from debulk.inspection.ply.excess import ridge_of
from debulk.inspection.ply.fibre_runs import left_by_means
from debulk.inspection.ply.ply_on_mold import HIGHEST_MM, PlyOnMold
from debulk.recipe import Recipe
from debulk.results.area import in_cm2
from debulk.results.finding import Finding
from debulk.results.report import LeftOut
from debulk.verdict import Verdict

_CELLS = 12.0  # of the coarse map along a radius: with half as many, a bell 24 mm wide loses half of its excess
_RADII_MM = (25.0, 40.0, 65.0, 100.0)  # of the hump; the ring reaches to twice as far
_OUTER = 1.8  # radii: outer edge of the ring
_SEEN = 0.75  # of the ring
_SMOOTH = 0.11  # of the hump's height: the ring's root mean square off the surface through it, at most
_LEAST_MM = 1.0  # lower humps make no ridge that counts, unless they are narrower than the cells can show
_FILLS = 0.17  # of the radius: that of a disc as large as what stands above half its height, at least
_AIR_MM = 0.04  # of excess, which is twice as long as its ridge is high: with less the ply lies on the hump
_MOST = 30  # places that are tried at each radius
_FOOT = 0.05  # of its height: where a hump begins
_TURNS = np.radians(np.arange(0, 180, 11.25))  # in which the mold is looked for to be straightest
_NEARER = np.radians((5.0, 2.0, 0.7))  # on both sides of the best of these, and of what is better still


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
        humps = (_hump(coarse, top, radius, angles, recipe) for top in _tops(coarse, radius, ply.outline))
        found += [hump for hump in humps if hump is not None]
    kept: list[Hump] = []
    for hump in sorted(found, key=lambda one: -one.ridge_mm):
        if not any(one.covers(np.array(hump.place_mm)) for one in kept):
            kept.append(hump)
    return tuple(kept)


def named(humps: tuple[Hump, ...], largest: Grid | None, recipe: Recipe) -> tuple[Hump, ...]:
    """Return the humps whose ridge exceeds the limit together with the largest excess that a scan shows on them."""
    out = []
    for hump in humps:
        own_mm = 0.0 if largest is None else _largest_near(largest, hump)
        total_mm = hump.excess_mm + own_mm  # a scan's excess is measured from the reference with the hump in it
        ridge_mm = ridge_of(total_mm, recipe)
        if ridge_mm > recipe.verdict.max_ridge_mm:
            out.append(replace(hump, excess_mm=total_mm, ridge_mm=ridge_mm, shown_mm=own_mm))
    return tuple(out)


def _largest_near(largest: Grid, hump: Hump) -> float:
    """Return the largest excess within the hump's extent."""
    reach = int(np.ceil(np.sqrt(hump.area_mm2) / largest.spacing_mm))
    column, row = largest.cells(np.array(hump.place_mm))
    part = largest.values[
        max(0, row - reach) : max(0, row + reach + 1), max(0, column - reach) : max(0, column + reach + 1)
    ]
    return max(0.0, float(np.nan_to_num(part).max(initial=0.0)))


def findings(humps: tuple[Hump, ...], recipe: Recipe) -> list[Finding]:
    """Name each hump, with its ridge against the limit; UNDECIDED where the ply stands off it."""
    limit = recipe.verdict.max_ridge_mm
    remedy = "give the scan that was taken after the ply before was debulked"
    out = []
    for hump in humps:
        air = hump.shown_mm > _AIR_MM
        stands = f", and the ply stands off it: together a ridge of {hump.ridge_mm:.2f} mm" if air else ""
        reason = f"the reference has {_what(hump)}{stands}: if that is a pocket of the ply before, {remedy}"
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
    x, y = hump.place_mm
    return f"a hump of {in_cm2(hump.area_mm2)} at ({x:.0f}, {y:.0f}) mm, {hump.height_mm:.1f} mm high"


def _coarse(seen: Grid, cell_mm: float) -> Grid:
    """Return means over cells of about this size; NaN where less than half was seen."""
    step = max(1, round(cell_mm / float(seen.spacing_mm)))
    ny, nx = (n // step for n in seen.values.shape[:2])
    part = seen.values[: ny * step, : nx * step]
    known = np.isfinite(part)
    share, total = (
        cv2.resize(one.astype(np.float64), (nx, ny), interpolation=cv2.INTER_AREA)
        for one in (known, np.where(known, part, 0.0))
    )
    known = share > 0.5 - 1e-9
    mean = np.where(known, total / np.maximum(share, 0.5), np.nan)
    level = float(np.median(mean[known])) if known.any() else 0.0
    # A median over three cells takes away what the outlier filter left, which is no wider than one.
    calm = cv2.medianBlur(np.where(known, mean - level, 0.0).astype(np.float32), 3).astype(np.float64) + level
    beside = cv2.erode(known.astype(np.uint8), np.ones((3, 3), np.uint8), borderValue=1) == 1
    values = np.where(beside, calm, mean)
    origin = np.asarray(seen.origin_mm) + 0.5 * (step - 1) * float(seen.spacing_mm)
    return Grid(values, origin, step * float(seen.spacing_mm))


def _tops(coarse: Grid, radius_mm: float, ply_outline: Floats | None) -> list[tuple[int, int]]:
    """Return the rows and columns that stand highest above what the quadratic surface through a ring predicts."""
    cells = radius_mm / coarse.spacing_mm
    reach = int(np.ceil(_OUTER * cells))
    if min(coarse.values.shape) < 2 * reach + 1:
        return []
    v, u = np.mgrid[-reach : reach + 1, -reach : reach + 1] / cells
    ring = (np.hypot(u, v) > 1) & (np.hypot(u, v) <= _OUTER)
    terms = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v])
    kernel = np.zeros(ring.shape)
    kernel[ring] = np.linalg.pinv(terms[:, ring].T)[0]
    known = np.isfinite(coarse.values)
    heights = np.where(known, coarse.values - float(np.nanmedian(coarse.values)), 0.0)
    above = heights - cv2.filter2D(heights, -1, kernel, borderType=cv2.BORDER_CONSTANT)
    side = 2 * max(1, int(cells / 2)) + 1
    rows, columns = np.nonzero((above >= cv2.dilate(above, np.ones((side, side)))) & known & (above > _LEAST_MM))
    if ply_outline is not None and len(rows):
        xy = coarse.origin_mm + coarse.spacing_mm * np.stack([columns, rows], axis=1)
        on = pocket.inside(ply_outline, xy)
        rows, columns = rows[on], columns[on]
    tops = np.argsort(-above[rows, columns])[:_MOST]
    return list(zip(rows[tops].tolist(), columns[tops].tolist(), strict=True))


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


def _off_mm(parts: Floats, ring: NDArray[np.bool_], u: Floats, v: Floats, least: float) -> Floats:
    """Return how far the rings of maps (N, n, n) are off their `_profile`s, by the sums of the powers of u alone.

    A ring with fewer cells than `least` is too far off for any hump.
    """
    powers = u[0] ** np.arange(5)[:, None]
    heights = np.where(ring, parts, 0.0)
    of_u = np.einsum("nvu,ku->knv", ring.astype(np.float64), powers)  # in each row
    of_z = np.einsum("nvu,ku->knv", heights, powers[:3])
    along, count = v[:, 0], np.maximum(of_u[0], 1)
    first = np.stack([of_u[1], of_u[2], along * of_u[1], of_z[0]])  # of the terms and the heights
    second = np.empty((4, 4, *count.shape))
    second[:3, :3] = [
        [of_u[2], of_u[3], along * of_u[2]],
        [of_u[3], of_u[4], along * of_u[3]],
        [along * of_u[2], along * of_u[3], along**2 * of_u[2]],
    ]
    second[3, :3] = second[:3, 3] = of_z[1], of_z[2], along * of_z[1]
    second[3, 3] = np.einsum("nvu,nvu->nv", heights, heights)
    normal = (second - first[:, None] * first / count).sum(axis=-1).transpose(2, 0, 1)
    seen = of_u[0].sum(axis=1)
    few = seen < least
    normal[few] = np.eye(4)
    factors = np.linalg.solve(normal[:, :3, :3], normal[:, :3, 3:])
    squares = normal[:, 3, 3] - np.einsum("nij,nij->n", factors, normal[:, :3, 3:])
    return np.where(few, HIGHEST_MM, np.sqrt(np.maximum(squares, 0.0) / np.maximum(seen, 1)))


def _hump(
    coarse: Grid, top: tuple[int, int], radius_mm: float, angles_deg: tuple[float, ...], recipe: Recipe
) -> Hump | None:
    """Measure a hump; None if its surroundings are not smooth."""
    (row, column), cells = top, radius_mm / coarse.spacing_mm
    reach = int(np.ceil(_OUTER * cells))
    v, u = np.mgrid[-reach : reach + 1, -reach : reach + 1] / cells
    far, around = np.hypot(u, v), int(np.ceil(np.sqrt(2) * reach)) + 1
    left, low = max(0, column - around), max(0, row - around)
    near = coarse.values[low : row + around + 1, left : column + around + 1]

    def turned(turns: Floats, every: int) -> tuple[Floats, NDArray[np.bool_], Floats]:
        """Return the maps turned by these angles, where their rings were seen, and how far these are off a profile."""
        some = slice(None, None, every), slice(None, None, every)  # of the cells
        c, s = (cells * of(turns)[:, None, None] for of in (np.cos, np.sin))
        x, y = column - left + c * u[some] - s * v[some], row - low + s * u[some] + c * v[some]
        parts = _between(near, x.reshape(-1, x.shape[2]), y.reshape(-1, x.shape[2])).reshape(x.shape)
        wanted = (far[some] > 1) & (far[some] <= _OUTER)
        ring = np.isfinite(parts) & wanted
        return parts, ring, _off_mm(parts, ring, u[some], v[some], _SEEN * np.count_nonzero(wanted))

    turn = _TURNS[np.argmin(turned(_TURNS, 2)[2])]
    for apart in _NEARER:  # where the mold is straightest: a parabola through the squares of how far the ring is off
        less, here, more = turned(turn + apart * np.array([-1, 0, 1]), 2)[2] ** 2
        bend = less + more - 2 * here
        if bend > 0:
            turn += apart * float(np.clip(0.5 * (less - more) / bend, -1, 1))
    part, ring, off = (of[0] for of in turned(np.array([turn]), 1))
    if off == HIGHEST_MM:
        return None
    below = _profile(part, ring, u, v)
    hump = part - below
    height = float(np.nan_to_num(hump[reach, reach]))
    if not _LEAST_MM <= height < HIGHEST_MM or off > _SMOOTH * height:
        return None
    lifted = np.where(far <= 1.1, np.where(hump > _FOOT * height, hump, hump * 0), 0.0)
    excess = max(_excess(below, lifted, reach, angle - float(np.degrees(turn)), coarse) for angle in angles_deg)
    x, y = coarse.origin_mm + coarse.spacing_mm * np.array([column, row])
    area = float(np.count_nonzero(lifted > height / 2)) * coarse.spacing_mm**2
    if area < np.pi * (_FILLS * radius_mm) ** 2:  # a flaw, a ripple of the mold, or a smaller radius suits it
        return None
    # A bump (1 - r²)² is 3.7 times as wide at its foot as the radius of the circle where it is half as high.
    kept = float(left_by_means(float(coarse.spacing_mm), np.array(3.7 * np.sqrt(area / np.pi))))
    excess = max(0.0, excess) / kept
    return Hump((float(x), float(y)), height, area, excess, ridge_of(excess, recipe))


def _excess(below: Floats, lifted: Floats, reach: int, angle_deg: float, coarse: Grid) -> float:
    """Return by how much a fibre over the top is longer than the surface below, mm."""
    s = np.arange(-reach - 0.5, reach + 1.0)
    x, y = reach + s * np.cos(np.radians(angle_deg)), reach + s * np.sin(np.radians(angle_deg))
    upper, lower = (_between(one, x[None], y[None])[0] for one in (below + lifted, below))
    seen = np.isfinite(upper) & np.isfinite(lower)
    step = np.diff(s[seen]) * coarse.spacing_mm
    longer, shorter = (np.hypot(np.diff(line[seen]), step).sum() for line in (upper, lower))
    return float(longer - shorter)


def _between(values: Floats, x: Floats, y: Floats) -> Floats:
    """Return the values between those of a map, at columns x and rows y; NaN where less than half is known."""
    known = np.isfinite(values)
    x, y = x.astype(np.float32), y.astype(np.float32)
    total, share = (
        cv2.remap(one, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
        for one in (np.where(known, values, 0.0), known.astype(np.float64))
    )
    return np.asarray(np.where(share >= 0.5, total / np.maximum(share, 0.5), np.nan))
