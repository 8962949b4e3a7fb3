"""Humps of the reference that look like a pocket of the ply before, which was scanned before it was debulked.

Heights are measured from the reference, so that a pocket that it already holds is invisible: the ply on it lies flat.
A hump counts if all round it the surface is smooth, as a quadratic surface that is fitted to a ring predicts it, and
if a fibre over it, together with what the ply has there, would make a ridge above the limit. Bosses of a mold look the
same: a hump is only named.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import cv2
import numpy as np

from debulk import pocket
from debulk.arrays import Floats
from debulk.grid import Grid
from debulk.inspection.clouds.products import least_squares, product
from debulk.inspection.ply.excess import ridge_of
from debulk.inspection.ply.fibre_runs import left_by_means
from debulk.results.area import in_cm2
from debulk.results.finding import Finding
from debulk.results.report import LeftOut

if TYPE_CHECKING:
    from debulk.inspection.ply.ply_on_mold import PlyOnMold
    from debulk.recipe import Recipe

_CELLS = 12.0  # of the coarse map along a radius: with half as many, a bell 24 mm wide loses half of its excess
_RADII_MM = (25.0, 40.0, 65.0, 100.0)  # of the hump; the ring reaches to twice as far
_OUTER = 1.8  # radii: outer edge of the ring
_SEEN = 0.9  # of hump and ring
_SMOOTH = 0.15  # of the hump's height: the ring's root mean square off its quadratic surface, at most
_LEAST_MM = 1.0  # lower humps make no ridge that counts, unless they are narrower than the cells can show
_LEAST_MM2 = 60.0  # above half its height: what is smaller is a flaw of the scan
_MOST = 30  # places that are tried at each radius
_FOOT = 0.05  # of its height: where a hump begins


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


def humps_of(seen: Grid, ply: PlyOnMold) -> tuple[Hump, ...]:
    """Return the humps of a reference's heights under the ply, the highest ridge first.

    They are read along its fibres, or along x and y if those turn from place to place.
    """
    recipe = ply.recipe
    angles = (0.0, 90.0) if isinstance(ply.fibre_angles_deg, Grid) else tuple(map(float, ply.fibre_angles_deg))
    coarse, found = seen, list[Hump]()
    for radius in _RADII_MM:
        coarse = _coarse(coarse, radius / _CELLS)
        for row, column in _tops(coarse, radius, ply.outline):
            hump = _hump(coarse, row, column, radius, angles, recipe)
            if hump is not None:
                found.append(hump)
    found.sort(key=lambda one: -one.ridge_mm)
    kept: list[Hump] = []
    for hump in found:
        far = [np.hypot(*np.subtract(hump.place_mm, one.place_mm)) for one in kept]
        reach = [max(_RADII_MM[0], np.sqrt(one.area_mm2)) for one in kept]
        if all(distance > near for distance, near in zip(far, reach, strict=True)):
            kept.append(hump)
    return tuple(kept)


def named(humps: tuple[Hump, ...], largest: Grid | None, recipe: Recipe) -> tuple[Hump, ...]:
    """Return the humps whose ridge exceeds the limit together with the largest excess that a scan shows on them."""
    out = []
    for hump in humps:
        own_mm = 0.0 if largest is None else _largest_near(largest, hump)
        # Heights add up, and excess goes with their squares if both have one shape, else it is less.
        total_mm = (np.sqrt(hump.excess_mm) + np.sqrt(min(own_mm, hump.excess_mm))) ** 2
        ridge_mm = ridge_of(total_mm, recipe)
        if ridge_mm > recipe.verdict.max_ridge_mm:
            out.append(replace(hump, excess_mm=total_mm, ridge_mm=ridge_mm))
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
    """Name each hump, with its ridge against the limit."""
    limit = recipe.verdict.max_ridge_mm
    return [
        Finding(
            "reference_humps",
            None,
            f"the reference has {_what(hump)}: if that is a pocket of the ply before, give the scan that was taken "
            "after it was debulked",
            hump.ridge_mm,
            limit,
            "mm",
            hump.place_mm,
            remedy="give the scan that was taken after the ply before was debulked",
        )
        for hump in humps
    ]


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
    parts = seen.values[: ny * step, : nx * step].astype(np.float64).reshape(ny, step, nx, step)
    known = np.isfinite(parts)
    count = known.sum(axis=(1, 3))
    total = np.where(known, parts, 0.0).sum(axis=(1, 3))
    known = 2 * count >= step**2
    mean = np.where(known, total / np.maximum(count, 1), np.nan)
    level = float(np.median(mean[known])) if known.any() else 0.0
    # A median over three cells takes away what the outlier filter left, which is no wider than one.
    calm = cv2.medianBlur(np.where(known, mean - level, 0.0).astype(np.float32), 3).astype(np.float64) + level
    beside = cv2.erode(known.astype(np.uint8), np.ones((3, 3), np.uint8), borderValue=1) == 1
    values = np.where(beside, calm, mean)
    origin = np.asarray(seen.origin_mm) + 0.5 * (step - 1) * float(seen.spacing_mm)
    return Grid(values, origin, step * float(seen.spacing_mm))


def _tops(coarse: Grid, radius_mm: float, ply_outline: Floats | None) -> list[tuple[int, int]]:
    """Return the places that stand highest above what a quadratic surface through the ring round them predicts."""
    cells = radius_mm / coarse.spacing_mm
    reach = int(np.ceil(_OUTER * cells))
    if min(coarse.values.shape) < 2 * reach + 1:
        return []
    v, u = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    ring = (np.hypot(u, v) > cells) & (np.hypot(u, v) <= _OUTER * cells)
    kernel = np.zeros(ring.shape)
    terms = _quadratic(u[ring] / cells, v[ring] / cells)
    kernel[ring] = product(terms, np.linalg.solve(product(terms.T, terms), np.eye(terms.shape[1])[0]))
    known = np.isfinite(coarse.values)
    level = float(np.median(coarse.values[known])) if known.any() else 0.0
    heights = np.where(known, coarse.values - level, 0.0)
    above = heights - cv2.filter2D(heights, -1, kernel, borderType=cv2.BORDER_CONSTANT)
    disc = (np.hypot(u, v) <= _OUTER * cells).astype(np.float64)
    share = cv2.filter2D(known.astype(np.float64), -1, disc / disc.sum(), borderType=cv2.BORDER_CONSTANT)
    side = 2 * max(1, int(cells / 2)) + 1
    top = (above >= cv2.dilate(above, np.ones((side, side)))) & (above > _LEAST_MM) & known & (share >= _SEEN)
    rows, columns = np.nonzero(top)
    if ply_outline is not None and len(rows):
        xy = coarse.origin_mm + coarse.spacing_mm * np.stack([columns, rows], axis=1)
        on = pocket.inside(ply_outline, xy)
        rows, columns = rows[on], columns[on]
    order = np.argsort(-above[rows, columns])[:_MOST]
    return [(int(rows[k]), int(columns[k])) for k in order]


def _quadratic(u: Floats, v: Floats) -> Floats:
    return np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=1)


def _hump(
    coarse: Grid, row: int, column: int, radius_mm: float, angles_deg: tuple[float, ...], recipe: Recipe
) -> Hump | None:
    """Measure a hump; None if its surroundings are not smooth."""
    cells = radius_mm / coarse.spacing_mm
    reach = int(np.ceil(_OUTER * cells))
    rows, columns = (slice(max(0, at - reach), at + reach + 1) for at in (row, column))
    part = coarse.values[rows, columns]
    v, u = np.mgrid[rows.start : rows.start + part.shape[0], columns.start : columns.start + part.shape[1]]
    u, v = (u - column) / cells, (v - row) / cells
    far, known = np.hypot(u, v), np.isfinite(part)
    ring = known & (far > 1) & (far <= _OUTER)
    if np.count_nonzero(ring) < 30:
        return None
    factors = least_squares(_quadratic(u[ring], v[ring]), part[ring])
    below = product(_quadratic(u.ravel(), v.ravel()), factors).reshape(part.shape)
    hump = np.where(known, part - below, 0.0)
    height = float(hump[row - rows.start, column - columns.start])
    off = float(np.sqrt(np.mean(hump[ring] ** 2)))
    if height < _LEAST_MM or off > _SMOOTH * height:
        return None
    lifted = np.where((far <= 1.1) & (hump > _FOOT * height), hump, 0.0)
    excess = max(_excess(below, lifted, row - rows.start, column - columns.start, one, coarse) for one in angles_deg)
    x, y = coarse.origin_mm + coarse.spacing_mm * np.array([column, row])
    area = float(np.count_nonzero(lifted > height / 2)) * coarse.spacing_mm**2
    if area < _LEAST_MM2:
        return None
    # A bump (1 - r²)² is 3.7 times as wide at its foot as the radius of the circle where it is half as high.
    left = float(left_by_means(float(coarse.spacing_mm), np.array(3.7 * np.sqrt(area / np.pi))))
    excess = max(0.0, excess) / left
    return Hump((float(x), float(y)), height, area, excess, ridge_of(excess, recipe))


def _excess(below: Floats, lifted: Floats, row: int, column: int, angle_deg: float, coarse: Grid) -> float:
    """Return by how much a fibre over the top is longer than the surface below, mm."""
    half = min(lifted.shape) / 2
    s = np.arange(-half, half + 0.5)
    x = (column + s * np.cos(np.radians(angle_deg))).astype(np.float32)
    y = (row + s * np.sin(np.radians(angle_deg))).astype(np.float32)
    lines = [
        cv2.remap(one.astype(np.float32), x[None], y[None], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)[0]
        for one in (below + lifted, below)
    ]
    upper, lower = (np.hypot(np.diff(line.astype(np.float64)), coarse.spacing_mm).sum() for line in lines)
    return float(upper - lower)
