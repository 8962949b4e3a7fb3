"""The holes in the data beside a pocket and within its foot: their cells in the map, and their share of the rim."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from debulk import _core, pocket
from debulk.arrays import Bools, Floats
from debulk.grid import Grid
from debulk.inspection.evidence.pieces import grown
from debulk.inspection.find.found import FoundPocket, Hole
from debulk.inspection.lines.places import MARGIN_MM
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.results.half_seen import HoleBeside
from debulk.words import xy_of

# The segmentation bridges a drop-out (a small hole) no thicker than this if something at its rim is high.
BRIDGE_MM = _core.pocket.SegmentOptions().bridge_mm
_FARTHEST_MM = 2 * MARGIN_MM  # from the foot: if a hole extends farther, the rim is not known there and stays open
# From a hole to a foot or bump beside it: places of listed holes come from a coarser map, and smoothed heights reach a
# little past what was seen.
NEAR_MM = 10.0
_NEAR_CELLS = 2  # a contour runs along unknown cells at up to so many cells from their middles


@dataclass(frozen=True, eq=False)
class PocketHoles:
    """The holes beside a pocket, in a window of the height map."""

    heights: Grid
    """Heights of the ply above the reference in the window, NaN where nothing is known."""
    unknown: Bools
    """(ny, nx): the cells of the holes that border on the pocket's foot or lie within it."""
    pocket: Bools
    """(ny, nx): the cells of the pocket itself, above the cut."""
    holes: tuple[HoleBeside, ...]
    """These holes, largest first."""
    rim_share: float
    """Share of the foot's perimeter that runs along them."""


def holes_of(found: FoundPocket, ply: PlyOnMold) -> PocketHoles | None:
    """Find the holes beside a pocket; None if there are none, or if the foot is closed and none of them is listed.

    A hole is a part of the ply that the scan, the reference or the mask leaves unknown after the rules for small holes
    and for drop-outs. A hole that the segmentation bridged because a pocket surrounds it counts, too.
    """
    listed = [one for one in found.holes if not one[0].filled]
    heights, own = found.segmentation.heights, _box(found.foot.outline_mm)
    thick = [one for one in listed if one[0].thickness > BRIDGE_MM and _meet(one[0].box, own, NEAR_MM)]
    if found.foot.closed and not thick:
        return None
    rows, columns, unknown = _reached(found, own, [hole.box for hole, _ in thick], ply)
    if not unknown.any():
        return None
    window = heights.part(rows, columns)
    window.values[unknown] = np.nan
    holes = tuple(_holes(unknown, window, listed))
    if found.foot.closed and not {listed_hole(*one) for one in thick} & set(holes):
        return None
    pocket_cells = found.segmentation.labels.values[rows, columns] == found.pocket.id
    return PocketHoles(window, unknown, pocket_cells, holes, rim_share(found.foot.outline_mm, unknown, window))


def listed_hole(hole: pocket.UnseenHole, of: str) -> HoleBeside:
    """Describe a hole that the core lists: place, area, and what hides the ply there."""
    return HoleBeside(centre_mm=xy_of(hole.centre), area_mm2=float(hole.area), of=of)


def rim_share(outline_mm: Floats, unknown: Bools, window: Grid) -> float:
    """Return the share of a closed outline's length that runs along, or within, unknown cells."""
    near = grown(unknown, _NEAR_CELLS)
    ends = np.roll(outline_mm, -1, axis=0)
    lengths = np.linalg.norm(ends - outline_mm, axis=1)
    along = Grid(near, window.origin_mm, window.spacing_mm).at(0.5 * (outline_mm + ends), beyond=0.0) > 0
    total = float(lengths.sum())
    return float(lengths[along].sum()) / total if total > 0 else 0.0


