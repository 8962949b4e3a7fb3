"""Pockets of a height map: segmentation, foot contours, and the patches to lay nets on (paper, "Segmentation")."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, arrays
from debulk.arguments import of_type, typed
from debulk.grid import Grid
from debulk.surface import HeightMap, Reference

Floats = NDArray[np.float64]
UnseenHole = _core.pocket.UnseenHole
Unseen = _core.pocket.Unseen

# Each default stands once, in cpp/debulk/pocket.
_SEGMENT, _FEET, _PATCH = _core.pocket.SegmentOptions(), _core.pocket.FootOptions(), _core.pocket.PatchOptions()

__all__ = [
    "Dropped",
    "Feet",
    "Foot",
    "Patch",
    "Pocket",
    "Segmentation",
    "Unseen",
    "UnseenHole",
    "distance_to_outline",
    "feet",
    "height_noise",
    "inside",
    "inside_outline",
    "patch",
    "polygon_area",
    "segment",
]


@dataclass(frozen=True, eq=False)
class Pocket:
    """A region of the ply that stands at least the cut height above the reference.

    Attributes
    ----------
    id
        From 1, largest area first.
    outline_mm
        (M, 2) sub-pixel contour at the cut height, mold XY, counter-clockwise, closed implicitly, clipped by the ply.
    area_mm2
        XY area inside the outline.
    volume_mm3
        Integral of the height above the reference inside the outline.
    peak_mm, peak_position_mm
        Largest height above the reference, and the (2,) XY of its grid point. With `segment`'s `smooth_mm`, outline,
        area, volume and peak are the smoothed surface's.
    centroid_mm
        (2,) of the area.
    box_mm
        (2, 2) lowest and highest x, y of the outline.
    touches_ply_edge
        The outline comes within the edge tolerance of the ply's outline; False if that is unknown.
    touches_unknown
        The outline runs along unknown heights or the grid's border: area and volume are lower bounds.
    measured_share
        Share of its grid points that were measured, not filled.
    """

    id: int
    outline_mm: Floats
    area_mm2: float
    volume_mm3: float
    peak_mm: float
    peak_position_mm: Floats
    centroid_mm: Floats
    box_mm: Floats
    touches_ply_edge: bool
    touches_unknown: bool
    measured_share: float


@dataclass(frozen=True, eq=False)
class Dropped:
    """What stood above the cut but is no pocket; too little ``"area"``, ``"peak"`` or ``"area and peak"``.

    `touches_unknown` and `measured_share` are as of a `Pocket`.
    """

    reason: str
    area_mm2: float
    peak_mm: float
    centroid_mm: Floats
    touches_unknown: bool = False
    measured_share: float = 1.0


@dataclass(frozen=True, eq=False)
class Segmentation:
    """What `segment` found.

    Attributes
    ----------
    pockets, dropped
        Largest area first.
    specks
        Number of dropped ones too small to list: below a twentieth of the least area.
    labels
        (ny, nx) int32: the pocket's id, 0 = none. Read-only.
    heights
        (ny, nx) float32: the given heights, NaN off the ply, drop-outs bridged where `segment` says. Read-only.
    """

    pockets: list[Pocket]
    dropped: list[Dropped]
    specks: int
    labels: Grid
    heights: Grid
    _core: Any = field(repr=False)


@typed
def segment(
    height_map: Grid,
    cut_height_mm: float = _SEGMENT.cut_height_mm,
    area_tol_mm2: float = _SEGMENT.area_tol_mm2,
    peak_tol_mm: float = _SEGMENT.peak_tol_mm,
    ply_outline: ArrayLike | None = None,
    *,
    edge_tol_mm: float | None = None,
    bridge_mm: float = _SEGMENT.bridge_mm,
    smooth_mm: float = _SEGMENT.smooth_mm,
    threads: int = 0,
    stop: _core.Stop | None = None,
) -> Segmentation:
    """Find the air pockets in a height map.

    Cut, fill holes, connect (8 neighbours; background 4), drop what is too small or too low, number by area (paper).
    Outlines march squares over the heights, not pixels (the paper's Moore tracing), for areas exact below the grid's
    spacing. Heights outside the ply do not count, and outlines end at its edge, below the spacing too.

    A drop-out neither joins two pockets nor cuts one: before the cut, an unknown region of at most `bridge_mm` with a
    height above a quarter of the cut at its rim is bridged by the least-bent surface through that rim. A larger one is
    no pocket: outlines close along its pixels, unless one pocket surrounds it.

    Parameters
    ----------
    height_map
        (ny, nx) float32 ply minus reference, mm, NaN = unknown. A `debulk.surface.HeightMap` says more: `measured`
        decides `Pocket.measured_share` (all heights of a plain grid count as measured), and with `smooth_mm` pockets
        are measured on `before_median`, and `blur_mm2` is undone.
    cut_height_mm
        A pocket is where the height is at least this.
    area_tol_mm2
        Least area of a pocket.
    peak_tol_mm
        Least peak above the cut.
    ply_outline
        (M, 2) mold XY, mm, closed; None = unknown.
    edge_tol_mm
        A pocket whose outline is this near to the ply's touches the ply's edge. None: two grid spacings.
    bridge_mm
        Largest extent, along x and y, of a drop-out to bridge; 0: none.
    smooth_mm
        Window of the local quadratic smoothing of the surface on which pockets are measured; for a pocket narrower than
        this, its area over its perimeter. What is a pocket is decided by the heights as given. 0: measured on these.
    threads
        0: as many as the process may use. The result does not depend on it.
    stop
        Raised from another thread, it ends the search with a RuntimeError.

    Raises
    ------
    InputError
        Not a Grid, a wrong shape, a tolerance out of its range, an outline without an area.

    Examples
    --------
    >>> import numpy as np, debulk.pocket
    >>> y, x = np.mgrid[-50.0:51.0, -50.0:51.0]
    >>> bell = 8 * np.cos(np.pi / 2 * np.minimum(np.hypot(x, y) / 40, 1)) ** 2
    >>> found = debulk.pocket.segment(debulk.Grid(bell.astype("f4"), np.array([-50.0, -50.0]), 1.0))
    >>> [(p.id, round(p.peak_mm, 2), bool(abs(p.area_mm2 / (np.pi * (80 / 3) ** 2) - 1) < 1e-3)) for p in found.pockets]
    [(1, 8.0, True)]
    """
    options = _core.pocket.SegmentOptions()
    options.cut_height_mm = cut_height_mm
    options.area_tol_mm2 = area_tol_mm2
    options.peak_tol_mm = peak_tol_mm
    options.edge_tol_mm = 0.0 if edge_tol_mm is None else edge_tol_mm
    options.bridge_mm = bridge_mm
    options.smooth_mm = smooth_mm
    options.ply_outline = None if ply_outline is None else arrays.corners(ply_outline, "ply_outline")
    return segment_with(options, height_map, threads, stop or _core.Stop())


def segment_with(
    options: _core.pocket.SegmentOptions, height_map: Grid, threads: int, stop: _core.Stop
) -> Segmentation:
    """Do the same with compiled options, but for the blur, which the height map knows."""
    if not isinstance(height_map, Grid):
        raise _core.InputError(f"height_map: expected a debulk.Grid, but got {of_type(height_map)}")
    known = height_map if isinstance(height_map, HeightMap) else None
    before = None if known is None else known.before_median
    options.blur_mm2 = 0.0 if known is None else known.blur_mm2
    core = _core.pocket.segment(
        np.asarray(height_map.values, dtype=np.float32),
        np.asarray(height_map.origin_mm, dtype=np.float64),
        float(height_map.spacing_mm),
        options,
        None if known is None else np.ascontiguousarray(known.measured, dtype=bool).view(np.uint8),
        None if before is None else np.asarray(before, dtype=np.float32),
        threads,
        stop,
    )
    return from_core(core)


def from_core(core: Any) -> Segmentation:
    """Wrap a compiled segmentation."""
    pockets = [
        Pocket(
            id=p.id,
            outline_mm=p.outline,
            area_mm2=p.area,
            volume_mm3=p.volume,
            peak_mm=p.peak,
            peak_position_mm=p.peak_position,
            centroid_mm=p.centroid,
            box_mm=p.box,
            touches_ply_edge=p.touches_ply_edge,
            touches_unknown=p.touches_unknown,
            measured_share=p.measured_share,
        )
        for p in core.pockets
    ]
    dropped = [Dropped(d.reason, d.area, d.peak, d.centroid, d.touches_unknown, d.measured_share) for d in core.dropped]
    labels, heights = (Grid(values, core.origin, core.spacing) for values in (core.labels, core.heights))
    return Segmentation(pockets, dropped, core.specks, labels, heights, core)


@dataclass(frozen=True, eq=False)
class Foot:
    """Where a pocket's ply comes down to the mold. Pockets between which it does not come down share one foot.

    Attributes
    ----------
    id
        Of the pocket.
    label
        Of its points in `Feet.labels`: the smallest id of the pockets that share it.
    outline_mm
        (M, 2) contour height - thickness = mold tolerance, mold XY, counter-clockwise, clipped by the ply.
    area_mm2
        XY area inside it.
    closed
        Nowhere cut by unknown heights or the grid's border. (The ply's edge is allowed.)
    touches_ply_edge
        Runs along the ply's outline.
    parted
        Somewhere it parts the pocket from a hill below half the cut, instead of lying on the mold.
    """

    id: int
    label: int
    outline_mm: Floats
    area_mm2: float
    closed: bool
    touches_ply_edge: bool
    parted: bool


@dataclass(frozen=True, eq=False)
class Feet:
    """The feet of all pockets.

    Attributes
    ----------
    feet
        One a pocket, in the order of their ids.
    labels
        (ny, nx) int32: `Foot.label` of the foot to which a point belongs, 0 = none. Read-only.
    heights
        (ny, nx) float32: smoothed heights above the reference. Read-only.
    noise_mm, mold_tol_mm
        Sigma of the heights before smoothing, and the mold tolerance used (at least three times that).
    thickness_mm
        As given.
    hill_mm
        Height above which what is no pocket stands up: half the cut, or the cut where feet begin above that.
    """

    feet: list[Foot]
    labels: Grid
    heights: Grid
    noise_mm: float
    mold_tol_mm: float
    thickness_mm: float
    hill_mm: float
    _core: Any = field(repr=False)


@typed
def feet(
    segmentation: Segmentation,
    *,
    thickness_mm: float = _FEET.thickness_mm,
    mold_tol_mm: float = _FEET.mold_tol_mm,
    smooth_mm: float = _FEET.smooth_mm,
    noise_mm: float | None = None,
    threads: int = 0,
    stop: _core.Stop | None = None,
) -> Feet:
    """Foot contours of all pockets; where the ply does not come down between pockets, they share one.

    Parameters
    ----------
    segmentation
        From `segment`.
    thickness_mm
        Of the ply: the scan sees its upper side.
    mold_tol_mm
        The ply lies on the mold where its lower side is this near; raised to three sigma of the noise.
    smooth_mm
        Window of the local quadratic smoothing before; 0: none.
    noise_mm
        Sigma of the heights' noise; None: `height_noise`.
    threads
        0: as many as the process may use. The result does not depend on it.
    stop
        Raised from another thread, it ends the search with a RuntimeError.

    Raises
    ------
    InputError
        A value out of its range; thickness and tolerance together above the cut height.

    Examples
    --------
    >>> import numpy as np, debulk.pocket
    >>> y, x = np.mgrid[-60.0:61.0, -60.0:61.0]
    >>> bell = 0.3 + 8 * np.cos(np.pi / 2 * np.minimum(np.hypot(x, y) / 40, 1)) ** 2
    >>> found = debulk.pocket.segment(debulk.Grid(bell.astype("f4"), np.array([-60.0, -60.0]), 1.0))
    >>> foot = debulk.pocket.feet(found).feet[0]
    >>> foot.closed, round(float(np.sqrt(foot.area_mm2 / np.pi)))  # 40 · 2/π · acos(√(0.2 / 8)) = 35.95
    (True, 36)
    """
    options = _core.pocket.FootOptions()
    options.thickness_mm = thickness_mm
    options.mold_tol_mm = mold_tol_mm
    options.smooth_mm = smooth_mm
    options.noise_mm = noise_mm
    return feet_with(options, segmentation, threads, stop or _core.Stop())


def feet_with(options: _core.pocket.FootOptions, segmentation: Segmentation, threads: int, stop: _core.Stop) -> Feet:
    """Do the same with compiled options."""
    core = _core.pocket.find_feet(segmentation._core, options, threads, stop)
    return feet_from_core(segmentation, core, options.thickness_mm)


def feet_from_core(segmentation: Segmentation, core: Any, thickness_mm: float) -> Feet:
    """Wrap compiled feet of a segmentation."""
    found = [
        Foot(pocket.id, f.label, f.outline, f.area, f.closed, f.touches_ply_edge, f.parted)
        for pocket, f in zip(segmentation.pockets, core.feet, strict=True)
    ]
    grid = segmentation.labels
    labels, heights = _like(grid, core.labels), _like(grid, core.heights)
    return Feet(found, labels, heights, core.noise, core.mold_tol, thickness_mm, core.hill, core)


@dataclass(frozen=True, eq=False)
class Patch:
    """The surface on which one pocket's net is laid.

    Attributes
    ----------
    id, mode
        The pocket's, and ``"foot"`` or ``"paper"``.
    outline_mm, area_mm2
        (M, 2) the perimeter (foot contour, or the cut's in mode paper) and the XY area inside it.
    closed
        The perimeter is nowhere cut by unknown heights or the grid's border.
    touches_ply_edge
        The pocket or its foot does.
    parted
        See `Foot`.
    surface, reference
        (ny, nx) float64 heights in the mold frame, mm, of the net surface and of F, finite everywhere. The window
        reaches `margin_mm` past the perimeter, past the scan too. Read-only.
    within
        (ny, nx) uint8: 1 in the pocket's own region. Read-only.
    """

    id: int
    mode: str
    outline_mm: Floats
    area_mm2: float
    closed: bool
    touches_ply_edge: bool
    parted: bool
    surface: Grid
    reference: Grid
    within: Grid


@typed
def patch(
    segmentation: Segmentation,
    feet: Feet,
    pocket_id: int,
    reference: Reference,
    *,
    mode: Literal["foot", "paper"] = "foot",
    margin_mm: float = _PATCH.margin_mm,
    fade_mm: float = _PATCH.fade_mm,
) -> Patch:
    """Cut out one pocket's patch: the ply's net surface inside the perimeter, the reference F outside.

    Parameters
    ----------
    segmentation, feet
        From `segment` and `feet`.
    pocket_id
        From 1.
    reference
        The surface F below the ply.
    mode
        ``"foot"``: max(ply - thickness, F) out to the foot contour, smoothed. ``"paper"``: the ply inside the cut's
        outline, F outside, glued with a step of up to the cut height (smoothed inside, too).
    margin_mm
        Of the window round the perimeter: at least the offset of the net's boundary.
    fade_mm
        In mode foot, over which what is left at the perimeter (the mold tolerance; more at a saddle) goes down to F
        outside; past the ply's edge the surface goes on and fades over `margin_mm`. 0: at once.

    Raises
    ------
    InputError
        No such pocket, feet of another segmentation, a value out of its range.

    Examples
    --------
    >>> y, x = np.mgrid[-60.0:61.0, -60.0:61.0]
    >>> bell = 0.3 + 8 * np.cos(np.pi / 2 * np.minimum(np.hypot(x, y) / 40, 1)) ** 2
    >>> found = segment(Grid(bell.astype("f4"), np.array([-60.0, -60.0]), 1.0))
    >>> flat = Reference(np.zeros((13, 13)), (-60.0, -60.0), 10.0)
    >>> one = patch(found, feet(found), 1, flat)
    >>> one.closed, round(float(one.surface.values.max()), 1), bool((one.reference.values == 0).all())
    (True, 8.0, True)
    """
    options = _core.pocket.PatchOptions()
    options.mode = mode
    options.margin_mm = margin_mm
    options.fade_mm = fade_mm
    core = _core.pocket.make_patch(segmentation._core, feet._core, pocket_id, reference, options)

    def grid(values: NDArray[Any]) -> Grid:
        return Grid(values, core.origin, core.spacing)

    return Patch(
        id=pocket_id,
        mode=mode,
        outline_mm=core.outline,
        area_mm2=core.area,
        closed=core.closed,
        touches_ply_edge=core.touches_ply_edge,
        parted=core.parted,
        surface=grid(core.surface),
        reference=grid(core.reference),
        within=grid(core.within),
    )


def height_noise(height_map: Grid) -> float:
    """Sigma of the noise of heights in mm, from the median mixed second difference.

    Noise that is correlated, as after a median filter, comes out too low.

    Parameters
    ----------
    height_map
        (ny, nx) heights, mm, NaN = unknown.

    Returns
    -------
    float
        mm; NaN without 3 by 3 known points.

    Examples
    --------
    >>> heights = np.random.default_rng(0).normal(0.0, 0.05, (200, 300))
    >>> round(height_noise(Grid(heights, np.zeros(2), 1.0)), 3)
    0.05
    """
    return float(_core.pocket.height_noise(np.asarray(height_map.values, dtype=np.float32)))


def polygon_area(outline_mm: ArrayLike) -> float:
    """Area of a polygon, positive when it runs counter-clockwise.

    Parameters
    ----------
    outline_mm
        (M, 2) corners, closed from the last to the first, mm.

    Returns
    -------
    float
        mm².

    Raises
    ------
    InputError
        Another shape, or a corner that is not finite.

    Examples
    --------
    >>> polygon_area([[0, 0], [4, 0], [4, 1], [0, 1]])
    4.0
    """
    return float(_core.pocket.polygon_area(arrays.corners(outline_mm, "outline_mm")))


def inside(outline_mm: ArrayLike, xy_mm: ArrayLike) -> NDArray[np.bool_]:
    """Whether points lie inside a polygon, by the even-odd rule.

    Parameters
    ----------
    outline_mm
        (M, 2) corners, closed from the last to the first, mm.
    xy_mm
        (N, 2) points in the same frame, mm.

    Returns
    -------
    NDArray[np.bool_]
        (N,).

    Raises
    ------
    InputError
        Other shapes, or a corner that is not finite.

    Examples
    --------
    >>> inside([[0, 0], [4, 0], [4, 1], [0, 1]], [[1, 0.5], [5, 0.5]]).tolist()
    [True, False]
    """
    result: NDArray[np.bool_] = _core.pocket.inside_polygon(arrays.corners(outline_mm, "outline_mm"), _places(xy_mm))
    return result


def distance_to_outline(outline_mm: ArrayLike, xy_mm: ArrayLike) -> Floats:
    """How far points are from a polygon's sides, inside and outside alike.

    Parameters
    ----------
    outline_mm
        (M, 2) corners, closed from the last to the first, mm.
    xy_mm
        (N, 2) points in the same frame, mm.

    Returns
    -------
    NDArray[np.float64]
        (N,), mm.

    Raises
    ------
    InputError
        Other shapes, or a corner that is not finite.

    Examples
    --------
    >>> distance_to_outline([[0, 0], [4, 0], [4, 1], [0, 1]], [[2, 0.25], [7, 5]]).tolist()
    [0.25, 5.0]
    """
    result: Floats = _core.pocket.distance_to_outline(arrays.corners(outline_mm, "outline_mm"), _places(xy_mm))
    return result


def _places(xy_mm: ArrayLike) -> Floats:
    return arrays.numbers(xy_mm, "xy_mm", (None, 2), "an (N, 2) array of points", nan=True)


def _like(grid: Grid, values: NDArray[Any]) -> Grid:
    return Grid(values, grid.origin_mm, grid.spacing_mm)


def inside_outline(outline_mm: NDArray[np.float64], grid: Grid) -> NDArray[np.bool_]:
    """Whether a grid's points lie inside a polygon, row by row by even-odd crossings.

    Parameters
    ----------
    outline_mm
        (M, 2) corners, closed from the last to the first, mm. With fewer than three nothing is inside.
    grid
        Its values may be anything.

    Returns
    -------
    NDArray[np.bool_]
        (ny, nx).

    Examples
    --------
    >>> square = np.array([[0.5, -0.5], [2.5, -0.5], [2.5, 1.5], [0.5, 1.5]])
    >>> inside_outline(square, Grid(np.zeros((3, 4)), np.zeros(2), 1.0)).astype(int).tolist()
    [[0, 1, 1, 0], [0, 1, 1, 0], [0, 0, 0, 0]]
    """
    ny, nx = grid.values.shape[:2]
    inside = np.zeros((ny, nx), dtype=np.bool_)
    if len(outline_mm) < 3:
        return inside
    a = (outline_mm - grid.origin_mm) / grid.spacing_mm  # in cells
    b = np.roll(a, -1, axis=0)
    first, last = math.ceil(max(0.0, a[:, 1].min())), math.floor(min(ny - 1.0, a[:, 1].max()))
    columns = np.arange(nx)
    for row in range(first, last + 1):
        crossed = (a[:, 1] <= row) != (b[:, 1] <= row)
        start, end = a[crossed], b[crossed]
        at = start[:, 0] + (row - start[:, 1]) * (end[:, 0] - start[:, 0]) / (end[:, 1] - start[:, 1])
        inside[row] = np.searchsorted(np.sort(at), columns) % 2 == 1
    return inside
