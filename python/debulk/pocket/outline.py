"""The plane geometry of outlines: closed polygons in the mold's XY."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, arrays
from debulk.arrays import Floats
from debulk.grid import Grid


def polygon_area(outline_mm: ArrayLike) -> float:
    """Return the area of a polygon, positive if it runs counter-clockwise.

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
        The array has another shape, or a corner that is not finite.

    Examples
    --------
    >>> polygon_area([[0, 0], [4, 0], [4, 1], [0, 1]])
    4.0
    """
    return float(_core.pocket.polygon_area(arrays.corners(outline_mm, "outline_mm")))


def inside(outline_mm: ArrayLike, xy_mm: ArrayLike) -> NDArray[np.bool_]:
    """Return whether points lie inside a polygon, by the even-odd rule.

    Parameters
    ----------
    outline_mm
        (M, 2) corners, closed from the last to the first, mm.
    xy_mm
        (N, 2) points in the same frame, mm.

    Returns
    -------
    NDArray[bool]
        (N,).

    Raises
    ------
    InputError
        An array has another shape, or a corner is not finite.

    Examples
    --------
    >>> inside([[0, 0], [4, 0], [4, 1], [0, 1]], [[1, 0.5], [5, 0.5]]).tolist()
    [True, False]
    """
    result: NDArray[np.bool_] = _core.pocket.inside_polygon(arrays.corners(outline_mm, "outline_mm"), _places(xy_mm))
    return result


def distance_to_outline(outline_mm: ArrayLike, xy_mm: ArrayLike) -> Floats:
    """Return the distance of points from a polygon's sides, positive both inside and outside.

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
        An array has another shape, or a corner is not finite.

    Examples
    --------
    >>> distance_to_outline([[0, 0], [4, 0], [4, 1], [0, 1]], [[2, 0.25], [7, 5]]).tolist()
    [0.25, 5.0]
    """
    result: Floats = _core.pocket.distance_to_outline(arrays.corners(outline_mm, "outline_mm"), _places(xy_mm))
    return result


def _places(xy_mm: ArrayLike) -> Floats:
    return arrays.numbers(xy_mm, "xy_mm", (None, 2), "an (N, 2) array of points", nan=True)


def inside_outline(outline_mm: NDArray[np.float64], grid: Grid) -> NDArray[np.bool_]:
    """Return whether a grid's points lie inside a polygon, by even-odd crossings in each row, as masks of a ply do.

    Parameters
    ----------
    outline_mm
        (M, 2) corners, closed from the last to the first, mm. With fewer than three corners, no point is inside.
    grid
        The grid; its values do not matter.

    Returns
    -------
    NDArray[bool]
        (ny, nx).

    Raises
    ------
    InputError
        The outline has another shape, or a corner is not finite.

    Examples
    --------
    >>> square = np.array([[0.5, -0.5], [2.5, -0.5], [2.5, 1.5], [0.5, 1.5]])
    >>> inside_outline(square, Grid(np.zeros((3, 4)), np.zeros(2), 1.0)).astype(int).tolist()
    [[0, 1, 1, 0], [0, 1, 1, 0], [0, 0, 0, 0]]
    """
    ny, nx = grid.values.shape[:2]
    result: NDArray[np.bool_] = _core.pocket.inside_on_grid(
        arrays.corners(outline_mm, "outline_mm"), grid.origin_mm, grid.spacing_mm, nx, ny
    )
    return result
