"""What was not seen beside a pocket and within its foot: which cells of the height map, and how much of the rim."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk import _core, pocket
from debulk.grid import Grid
from debulk.inspection.found import FoundPocket
from debulk.inspection.ply_on_mold import PlyOnMold
from debulk.results.half_seen import HoleBeside

__all__ = ["BRIDGE_MM", "Beside", "beside", "listed_hole", "rim_share"]

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

# A drop-out no thicker than this, with something high at its rim, is bridged by the segmentation.
BRIDGE_MM = _core.pocket.SegmentOptions().bridge_mm
_MARGIN_MM = 60.0  # of the window, round foot and holes: what a net, its patch and the windows of the smoothing need
_FARTHEST_MM = 120.0  # from the foot: of a hole that goes on beyond, the pocket's rim is not known, and stays open
_NEAR_CELLS = 2  # a contour runs along the pixels of what is unknown, up to so far from their middles


@dataclass(frozen=True, eq=False)
class Beside:
    """What was not seen beside a pocket, in a window of the height map.

    Attributes
    ----------
    heights
        Of the ply above the reference in the window, NaN where nothing is known.
    unknown
        (ny, nx): the cells of the holes that border on the pocket's foot, or lie within it.
    pocket
        (ny, nx): the cells of the pocket itself, above the cut.
    holes
        These holes, largest first.
    rim_share
        Share of the foot's perimeter that runs along them.
    """

    heights: Grid
    unknown: Flags
    pocket: Flags
    holes: tuple[HoleBeside, ...]
    rim_share: float


def beside(found: FoundPocket, ply: PlyOnMold) -> Beside | None:
    """Find what was not seen beside a pocket; None: nothing, or nothing that is listed and a closed foot all the same.

    A hole is what the scan, the reference or the mask leaves unknown on the ply after the rules for small holes and for
    drop-outs, also where the segmentation bridged it because a pocket surrounds it.
    """
    listed = [(hole, hidden) for hole, hidden in zip(found.unseen.holes, found.hidden, strict=True) if not hole.filled]
    thick = [one for one in listed if one[0].thickness > BRIDGE_MM]
    if found.foot.closed and not thick:
        return None
    heights, labels = found.segmentation.heights, found.feet.labels.values
    missing = np.isnan(heights.values)
    bridged = found.segmentation._core.bridged.view(np.bool_)
    for hole, _ in thick:
        part = _cells(hole.box, heights)
        missing[part] |= bridged[part]
    rows, columns, unknown = _reached(missing, labels, found.foot.label, heights, ply)
    if not unknown.any():
        return None
    window = Grid(
        np.where(unknown, np.float32(np.nan), heights.values[rows, columns]),
        heights.origin_mm + heights.spacing_mm * np.array([columns.start, rows.start]),
        heights.spacing_mm,
    )
    holes = tuple(_holes(unknown, window, listed))
    if found.foot.closed and not {listed_hole(*one) for one in thick} & set(holes):
        return None
    own = found.segmentation.labels.values[rows, columns] == found.pocket.id
    return Beside(window, unknown, own, holes, rim_share(found.foot.outline_mm, unknown, window))


def listed_hole(hole: pocket.UnseenHole, hidden: bool) -> HoleBeside:
    """Name a hole that the core lists, and what is missing in it."""
    of = "mask" if hidden else "reference" if hole.reference_share > 0.5 else "scan"
    return HoleBeside(centre_mm=(float(hole.centre[0]), float(hole.centre[1])), area_mm2=float(hole.area), of=of)


def rim_share(outline_mm: Floats, unknown: Flags, window: Grid) -> float:
    """Return the share of a closed outline's length that runs along, or within, what is unknown."""
    near = unknown
    for _ in range(_NEAR_CELLS):
        near = _dilated(near)
    ends = np.roll(outline_mm, -1, axis=0)
    lengths = np.linalg.norm(ends - outline_mm, axis=1)
    cells = np.rint((0.5 * (outline_mm + ends) - window.origin_mm) / window.spacing_mm).astype(np.int64)
    ny, nx = unknown.shape
    i, j = np.clip(cells, 0, [nx - 1, ny - 1]).T
    total = float(lengths.sum())
    return float(lengths[near[j, i]].sum()) / total if total > 0 else 0.0


