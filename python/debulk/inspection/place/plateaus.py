"""Flat places with a sharp edge in the ply: where it is torn or folded away, lies double, or lies on something.

Air lifts a ply in the shape of a bell. Where the ply's surface rises or falls by a fraction of a millimetre within a
millimetre, and is level beyond, there is the edge of something.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from debulk import _core
from debulk.arrays import Bools, Floats
from debulk.grid import Grid
from debulk.inspection.evidence.outline import PAST_MIDDLE
from debulk.inspection.evidence.pieces import grown, pieces_of
from debulk.inspection.evidence.ply_zones import PlyZones
from debulk.inspection.ply.ply_on_mold import Setup
from debulk.inspection.running.cycle import heed
from debulk.recipe import options
from debulk.results.finding import Finding
from debulk.surface import Reference
from debulk.verdict import Verdict
from debulk.words import in_cm2, in_mm, xy_of


@dataclass(frozen=True)
class Limits:
    """Of flat places with a sharp edge; bench/trust/trust.py has torn and folded plies, and things on them."""

    # Greatest ratio of the edge's width, between what is flat, to the plateau's; a bell has 0.33, one of flat top 0.18.
    edge_share: float = 0.12
    flat_share: float = 0.25  # of its height: by less a cell of a flat place is off it, and neighbours in an even part
    least_flat_share: float = 0.68  # of its cells
    least_rim_share: float = 0.2  # of its rim that must lie inside the ply
    least_even_share: float = 0.4  # least area of an even part without its rim, over that of the smallest plateau
    step_cells: int = 2  # an even part stands on the lowest ground within so many cells
    step_share: float = 0.6  # of its height: the ground lies lower by this much at least, along as much of its rim
    smooth_share: float = 0.5  # of its height: none if the reference steps the other way by more, or misses more
    reach_mm: tuple[float, float] = (6.0, 14.0)  # from the rim: where its edge ends, and the reference's slope with it


LIMITS = Limits()
_BESIDE, _CROSS = (cv2.getStructuringElement(shape, (3, 3)) for shape in (cv2.MORPH_RECT, cv2.MORPH_CROSS))


@dataclass(frozen=True)
class Plateau:
    """A flat place with a sharp edge."""

    centre_mm: tuple[float, float]
    """Mold XY."""
    area_mm2: float
    """Area of the cells that make it up, at about half of its height."""
    off_mm: float
    """Height above the laid ply; negative below it."""


def findings(plateaus: tuple[Plateau, ...], thickness_mm: float) -> list[Finding]:
    """Judge plateaus: INVALID where the ply is missing, UNDECIDED where it lies double or on something."""
    out = []
    for one in plateaus:
        place = f"{in_cm2(one.area_mm2)} at {in_mm(one.centre_mm)}"
        if one.off_mm < 0:
            left_mm = one.off_mm + thickness_mm
            reason = (
                f"the ply is missing over {place}: with a sharp edge the scan goes down to {left_mm:.2f} mm above the "
                "reference there: torn, cut out or folded away?"
            )
            remedy = (
                "lay it anew, or give the outline that it has with its cut-outs, or the outer one, and a mask over its "
                "windows"
            )
        else:
            reason = (
                f"the ply lies {one.off_mm:.2f} mm too high over {place}, flat and with a sharp edge, as air does not "
                "lift it: double, folded over, or with something on or below it?"
            )
            remedy = "look at it, put it right, and scan again"
        at_best = Verdict.INVALID if one.off_mm < 0 else Verdict.UNDECIDED
        reason = f"{reason} {remedy.capitalize()}"
        out.append(Finding("plateaus", at_best, reason, one.off_mm, unit="mm", place_mm=one.centre_mm, remedy=remedy))
    return out


def find(heights: Grid, zones: PlyZones, setup: Setup, stop: _core.Stop | None = None) -> tuple[Plateau, ...]:
    """Find the plateaus in a map of heights above the reference, NaN where nothing is known, largest first.

    Where the surface below the ply itself has a step, a ply that runs on smoothly is no plateau; nor is a ply in a
    groove that the fitted surface fills in, or on a rib that it cuts off. Without an outline, a place without a ply may
    lie beside the ply, and only raised plateaus are looked for.
    """
    prepared, recipe = setup.prepared, setup.recipe
    thickness, cell = recipe.material.thickness_mm, float(heights.spacing_mm)
    on = zones.cells(heights) & np.isfinite(heights.values)
    rise = cv2.medianBlur(np.where(on, heights.values - np.float32(thickness), np.float32(0)), 3)
    off = np.abs(rise) > PAST_MIDDLE * thickness
    least_mm2 = options.looked_for_mm2(recipe)
    if np.count_nonzero(off) * cell**2 < least_mm2:
        return ()
    out = []
    for sign in (1.0,) if setup.outline is None else (-1.0, 1.0):
        marks = off & (sign * rise > 0)
        if np.count_nonzero(marks) * cell**2 < least_mm2:
            continue
        around = round(LIMITS.reach_mm[0] / cell) + 1
        for (rows, columns), own in pieces_of(marks, 4).each(least_mm2 / cell**2, around):
            heed(stop, "the search for plateaus")
            seen = on[rows, columns]
            origin = heights.origin_mm + cell * np.array([columns.start, rows.start])
            for piece, height_mm in _pieces(sign * rise[rows, columns].astype(np.float64), own, seen, cell, least_mm2):
                if not 0 < height_mm <= recipe.segmentation.cut_height_mm - thickness:
                    continue
                row, column = np.nonzero(piece)
                xy = origin + cell * np.stack([column, row], axis=1)
                if sign * _of_reference(prepared.reference, piece, origin, cell) < -LIMITS.smooth_share * height_mm:
                    continue
                missed = prepared.missed_mm(xy)
                known = missed[np.isfinite(missed)]
                if len(known) and sign * float(np.median(known)) > LIMITS.smooth_share * height_mm:
                    continue
                out.append(Plateau(xy_of(xy.mean(axis=0)), len(row) * cell**2, sign * height_mm))
    return tuple(sorted(out, key=lambda one: -one.area_mm2))


def _pieces(rise: Floats, own: Bools, known: Bools, cell: float, least_mm2: float) -> Iterator[tuple[Bools, float]]:
    """Yield what may be a plateau, with its height: a whole place among (R, C) heights, or the even parts of one.

    A place that is not flat as a whole is searched for even parts, because something that lies on a pocket's foot forms
    one place with that pocket.
    """
    if _is_flat(rise[own]):
        yield own, _height(rise, own, known, cell, np.zeros_like(rise), LIMITS.least_rim_share)
        return
    uneven = cv2.dilate(rise, _BESIDE) - cv2.erode(rise, _BESIDE)
    ground: Floats = np.asarray(cv2.erode(rise, _BESIDE, iterations=LIMITS.step_cells), dtype=np.float64)
    even = pieces_of(own & (uneven < LIMITS.flat_share * rise), 4)
    for number in even.of_size(LIMITS.least_even_share * least_mm2 / cell**2):
        part = own & grown(even.labels == number)
        if np.count_nonzero(part) * cell**2 >= least_mm2 and _is_flat(rise[part]):
            yield part, _height(rise, part, known, cell, ground, LIMITS.step_share)


def _is_flat(rise: Floats) -> bool:
    level = float(np.median(rise))
    return bool(np.mean(np.abs(rise - level) < LIMITS.flat_share * level) >= LIMITS.least_flat_share)


def _height(rise: Floats, own: Bools, known: Bools, cell: float, ground: Floats, least_rim_share: float) -> float:
    """Return the height of a flat place that goes down sharply to the ground where the ply runs on; 0: it does not."""
    level = float(np.median(rise[own]))
    down = ground < (1 - LIMITS.step_share) * level
    rim = _rim_inside(own, known) & down
    length, around = int(np.count_nonzero(rim)), int(np.count_nonzero(_rim(own)))
    if length < least_rim_share * around:
        return 0.0
    edge = grown(rim, max(1, round(LIMITS.reach_mm[0] / cell))) & known & down
    quarters = LIMITS.flat_share, 1 - LIMITS.flat_share
    low, high = (int(np.count_nonzero(edge & (rise - ground > q * (level - ground)))) for q in quarters)
    edge_mm, wide_mm = (low - high) / length * cell, 4 * int(np.count_nonzero(own)) / around * cell
    return level if edge_mm < LIMITS.edge_share * wide_mm else 0.0


def _rim(own: Bools) -> Bools:
    """Return the mask of a piece's cells that have a neighbour outside it."""
    return own & ~np.asarray(cv2.erode(own.astype(np.uint8), _CROSS, borderValue=0), dtype=np.bool_)


