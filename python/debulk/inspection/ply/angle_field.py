"""A field of fibre directions: what a drape or a sensor says from place to place, where it says nothing, and its shear.

A sensor's gaps are filled from how the ply was meant to lie, if that is given, because both were compared where the
sensor saw the ply. What remains is a gap: nothing is made up there, and a fibre that may be too long in it is INVALID.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from debulk import pocket
from debulk._core import InputError
from debulk.arrays import Bools, Floats
from debulk.grid import Grid
from debulk.inspection.ply.fibre_angles import looked_up, points_of
from debulk.surface import Reference

_MEAN_MM = 10.0
_AGREE = np.cos(np.radians(2 * 20.0))  # of doubled angles that scatter by 20 degrees
_LEAST_APART_MM = _MEAN_MM / 2  # of the points of what is made from a field: a sensor's may be far finer


@dataclass(frozen=True)
class Turned:
    """How far the fibres of a ply run from where they were meant to: the medians over the places where both are known.

    Both are of the family that is farther off; `signed_deg` is positive if it runs counter-clockwise from nominal.
    """

    median_deg: float
    signed_deg: float
    places: int


def nominal_on(nominal: Floats | Grid, measured: Floats | Grid) -> Grid:
    """Return nominal angles on the grid of the measured ones.

    An `InputError` is raised if the measured angles are no field.
    """
    if not isinstance(measured, Grid):
        raise InputError(
            "nominal_angles_deg: expected them only with a field of measured ones, a Grid as fibre_angles_deg, but "
            "that is two angles: give the nominal ones as fibre_angles_deg"
        )
    values = np.array(looked_up(nominal, points_of(measured))[0])
    return Grid(values, measured.origin_mm, measured.spacing_mm)


def completed(measured: Grid, nominal: Grid) -> Grid:
    """Return measured angles, each pair in the order that is nearer to nominal, and nominal ones in their gaps.

    A sensor sees two directions, and not which of the two families was laid as the first.
    """
    given = measured.values
    swapped = given[..., ::-1]
    off, off_swapped = (np.abs(_apart(one, nominal.values)).sum(axis=2) for one in (given, swapped))
    values = np.where((off_swapped < off)[..., None], swapped, given)
    known = np.isfinite(values).all(axis=2, keepdims=True)
    return Grid(np.where(known, values, nominal.values), measured.origin_mm, measured.spacing_mm)


def turned(measured: Grid, nominal: Grid, ply_outline: Floats | None) -> Turned:
    """Compare measured angles with nominal ones on the ply.

    An `InputError` is raised if there is no place at which both are known.
    """
    apart = _apart(completed(measured, nominal).values, nominal.values)
    known = np.isfinite(measured.values).all(axis=2) & np.isfinite(apart).all(axis=2) & on_ply(measured, ply_outline)
    if not known.any():
        raise InputError("nominal_angles_deg: expected them where the angles were measured, but no place has both")
    medians = np.median(np.abs(apart[known]), axis=0)
    worst = int(np.argmax(medians))
    return Turned(float(medians[worst]), float(np.median(apart[known][:, worst])), int(known.sum()))


def averaged(field: Grid) -> Grid:
    """Return at each place the mean of all directions known within 10 mm along x and y.

    A sensor's noise is less so, and single drop-outs are no gaps. Where those directions scatter by more than 20
    degrees, as families that change places do, none is known. On a mold with a radius of 400 mm directions 10 mm apart
    differ by less than a degree, as long as the shear is below 30 degrees. Those that are given farther apart stay as
    they are, but must agree with their neighbours, too.

    An `InputError` is raised if none is known anywhere.
    """
    reach = min(max(1, int(_MEAN_MM / field.spacing_mm)), max(field.values.shape))
    known = np.isfinite(field.values).all(axis=2)
    twice = np.radians(2 * np.where(known[..., None], field.values, 0.0))
    sums, count = (
        cv2.blur(one, (2 * reach + 1,) * 2, borderType=cv2.BORDER_CONSTANT)
        for one in (np.dstack([np.cos(twice), np.sin(twice)]) * known[..., None], known.astype(np.float64))
    )
    c, s = sums[..., :2], sums[..., 2:]
    mean = np.degrees(np.arctan2(s, c)) / 2
    some = count > 0.5 / (2 * reach + 1) ** 2  # none leave the rounding of sums
    agree = (np.hypot(c, s) > _AGREE * count[..., None]).all(axis=2) & some
    if not agree.any():
        raise InputError(
            "fibre_angles_deg.values: expected directions that agree with those round them within 20 degrees, but none "
            "do: give the same family first everywhere, or nominal angles (nominal_angles_deg), which tell them apart"
        )
    if field.spacing_mm > _MEAN_MM:
        near, agree = field.values, agree | ~known
        if agree.all():
            return field
    else:
        near = np.where(known[..., None], field.values + _apart(mean, field.values), mean)
    return Grid(np.where(agree[..., None], near, np.nan), field.origin_mm, field.spacing_mm)


def across_gaps(field: Grid) -> Grid:
    """Return a field for fibre lines, which has directions in its gaps, too: those of the nearest known place.

    The second family crosses the first at a right angle there. So one of the two runs within 45 degrees of any
    direction, and shows at least half of the excess of a fibre that runs so.
    """
    known = np.isfinite(field.values).all(axis=2)
    if known.all():
        return field
    _, labels = cv2.distanceTransformWithLabels(
        (~known).astype(np.uint8), cv2.DIST_L2, 5, labelType=cv2.DIST_LABEL_PIXEL
    )
    nearest = np.zeros(int(labels.max()) + 1, dtype=np.intp)
    nearest[labels[known]] = np.flatnonzero(known)
    first = field.values[..., 0].ravel()[nearest[labels]]
    values = np.where(known[..., None], field.values, np.dstack([first, first + 90]))
    return Grid(values, field.origin_mm, field.spacing_mm)


def gaps_of(field: Grid, reference: Reference, ply_outline: Floats | None) -> Grid | None:
    """Return where on the ply no directions are known, as flags 5 mm or a field's spacing apart; None: nowhere."""
    around = reference.box_mm if ply_outline is None else ply_outline
    low, spacing_mm = around.min(axis=0), max(_LEAST_APART_MM, float(field.spacing_mm))
    nx, ny = np.ceil((around.max(axis=0) - low) / spacing_mm).astype(int) + 1
    gaps = Grid(np.zeros((ny, nx), dtype=np.bool_), low, spacing_mm)
    gaps.values[...] = ~np.isfinite(looked_up(field, points_of(gaps))[0]).all(axis=2)
    if gaps.values.any():
        gaps.values[...] &= on_ply(gaps, ply_outline)
    return gaps if gaps.values.any() else None