def _reached(
    found: FoundPocket, own_mm: Floats, thick_mm: Sequence[Floats], ply: PlyOnMold
) -> tuple[slice, slice, Bools]:
    """Return rows and columns that hold a foot, the holes that border on it and a margin; and these holes' cells.

    The rows and columns also hold other feet beside these holes, because with the holes filled in they may be one foot.
    """
    heights, feet = found.segmentation.heights, found.feet.labels.values
    steps = math.ceil(_FARTHEST_MM / heights.spacing_mm)
    rows, columns = heights.around(own_mm, MARGIN_MM)
    while True:
        missing = np.isnan(heights.values[rows, columns])
        if thick_mm:
            bridged: Bools = found.segmentation._core.bridged.view(np.bool_)
            missing |= _within(thick_mm, heights, rows, columns) & bridged[rows, columns]
        labels = feet[rows, columns]
        unknown = _flood(_on_ply(missing, heights, rows, columns, ply), labels == found.foot.label, steps)
        beside = set(np.unique(labels[grown(unknown)]).tolist())
        boxes = [own_mm, *(_box(foot.outline_mm) for foot in found.feet.feet if foot.label in beside)]
        if unknown.any():
            cells = np.argwhere(unknown)[:, ::-1] + [columns.start, rows.start]
            boxes.append(_box(heights.origin_mm + heights.spacing_mm * cells))
        wider = heights.around(_box(np.concatenate(boxes)), MARGIN_MM)
        if wider == (rows, columns):
            return rows, columns, unknown
        rows, columns = wider


def _within(boxes_mm: Sequence[Floats], heights: Grid, rows: slice, columns: slice) -> Bools:
    """Return the cells of a part of the map that lie in one of the boxes."""
    x, y = (
        heights.origin_mm[axis] + heights.spacing_mm * np.arange(part.start, part.stop)
        for axis, part in enumerate((columns, rows))
    )
    out = np.zeros((len(y), len(x)), dtype=np.bool_)
    for (left, low), (right, high) in boxes_mm:
        out |= ((y >= low) & (y <= high))[:, None] & (x >= left) & (x <= right)
    return out


def _box(xy_mm: Floats) -> Floats:
    rows = np.ascontiguousarray(xy_mm.T)  # numpy reduces two long rows twenty times as fast as two long columns
    return np.stack([rows.min(axis=1), rows.max(axis=1)])


def _meet(one_mm: Floats, other_mm: Floats, near_mm: float) -> bool:
    return bool((one_mm[0] <= other_mm[1] + near_mm).all() and (other_mm[0] <= one_mm[1] + near_mm).all())


def _on_ply(missing: Bools, heights: Grid, rows: slice, columns: slice, ply: PlyOnMold) -> Bools:
    on = missing.copy()
    if ply.outline is None or not on.any():
        return on
    cells = np.argwhere(missing)
    xy = heights.origin_mm + heights.spacing_mm * (cells[:, ::-1] + [columns.start, rows.start])
    on[missing] = pocket.inside(ply.outline, xy)
    return on


def _flood(into: Bools, start: Bools, steps: int) -> Bools:
    """Return the cells of `into` within so many steps of `start`, through cells of `into`, by sides and corners."""
    reached = into & (start | grown(start))
    front = reached
    for _ in range(steps):
        front = into & grown(front) & ~reached
        if not front.any():
            break
        reached = reached | front
    return reached


def _holes(unknown: Bools, window: Grid, listed: list[Hole]) -> Iterator[HoleBeside]:
    """Yield the listed holes that the unknown cells belong to; the other cells, if they are many, are one more hole."""
    cell_mm2 = window.spacing_mm**2
    xy = window.origin_mm + window.spacing_mm * np.argwhere(unknown)[:, ::-1]
    rest = np.ones(len(xy), dtype=np.bool_)
    for hole, of in listed:
        within = ((xy >= hole.box[0]) & (xy <= hole.box[1])).all(axis=1)
        if 2 * np.count_nonzero(within) * cell_mm2 < hole.area:
            continue
        rest &= ~within
        yield listed_hole(hole, of)
    left = np.count_nonzero(rest) * cell_mm2
    if left > 0 and (rest.all() or left > cell_mm2 * len(xy) / 2):
        yield HoleBeside(centre_mm=xy_of(xy[rest].mean(axis=0)), area_mm2=float(left), of="scan")