def _reached(
    missing: Flags, feet: NDArray[np.int32], label: int, heights: Grid, ply: PlyOnMold
) -> tuple[slice, slice, Flags]:
    """Rows and columns that hold a foot, the holes that border on it, and a margin; and these holes' cells.

    Other feet beside these holes are in them too: filled in, they may be one.
    """
    margin, steps = (math.ceil(way_mm / heights.spacing_mm) for way_mm in (_MARGIN_MM, _FARTHEST_MM))
    rows, columns = _around(feet == label, margin)
    while True:
        of_it = feet[rows, columns] == label
        unknown = _flood(_on_ply(missing[rows, columns], heights, rows, columns, ply), of_it, steps)
        cells = unknown | of_it
        beside = np.unique(feet[rows, columns][_dilated(unknown)])
        whole = np.isin(feet, beside[beside > 0])
        whole[rows, columns] |= cells
        wider = _around(whole, margin)
        if wider == (rows, columns):
            return rows, columns, unknown
        rows, columns = wider


def _around(cells: Flags, margin: int) -> tuple[slice, slice]:
    """Rows and columns that hold all cells with a margin."""
    out = []
    for axis, size in enumerate(cells.shape):
        at = np.flatnonzero(cells.any(axis=1 - axis))
        out.append(slice(max(0, int(at[0]) - margin), min(size, int(at[-1]) + margin + 1)))
    return out[0], out[1]


def _cells(box_mm: Floats, heights: Grid) -> tuple[slice, slice]:
    """Rows and columns of a box, as far as they are in the map."""
    ny, nx = heights.values.shape
    (i0, j0), (i1, j1) = np.rint((box_mm - heights.origin_mm) / heights.spacing_mm).astype(np.int64)
    return slice(max(0, j0), max(0, min(ny, j1 + 1))), slice(max(0, i0), max(0, min(nx, i1 + 1)))


def _on_ply(missing: Flags, heights: Grid, rows: slice, columns: slice, ply: PlyOnMold) -> Flags:
    on = missing.copy()
    if ply.outline is None or not on.any():
        return on
    cells = np.argwhere(missing)
    xy = heights.origin_mm + heights.spacing_mm * (cells[:, ::-1] + [columns.start, rows.start])
    on[missing] = pocket.inside(ply.outline, xy)
    return on


def _flood(into: Flags, start: Flags, steps: int) -> Flags:
    """Cells of `into` that so many steps lead to from `start` through cells of `into`, by sides and corners."""
    reached = into & (start | _dilated(start))
    front = reached
    for _ in range(steps):
        front = into & _dilated(front) & ~reached
        if not front.any():
            break
        reached = reached | front
    return reached


def _dilated(cells: Flags) -> Flags:
    wide = cells.copy()
    wide[:, 1:] |= cells[:, :-1]
    wide[:, :-1] |= cells[:, 1:]
    out = wide.copy()
    out[1:] |= wide[:-1]
    out[:-1] |= wide[1:]
    return out


def _holes(unknown: Flags, window: Grid, listed: list[tuple[pocket.UnseenHole, bool]]) -> Iterator[HoleBeside]:
    """Name the unknown cells by the listed holes that they belong to; cells of none are one hole of their own."""
    cell_mm2 = window.spacing_mm**2
    xy = window.origin_mm + window.spacing_mm * np.argwhere(unknown)[:, ::-1]
    rest = np.ones(len(xy), dtype=np.bool_)
    for hole, hidden in listed:
        within = ((xy >= hole.box[0]) & (xy <= hole.box[1])).all(axis=1)
        if 2 * np.count_nonzero(within) * cell_mm2 < hole.area:
            continue
        rest &= ~within
        yield listed_hole(hole, hidden)
    left = np.count_nonzero(rest) * cell_mm2
    if left > 0 and (rest.all() or left > cell_mm2 * len(xy) / 2):
        x, y = xy[rest].mean(axis=0)
        yield HoleBeside(centre_mm=(float(x), float(y)), area_mm2=float(left), of="scan")
