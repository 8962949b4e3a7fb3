"""Surfaces over the mold's XY plane: height maps of scans, and the smooth reference.

Everything is in the mold frame, in mm, with z up. Outliers must have been removed from clouds (set to NaN) before they
are passed here; see `debulk.cloud.remove_outliers`. `threads` is the number of threads, 0 as many as the process may
use, on which no result depends. Cancelling a `stop` from another thread ends a computation with a RuntimeError.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, arrays
from debulk.arguments import typed
from debulk.cloud import as_cloud
from debulk.grid import Grid

InputError = _core.InputError

_JUMP_RATIO = 6.0  # pitches: an edge of a triangle of pixels that is longer spans a depth jump
_FIT = _core.surface.FitOptions()  # each default is defined only in cpp/debulk/surface/fit_reference.hpp
GridT = TypeVar("GridT", bound=Grid)


class Reference(_core.surface.Reference):
    """The smooth reference surface z = F(x, y): the C2 bicubic spline through heights on a regular grid.

    Parameters
    ----------
    heights_mm
        (ny, nx), at least 4 by 4, all finite; ``heights_mm[j, i]`` is at ``origin_mm + spacing_mm * (i, j)``.
    origin_mm
        (2,) position of ``heights_mm[0, 0]``.
    spacing_mm
        Distance between neighbouring heights along x and y.

    Raises
    ------
    InputError
        If the shape is another, a height is not finite (its row and column are named), or the spacing is bad.

    Notes
    -----
    The borders are not-a-knot, so that cubics are reproduced exactly. Public calls refuse points outside the grid;
    solvers in the core use a smooth, linear extension.

    Examples
    --------
    >>> x, y = np.meshgrid(np.arange(0.0, 50.0, 10.0), np.arange(0.0, 40.0, 10.0))
    >>> reference = Reference(x**2 / 1000, (0.0, 0.0), 10.0)
    >>> round(reference.height((25.0, 11.0)), 9)
    0.625
    >>> reference.gradient([[25.0, 11.0]]).round(9).tolist()
    [[0.05, 0.0]]
    """

    @typed
    def __init__(self, heights_mm: ArrayLike, origin_mm: ArrayLike, spacing_mm: float) -> None:
        heights = np.asarray(heights_mm)
        if heights.ndim != 2 or heights.dtype.kind not in "fiu":
            raise InputError(
                f"heights_mm: expected an (ny, nx) array of numbers, but got {arrays.came(heights_mm, heights)}"
            )
        super().__init__(heights.astype(np.float64), arrays.pair(origin_mm, "origin_mm"), float(spacing_mm))

    @property
    def box_mm(self) -> NDArray[np.float64]:
        """(2, 2) lowest and highest corner of what the heights span, mold XY."""
        corners = _core.surface.extent(self)
        return np.stack([corners.min(axis=0), corners.max(axis=0)])

    def __reduce__(self) -> tuple[Any, ...]:
        return Reference, (self.heights_mm, self.origin_mm, self.spacing_mm)

    def height(self, xy: ArrayLike) -> Any:
        """Heights, mm: (M,) for (M, 2) points, a float for a single point (2,)."""
        points, one = arrays.points_xy(xy, "xy")
        out = self._height(points)
        return float(out[0]) if one else out

    def gradient(self, xy: ArrayLike) -> NDArray[np.float64]:
        """Slopes (dF/dx, dF/dy): (M, 2) for (M, 2) points, (2,) for a single point."""
        points, one = arrays.points_xy(xy, "xy")
        out: NDArray[np.float64] = self._gradient(points)
        return out[0] if one else out

    def hessian(self, xy: ArrayLike) -> NDArray[np.float64]:
        """Second derivatives, 1/mm: (M, 2, 2) for (M, 2) points, (2, 2) for a single point."""
        points, one = arrays.points_xy(xy, "xy")
        out: NDArray[np.float64] = self._hessian(points)
        return out[0] if one else out

    @typed
    def datum(self, thickness_mm: float) -> Reference:
        """Return the surface above which a ply's upper side is one thickness high along z wherever the ply lies.

        A ply keeps its thickness t along the normal. Its upper side is the parallel surface of the mold, which stands
        higher above the mold along z than t on a slope: about t / cos(slope), less where the mold is convex. The datum
        is the parallel surface less t, so that heights above it are heights along z, and gaps below the ply are such
        heights less t, on slopes as on the flat (docs/model.md, section 1). On a flat mold, where the two differ by
        less than 1 um, it is the mold itself, to the last bit.

        Parameters
        ----------
        thickness_mm
            Thickness of the ply, not negative.

        Raises
        ------
        InputError
            If the thickness is negative or not finite.

        Examples
        --------
        >>> x = np.arange(-40.0, 41.0, 4.0)
        >>> slope = Reference(np.tile(x, (5, 1)), (-40.0, 0.0), 4.0)  # of 45 degrees
        >>> round(slope.datum(0.3).height((0.0, 8.0)), 4) == round(0.3 * (2**0.5 - 1), 4)
        True
        """
        heights = _core.surface.datum(self, thickness_mm, 0)
        if np.array_equal(heights, self.heights_mm):
            return self
        return Reference(heights, self.origin_mm, self.spacing_mm)


@dataclass(frozen=True, eq=False)
class HeightMap(Grid):
    """Heights above the reference, float32, mm; NaN where nothing is known.

    Parameters
    ----------
    values, origin_mm, spacing_mm
        As in `debulk.Grid`.
    measured
        (ny, nx) bool: True where ply and reference were both seen, False where the height was filled in or is NaN.
    before_median
        (ny, nx) heights before the median filter, if there was one. Pockets are found in the filtered heights, but
        measured on these, which are less blurred.
    blur_mm2
        Blur that gridding gave the heights, as a variance along x and along y; 0: none, or not known.
    """

    measured: NDArray[np.bool_]
    before_median: NDArray[np.float32] | None = None
    blur_mm2: float = 0.0


@typed
def height_map(
    scan: ArrayLike,
    reference_cloud: ArrayLike | _core.surface.Reference,
    spacing_mm: float | None = None,
    *,
    hole_diameter_mm: float = 20.0,
    jump_ratio: float = _JUMP_RATIO,
    threads: int = 0,
    stop: _core.Stop | None = None,
) -> HeightMap:
    """Heights of a scan above a reference, compared at equal x and y.

    Both clouds are laid on one grid (see `grid_heights`), so that the sideways shift of raised points in the camera's
    view (parallax) has no effect. Small holes are filled in (see Notes). Outliers must have been removed before (set to
    NaN): a flying pixel would become a spike.

    Parameters
    ----------
    scan
        (H, W, 3) or (N, 3), mm, mold frame.
    reference_cloud
        The cloud of what lay there before this ply, or a smooth `Reference`.
    spacing_mm
        Spacing of the grid; None: the scan's median pitch.
    hole_diameter_mm
        Holes wider than this along x or y stay NaN, as do those at the grid's border. 0 fills no holes.
    jump_ratio
        A triangle of pixels with an edge longer than this many pitches spans a depth jump and is left out.

    Returns
    -------
    HeightMap
        Heights on a grid with lines at multiples of its spacing, over the area that both share.

    Raises
    ------
    InputError
        If clouds or options are bad, the two do not overlap, or the grid would have more than 2e8 points.

    Notes
    -----
    A hole is filled with a polynomial through the ring of measured heights round it. Its degree is the highest of 4, 2,
    1 and 0 that predicts no height in the hole with more noise than a single height has. The harmonic surface through
    the polynomial's residuals at the rim is added.

    Examples
    --------
    >>> x, y = np.meshgrid(np.arange(40.0), np.arange(30.0))
    >>> scan, before = np.dstack([x, y, 0.1 * x + 1.5]), np.dstack([x, y, 0.1 * x])
    >>> heights = height_map(scan, before, spacing_mm=1.0)
    >>> heights.values.shape, round(float(heights.values[10, 10]), 5)
    ((30, 40), 1.5)
    """
    reference: Any = reference_cloud
    if not isinstance(reference, _core.surface.Reference):
        reference = as_cloud(reference, "reference_cloud")
    spacing = 0.0 if spacing_mm is None else arrays.positive(spacing_mm, "spacing_mm")
    values, measured, origin, step = _core.surface.height_map(
        as_cloud(scan, "scan"),
        reference,
        spacing,
        float(hole_diameter_mm),
        float(jump_ratio),
        threads,
        stop or _core.Stop(),
    )
    return HeightMap(values, origin, step, measured.view(np.bool_))


@typed
def grid_heights(
    points: ArrayLike,
    origin_mm: ArrayLike | None = None,
    spacing_mm: float | None = None,
    shape: tuple[int, int] | None = None,
    *,
    pitch_mm: float = 0.0,
    threads: int = 0,
    stop: _core.Stop | None = None,
) -> Grid:
    """Heights (z) of a cloud on a regular grid, float32, NaN where nothing was seen.

    Parameters
    ----------
    points
        (H, W, 3) or (N, 3), mm, mold frame.
    origin_mm, shape
        (2,) first grid point and (ny, nx); give both, or neither for the grid that covers the bounding box of the
        cloud.
    spacing_mm
        Spacing of the grid; None: the median pitch.
    pitch_mm
        The cloud's median pitch, where it is known (`debulk.cloud.median_pitch`); 0: it is measured.

    Raises
    ------
    InputError
        If input is bad, or the grid would have more than 2e8 points.

    Notes
    -----
    Organised clouds are interpolated linearly on triangles between neighbouring pixels. On a grid coarser than 1.5
    pitches, the value is the average over the square round each grid point, in opposite pairs, so that a slope leaves
    no bias. A missing pixel between two that were seen is bridged. Where surfaces lie above each other, the highest
    counts. Unorganised clouds use local planes by weighted least squares over max(spacing, 2 pitches).

    Examples
    --------
    >>> x, y = np.meshgrid(np.arange(40.0), np.arange(30.0))
    >>> grid_heights(np.dstack([x, y, 0.5 * x]), (10.0, 10.0), 2.0, (2, 3)).values.tolist()
    [[5.0, 6.0, 7.0], [5.0, 6.0, 7.0]]
    """
    cloud = as_cloud(points, "points")
    if (origin_mm is None) != (shape is None):
        raise InputError("origin_mm, shape: expected both or neither, but got one of them")
    stop = stop or _core.Stop()
    if spacing_mm is None:
        spacing = _core.cloud.median_pitch(cloud, threads, stop)
    else:
        spacing = arrays.positive(spacing_mm, "spacing_mm")
    if not spacing > 0:
        raise InputError("points: expected a cloud with neighbouring points, but got none that are neighbours")
    if origin_mm is None or shape is None:
        seen, low, high = _core.cloud.bounds(cloud, threads)
        if seen == 0:
            raise InputError("points: expected at least one point with three finite coordinates, but got none")
        origin, size = _core.surface.covering_grid(low[:2], high[:2], spacing)
    else:
        origin, size = arrays.pair(origin_mm, "origin_mm"), (int(shape[0]), int(shape[1]))
    values = _core.surface.grid_heights(cloud, origin, spacing, size, _JUMP_RATIO, float(pitch_mm), threads, stop)
    return Grid(values, origin, spacing)


@typed
def median(grid: GridT, size: int = 3, *, threads: int = 0) -> GridT:
    """Median filter over windows of 3 by 3 or 5 by 5, of the values that are not NaN; NaN stays NaN.

    Parameters
    ----------
    grid
        A `HeightMap` or `Grid` with (ny, nx) values.
    size
        3 or 5.

    Returns
    -------
    GridT
        The same kind of grid, float32; a height map's `measured` is kept.

    Examples
    --------
    >>> values = np.zeros((5, 5))
    >>> values[2, 2] = 9.0
    >>> float(median(Grid(values, np.zeros(2), 1.0)).values.max())
    0.0
    """
    return replace(grid, values=_core.surface.median(_heights(grid, "grid"), int(size), threads))


@typed
def without_spikes(grid: GridT, tolerance_mm: float = 0.5, *, threads: int = 0) -> GridT:
    """Remove spikes that are not ply: two flying pixels side by side pass both an outlier filter and a 3 by 3 median.

    Parameters
    ----------
    grid
        A `HeightMap` or `Grid` with (ny, nx) values.
    tolerance_mm
        A cell farther than this from the median of itself and the eight cells two away is set to that median. Where
        cells are wider than 1 mm, the tolerance is wider by what these eight cells differ by: there a bump is as steep.

    Examples
    --------
    >>> values = np.zeros((9, 9), dtype=np.float32)
    >>> values[4, 4:6] = 2.0
    >>> float(without_spikes(Grid(values, np.zeros(2), 1.0)).values.max())
    0.0
    """
    tolerance = arrays.positive(tolerance_mm, "tolerance_mm")
    return replace(grid, values=_core.surface.without_spikes(_heights(grid, "grid"), tolerance, threads))


@typed
def fit_reference(
    heights: Grid,
    spacing_mm: float = _FIT.node_spacing_mm,
    *,
    under_ply: NDArray[np.bool_] | None = None,
    threads: int = 0,
    stop: _core.Stop | None = None,
) -> Reference:
    """Fit the smooth reference surface to measured heights with noise and gaps.

    A weighted quadratic is fitted to the heights round each node, in a window, and gives the node's height. That has no
    bias on a mold that is gently curved over the window, and little noise. A second fit leaves out heights far off the
    first. Gaps and the border are filled in as a thin plate, which continues linearly. Where the fit is off over
    several nodes, the window is half as wide, and where it is still off, a quarter: a groove 16 mm wide and 6 mm deep
    reads 6.0 mm, and one 8 mm wide reads 5.1 mm. Beside a cliff the surface follows one side up to its last point, and
    heights of the other side within 40 mm are not fitted; see `misfits`.

    Parameters
    ----------
    heights
        (ny, nx) grid of z as from `grid_heights`; NaN where nothing was seen.
    spacing_mm
        Distance between the surface's nodes; rounded to a multiple of the grid's spacing.
    under_ply
        (ny, nx) marks of the heights inside the ply's outline. The side of a cliff that they lie on is
        followed. None, or on both sides: the upper side is, unless it is as small as a clamp.

    Returns
    -------
    Reference
        Surface over the whole grid.

    Raises
    ------
    InputError
        If input is bad, or the heights do not determine a surface.

    Examples
    --------
    >>> x, y = np.meshgrid(np.arange(60.0), np.arange(50.0))
    >>> reference = fit_reference(Grid(0.001 * x * y, np.zeros(2), 1.0))
    >>> round(reference.height((20.0, 30.0)), 4)
    0.6
    """
    options = _core.surface.FitOptions()
    options.node_spacing_mm = float(spacing_mm)
    nodes, origin, step = _core.surface.fit_reference(
        _heights(heights, "heights"),
        arrays.pair(heights.origin_mm, "origin_mm"),
        float(heights.spacing_mm),
        options,
        np.zeros((0, 0), np.uint8) if under_ply is None else np.ascontiguousarray(under_ply, dtype=np.uint8),
        threads,
        stop or _core.Stop(),
    )
    return Reference(nodes, origin, step)


def misfits(
    heights: Grid, reference: Reference, *, threads: int = 0, stop: _core.Stop | None = None
) -> NDArray[np.bool_]:
    """Find where a smooth reference does not follow the heights that it was fitted to.

    Parameters
    ----------
    heights
        (ny, nx) grid of z, as passed to `fit_reference`.
    reference
        Surface that it returned.

    Returns
    -------
    NDArray[bool]
        (ny, nx), True where a height exists that the surface misses by more than 0.2 mm and by eight times what noise
        explains, in a trimmed mean over 6 mm and on 64 mm² or more. Such places are grooves too narrow for the surface,
        and the area beside a cliff.

    Examples
    --------
    >>> x = np.arange(0.0, 100.0, 0.5)
    >>> groove = np.tile(np.where(abs(x - 50) < 3, -5.0, 0.0), (160, 1))
    >>> heights = Grid(groove, np.zeros(2), 0.5)
    >>> off = misfits(heights, fit_reference(heights))
    >>> bool(off[:, 100].all()), bool(off[:, :40].any())
    (True, False)
    """
    found: NDArray[np.uint8] = _core.surface.misfits(
        _heights(heights, "heights"),
        arrays.pair(heights.origin_mm, "origin_mm"),
        float(heights.spacing_mm),
        reference,
        threads,
        stop or _core.Stop(),
    )
    return found.view(np.bool_)


def _heights(grid: Grid, name: str) -> NDArray[np.float32]:
    values = np.asarray(grid.values)
    if values.ndim != 2 or values.dtype.kind != "f":
        raise InputError(
            f"{name}: expected a grid of (ny, nx) floating-point values, but got {values.dtype}, shape {values.shape}"
        )
    return np.ascontiguousarray(values, dtype=np.float32)
