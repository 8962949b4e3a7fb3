"""The fibre directions of a draped ply: two angles for all of it, or a map of them that may be known only in parts."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import arrays, rings
from debulk._core import InputError
from debulk.arrays import Floats
from debulk.grid import Grid
from debulk.inspection.ply.inputs import kept
from debulk.net import Drape, Draping
from debulk.surface import Reference
from debulk.words import in_mm

Angles = ArrayLike | Grid | Drape | Draping
_NAME = "fibre_angles_deg"
_LEAST_APART_DEG = 10.0  # below it no net can be laid (net/lay.cpp), and nobody looks across the fibres


def checked_angles(value: Angles, name: str = _NAME) -> Floats | Grid | Draping:
    """Return two angles in degrees, or a Grid of them with NaN where nothing is known; a Drape is read on such a grid.

    A Draping is returned as it is: `laid` reads it once the surface is known.

    Where the two angles of a grid are nearly the same, they are not known: nobody would look across the fibres there.
    An `InputError` is raised for another shape, an infinite angle, or a grid without a point at which both are known.
    """
    if isinstance(value, Draping):
        return value
    if isinstance(value, Drape):
        return _sampled(value)
    if not isinstance(value, Grid):
        angles = arrays.numbers(value, name, (2,), "two angles in degrees, a Grid of them or a debulk.net.Drape")
        check_apart(angles, name)
        return kept(angles)
    shape, expected = (None, None, 2), "an (ny, nx, 2) array of degrees, NaN where nothing is known"
    angles = arrays.numbers(value.values, f"{name}.values", shape, expected, nan=True)
    apart = _apart(angles[..., 0], angles[..., 1])
    if not apart.any():
        what = f"no point with two known angles at least {_LEAST_APART_DEG:g} degrees apart"
        raise InputError(f"{name}.values: expected {expected}, but got {what}")
    same = np.isfinite(angles).all(axis=2) & ~apart
    return Grid(
        kept(np.where(same[..., None], np.nan, angles)),
        kept(arrays.pair(value.origin_mm, f"{name}.origin_mm")),
        arrays.positive(value.spacing_mm, f"{name}.spacing_mm"),
    )


def check_apart(angles_deg: ArrayLike, name: str) -> None:
    """Refuse two fibre directions that are equal, or nearly so, as two angles in radians are."""
    first, second = np.asarray(angles_deg, dtype=np.float64)
    if not _apart(first, second):
        radians = _apart(*np.degrees([first, second])) and max(abs(first), abs(second)) <= np.pi
        raise InputError(
            f"{name}: expected two directions at least {_LEAST_APART_DEG:g} degrees apart, but got {first:g} and "
            f"{second:g}{'; are they in radians?' if radians else ''}"
        )


def _apart(first: ArrayLike, second: ArrayLike) -> NDArray[np.bool_]:
    """Tell where two known directions cross at enough."""
    with np.errstate(invalid="ignore"):  # of an angle that is infinite
        apart = np.abs(np.subtract(first, second)) % 180
    return np.asarray((apart >= _LEAST_APART_DEG) & (apart <= 180 - _LEAST_APART_DEG))


def laid(
    angles: Floats | Grid | Draping, reference: Reference, ply_outline: Floats | None, name: str = _NAME
) -> Floats | Grid:
    """Return checked angles, those of a Draping read from the ply that is draped over the reference so.

    An `InputError` is raised if the ply cannot be draped so, as from a seed off the ply.
    """
    if not isinstance(angles, Draping):
        return angles
    try:  # over cut-outs, too: round them the net might close with another number of nodes on each side
        return _sampled(angles.on(reference, None if ply_outline is None else rings.split(ply_outline)[0]))
    except InputError as error:
        raise InputError(f"{name}: {error}") from None


def angles_at(angles: Floats | Grid, xy_mm: Floats) -> Floats:
    """Return the two angles at the nearest point of the grid, degrees.

    An `InputError` is raised if the nearest point is outside the grid, or its angles are not known.
    """
    found, outside = looked_up(angles, xy_mm)
    if not np.isfinite(found).all():
        lack = "lies outside their grid" if outside else "is NaN in their grid"
        raise InputError(
            f"{_NAME}: expected them at the pocket's centre, but {in_mm(xy_mm)} {lack}: "
            "give angles that cover the whole ply, as a larger grid or drape, or two numbers"
        )
    return found


def looked_up(angles: Floats | Grid, xy_mm: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Return the angles at the nearest points of the grid, (..., 2), NaN where not known; and which are outside it."""
    if not isinstance(angles, Grid):
        return np.broadcast_to(angles, xy_mm.shape), np.zeros(xy_mm.shape[:-1], dtype=np.bool_)
    at = angles.cells(xy_mm)
    outside = ~angles.holds(at)
    i, j = np.moveaxis(np.where(outside[..., None], 0, at), -1, 0)
    return np.where(outside[..., None], np.nan, angles.values[j, i]), outside


def points_of(grid: Grid) -> Floats:
    """Return the (ny, nx, 2) places of a grid's values, mold XY."""
    return np.dstack(np.meshgrid(grid.x_mm, grid.y_mm))


def _sampled(drape: Drape) -> Grid:
    """Read a drape on the grid of its own spacing that covers its nodes: plain values, which can be saved.

    A drape has one direction per segment of a fibre, that is one per cell, so a finer grid would add nothing.
    """
    low, high = drape.nodes_mm[:, :2].min(axis=0), drape.nodes_mm[:, :2].max(axis=0)
    nx, ny = np.ceil((high - low) / drape.spacing_mm).astype(int) + 1
    blank = Grid(np.empty((ny, nx, 0)), low, drape.spacing_mm)
    return Grid(drape.angles_deg(points_of(blank)), low, drape.spacing_mm)