def shear_of(field: Grid, reference: Reference, ply_outline: Floats | None) -> Grid:
    """Return by how much the two fibres cross otherwise than at a right angle in the mold's tangent plane, degrees.

    NaN where they are not known, and off the ply or the reference. Points are 5 mm apart, or as far as the field's.
    """
    step = max(1, int(np.ceil(_LEAST_APART_MM / field.spacing_mm)))
    coarse = Grid(field.values[::step, ::step], field.origin_mm, step * field.spacing_mm)
    xy = points_of(coarse)
    low, high = reference.box_mm
    within = (xy >= low).all(axis=2) & (xy <= high).all(axis=2)
    known = within & np.isfinite(coarse.values).all(axis=2) & on_ply(coarse, ply_outline)
    slope = reference.gradient(xy[known])
    angles = np.radians(coarse.values[known])
    u, v = (np.stack([np.cos(a), np.sin(a)], axis=1) for a in angles.T)
    u, v = (np.column_stack([one, (one * slope).sum(axis=1)]) for one in (u, v))
    crossing = np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), np.abs((u * v).sum(axis=1)))
    values = np.full(known.shape, np.nan, dtype=np.float32)
    values[known] = 90 - np.degrees(crossing)
    return Grid(values, coarse.origin_mm, coarse.spacing_mm)


def on_ply(grid: Grid, ply_outline: Floats | None) -> Bools:
    """Return which points of a grid lie on the ply, (ny, nx); all of them if the outline is not known."""
    shape = grid.values.shape[:2]
    if ply_outline is None:
        return np.ones(shape, dtype=np.bool_)
    return pocket.inside(ply_outline, points_of(grid).reshape(-1, 2)).reshape(shape)


def _apart(angles_deg: Floats, nominal_deg: Floats) -> Floats:
    """Return the angle from nominal axes to others, degrees in [-90, 90): the directions of an axis are equal."""
    return (angles_deg - nominal_deg + 90) % 180 - 90