def _rim_inside(own: Bools, known: Bools) -> Bools:
    """Return the rim without the cells near the ply's end, or near heights that are not known."""
    far_inside = cv2.erode(known.astype(np.uint8), _BESIDE, iterations=2, borderValue=0)
    return _rim(own) & np.asarray(far_inside, dtype=np.bool_)


def _of_reference(reference: Reference, own: Bools, origin: Floats, cell: float) -> float:
    """Return how far the reference steps up into a piece, across its rim, beyond its slope on both sides."""
    blurred = cv2.GaussianBlur(own.astype(np.float64), (0, 0), max(1.0, 4.0 / cell))
    down_y, down_x = np.gradient(-blurred)
    rim = _rim(own)
    outwards = np.stack([down_x[rim], down_y[rim]], axis=1)
    outwards /= np.maximum(np.linalg.norm(outwards, axis=1, keepdims=True), 1e-12)
    row, column = np.nonzero(rim)
    at = origin + cell * np.stack([column, row], axis=1)
    near, far = LIMITS.reach_mm
    places = np.stack([at + way * outwards for way in (-far, -near, near, far)])
    low, high = reference.box_mm
    inside = ((places >= low) & (places <= high)).all(axis=(0, 2))
    if not inside.any():
        return 0.0
    f = reference.height(places[:, inside].reshape(-1, 2)).reshape(4, -1)
    slope = (f[0] - f[1] + f[2] - f[3]) / (2 * (far - near))  # inwards
    return float(np.median(f[1] - f[2] - 2 * near * slope))
