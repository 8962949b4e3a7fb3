"""Which parts of a height map are pockets: regions above the cut that are large and high enough."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike

from debulk import _core, arrays
from debulk.arguments import of_type, typed
from debulk.arrays import Floats
from debulk.grid import Grid
from debulk.surface import HeightMap

_SEGMENT = _core.pocket.SegmentOptions()  # each default is written only once, in cpp/debulk/pocket


@dataclass(frozen=True, eq=False)
class Pocket:
    """A region of the ply that stands at least the cut height above the reference."""

    id: int
    """Number from 1, largest area first."""
    outline_mm: Floats
    """(M, 2) sub-pixel contour at the cut height, mold XY, counter-clockwise, closed implicitly, clipped by the ply."""
    area_mm2: float
    """XY area inside the outline."""
    volume_mm3: float
    """Integral of the height above the reference inside the outline."""
    peak_mm: float
    peak_position_mm: Floats
    """`peak_mm`, `peak_position_mm`: largest height above the reference, and the (2,) XY of its grid point. If
    `segment` was given a `smooth_mm`, outline, area, volume and peak are those of the smoothed surface."""
    centroid_mm: Floats
    """(2,) centroid of the area."""
    box_mm: Floats
    """(2, 2) lowest and highest x, y of the outline."""
    touches_ply_edge: bool
    """Whether the outline comes within the edge tolerance of the ply's outline; False if that is unknown."""
    touches_unknown: bool
    """Whether the outline runs along unknown heights or the grid's border: area and volume are lower bounds then."""
    measured_share: float
    """Share of its grid points that were measured, not filled."""


@dataclass(frozen=True, eq=False)
class Dropped:
    """A region above the cut that is no pocket, for too little ``"area"``, ``"peak"`` or ``"area and peak"``.

    `touches_unknown` is as in `Pocket`.
    """

    reason: str
    area_mm2: float
    peak_mm: float
    centroid_mm: Floats
    touches_unknown: bool = False


@dataclass(frozen=True, eq=False)
class Segmentation:
    """The result of `segment`."""

    pockets: list[Pocket]
    dropped: list[Dropped]
    """`pockets`, `dropped`: pockets and dropped regions, largest area first."""
    specks: int
    """Number of dropped regions too small to list: below a twentieth of the least area."""
    labels: Grid
    """(ny, nx) int32: the id of the pocket at each point, 0 = none. Read-only."""
    heights: Grid
    """(ny, nx) float32: the given heights, NaN off the ply, with drop-outs bridged as `segment` describes.
    Read-only."""
    cut_height_mm: float
    """Height at which the pockets' outlines lie."""
    _core: Any = field(repr=False)

    def __reduce__(self) -> NoReturn:
        raise TypeError("a Segmentation cannot be pickled or copied: pickle its height map, and segment() that again")


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

    As in the paper, the heights are cut, holes are filled, points are connected (8 neighbours; background 4), regions
    too small or too low are dropped, and the rest is numbered by area. Outlines come from marching squares over the
    heights, not from pixels (the paper's Moore tracing), so that areas are exact below the grid's spacing. Heights
    outside the ply do not count, and outlines end at its edge, also to a fraction of the spacing.

    A drop-out neither joins two pockets nor cuts one. Before the cut, an unknown region off the grid's border that is
    at most `bridge_mm` thick and has a height above a quarter of the cut at its rim is bridged by the least-bent
    surface through that rim. A thicker one is no pocket: outlines close along its pixels, unless one pocket surrounds
    it.

    Parameters
    ----------
    height_map
        (ny, nx) float32 ply minus reference, mm, NaN = unknown. A `debulk.surface.HeightMap` holds more: `measured`
        determines `Pocket.measured_share` (all heights of a plain grid count as measured). With `smooth_mm`, pockets
        are measured on `before_median`, and `blur_mm2` is undone.
    cut_height_mm
        A pocket is where the height is at least this.
    area_tol_mm2
        Least area of a pocket.
    peak_tol_mm
        Least height of a pocket's peak above the cut.
    ply_outline
        (M, 2) mold XY, mm, closed; None = unknown.
    edge_tol_mm
        A pocket whose outline is this near to the ply's outline touches the ply's edge. None: two grid spacings.
    bridge_mm
        Largest thickness of a drop-out to bridge: no point of it is farther than half of this from a known height.
        0: none is bridged.
    smooth_mm
        Window of the local quadratic smoothing of the surface on which pockets are measured; for a pocket narrower than
        this, its area over its perimeter. The heights as given decide what is a pocket. 0: pockets are measured on
        these, too.

    Raises
    ------
    InputError
        The map is no Grid or has a wrong shape, a tolerance is out of its range, or the outline has no area.

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
    """Find the air pockets, as `segment` does, with compiled options; the blur is taken from the height map."""
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
    dropped = [Dropped(d.reason, d.area, d.peak, d.centroid, d.touches_unknown) for d in core.dropped]
    labels, heights = (Grid(values, core.origin, core.spacing) for values in (core.labels, core.heights))
    return Segmentation(pockets, dropped, core.specks, labels, heights, core.cut_height, core)


def height_noise(height_map: Grid) -> float:
    """Return the sigma of the noise of heights in mm, from the median mixed second difference.

    Correlated noise, as after a median filter, is estimated too low.

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
