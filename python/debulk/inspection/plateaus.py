"""Flat places with a sharp edge, in the ply: where it is torn or folded away, where it lies double, or on something.

Air lifts a ply in a bell; what rises or falls by a fraction of a millimetre from one millimetre to the next, and stays
level then, is the edge of something.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk.grid import Grid
from debulk.inspection.stopping import heed
from debulk.surface import Reference
from debulk.verdict import Judgement, Verdict

if TYPE_CHECKING:
    from debulk.inspection.ply_zones import PlyZones
    from debulk.recipe import Recipe

__all__ = ["Plateau", "doubts", "find"]

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

_OFF = 0.55  # thicknesses off the ply's level: half of one is the middle of its edge
_LARGEST_MM2 = 200.0  # what is larger is looked for, however large the smallest pocket that is asked for
_CELL_MM = 1.5  # a finer map is thinned to it: the smallest plateau is 14 mm wide
_QUARTERS = (0.25, 0.75)  # of a plateau's height, between which its edge is measured
_ROUND_MM = 6.0  # about it, in which that edge lies
_SHARP_MM = 3.5  # from one quarter to the other: of a step two cells of the map at most
_SLENDER = 0.12  # that width over the plateau's: of a bell's 0.33
_FLAT, _LEAST_FLAT = 0.25, 0.68  # of its height, that a third of its cells at most may be off
_LEAST_RIM, _LEAST_RIM_MM = 0.2, 12.0  # of a rim, inside the ply
_SMOOTH = 0.5  # of its height: the reference steps by less there, the other way
_REACH_MM = (6.0, 14.0)  # to each side of the edge, between which the reference's slope is read


@dataclass(frozen=True)
class Plateau:
    """A flat place with a sharp edge.

    Attributes
    ----------
    centre_mm
        Mold XY.
    area_mm2
        At half of its height.
    off_mm
        Above the laid ply; below it: negative.
    """

    centre_mm: tuple[float, float]
    area_mm2: float
    off_mm: float


def doubts(plateaus: tuple[Plateau, ...], thickness_mm: float) -> list[Judgement]:
    """INVALID where the ply is missing, UNDECIDED where it lies double or on something."""
    out = []
    for one in plateaus:
        x, y = one.centre_mm
        place = f"{one.area_mm2 / 100:.2g} cm² at ({x:.0f}, {y:.0f}) mm"
        if one.off_mm < 0:
            left_mm = one.off_mm + thickness_mm
            reason = (
                f"the ply is missing over {place}: with a sharp edge the scan goes down to {left_mm:.2f} mm above the "
                "reference there: torn, cut out or folded away? Lay it anew, or give the outline that it has"
            )
        else:
            reason = (
                f"the ply lies {one.off_mm:.2f} mm too high over {place}, flat and with a sharp edge, as air does not "
                "lift it: double, folded over, or with something on or below it? Look at it, and scan again"
            )
        out.append(Judgement(Verdict.INVALID if one.off_mm < 0 else Verdict.UNDECIDED, reason))
    return out


def find(
    heights: Grid,
    zones: PlyZones,
    reference: Reference,
    recipe: Recipe,
    stop: _core.Stop | None = None,
    *,
    outlined: bool,
) -> tuple[Plateau, ...]:
    """Find them in a map of heights above the reference, largest first.

    Parameters
    ----------
    heights
        NaN where nothing is known; all of the ply.
    zones
        Where that is.
    reference
        The surface below it: where it steps itself, a ply that runs on smoothly is no plateau.
    recipe
        The sections level, material and segmentation.
    stop
        Heeded between one place and the next.
    outlined
        Whether the ply's outline is known: without it, where the ply is missing there may be none.
    """
    every = max(1, int(_CELL_MM / heights.spacing_mm))
    heights = Grid(heights.values[::every, ::every], heights.origin_mm, every * heights.spacing_mm)
    thickness, cell = recipe.material.thickness_mm, float(heights.spacing_mm)
    least = max(_OFF * thickness, recipe.level.tol_mm)
    on = zones.cells(heights) & np.isfinite(heights.values)
    rise = cv2.medianBlur(np.where(on, heights.values - np.float32(thickness), np.float32(0)), 3)
    off = np.abs(rise) > least
    least_mm2 = min(recipe.segmentation.area_tol_mm2, _LARGEST_MM2)
    if np.count_nonzero(off) * cell**2 < least_mm2:
        return ()
    out = []
    for sign in (-1.0, 1.0) if outlined else (1.0,):
        _, labels, stats, centroids = cv2.connectedComponentsWithStats(
            (off & (sign * rise > 0)).astype(np.uint8), connectivity=4
        )
        large = np.flatnonzero(stats[1:, cv2.CC_STAT_AREA] * cell**2 >= least_mm2) + 1
        for label in large:
            heed(stop, "the search for plateaus")
            left, top, wide, high = (int(stats[label, k]) for k in range(4))
            around = round(_ROUND_MM / cell) + 1
            rows = slice(max(0, top - around), top + high + around)
            columns = slice(max(0, left - around), left + wide + around)
            own = labels[rows, columns] == label
            height_mm = _height(sign * rise[rows, columns].astype(np.float64), own, on[rows, columns], cell)
            if not 0 < height_mm <= recipe.segmentation.cut_height_mm - thickness:
                continue
            origin = heights.origin_mm + cell * np.array([columns.start, rows.start])
            if sign * _of_reference(reference, own, origin, cell) < -_SMOOTH * height_mm:
                continue
            x, y = heights.origin_mm + cell * centroids[label]
            area_mm2 = float(stats[label, cv2.CC_STAT_AREA]) * cell**2
            out.append(Plateau((float(x), float(y)), area_mm2, sign * height_mm))
    return tuple(sorted(out, key=lambda one: -one.area_mm2))


def _height(rise: Floats, own: Bools, known: Bools, cell: float) -> float:
    """Return the height of a plateau among (R, C) heights; 0: it is none, for it goes down gradually."""
    level = float(np.median(rise[own]))
    flat = np.mean(np.abs(rise[own] - level) < _FLAT * level)
    all_rim = _rim(own)
    ends = np.pad(~known, 1, constant_values=True)
    rim = all_rim & ~_near(ends, 2)[1:-1, 1:-1]  # not where the ply, or what is known of it, ends
    edge = _near(rim, max(1, round(_ROUND_MM / cell))) & known
    low, high = (int(np.count_nonzero(edge & (rise > share * level))) for share in _QUARTERS)
    length = int(np.count_nonzero(rim))
    if flat < _LEAST_FLAT or length < max(_LEAST_RIM * np.count_nonzero(all_rim), _LEAST_RIM_MM / cell):
        return 0.0
    edge_mm = (low - high) / length * cell
    wide_mm = 4 * int(np.count_nonzero(own)) / int(np.count_nonzero(all_rim)) * cell
    return level if edge_mm < min(_SHARP_MM, _SLENDER * wide_mm) else 0.0


def _near(marks: Bools, cells: int) -> Bools:
    """Tell which cells are as near to a marked one as that, along rows and columns."""
    return np.asarray(cv2.dilate(marks.astype(np.uint8), np.ones((3, 3), np.uint8), iterations=cells) > 0)


def _rim(own: Bools) -> Bools:
    """Cells of a piece beside one that is not."""
    padded = np.pad(own, 1)
    inner = padded[:-2, 1:-1] & padded[2:, 1:-1] & padded[1:-1, :-2] & padded[1:-1, 2:]
    return own & ~inner


def _of_reference(reference: Reference, own: Bools, origin: Floats, cell: float) -> float:
    """Return how far the reference steps up into a piece, across its rim, beyond its slope on both sides."""
    blurred = cv2.GaussianBlur(own.astype(np.float64), (0, 0), max(1.0, 4.0 / cell))
    down_y, down_x = np.gradient(-blurred)
    rim = _rim(own)
    outwards = np.stack([down_x[rim], down_y[rim]], axis=1)
    outwards /= np.maximum(np.linalg.norm(outwards, axis=1, keepdims=True), 1e-12)
    row, column = np.nonzero(rim)
    at = origin + cell * np.stack([column, row], axis=1)
    near, far = _REACH_MM
    places = np.stack([at + way * outwards for way in (-far, -near, near, far)])
    corners = _core.surface.extent(reference)
    inside = ((places >= corners.min(axis=0)) & (places <= corners.max(axis=0))).all(axis=(0, 2))
    if not inside.any():
        return 0.0
    f = reference.height(places[:, inside].reshape(-1, 2)).reshape(4, -1)
    slope = (f[0] - f[1] + f[2] - f[3]) / (2 * (far - near))  # inwards
    return float(np.median(f[1] - f[2] - 2 * near * slope))
