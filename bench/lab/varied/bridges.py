"""Bridges by sections of the true ply.

Along every fibre that is too short for the mold below it, the ply is a string under the tension T and the vacuum P. It
lies on the mold or spans it in arcs of the radius T/P, which is such that the string has the fibre's length. Friction
holds T up to μ P d, where d is the distance to the ply's edge (docs/model.md, section 5). If T is more, the fibre slips
until the radius is μ d. It then stands at the height that this radius gives, or is drawn in.

The package judges such sections too, from the scan. This is an independent check with its own code, on the true mold
and the true ply, without noise or filters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk import pocket
from debulk.inspection.ply.fibre_angles import angles_at
from debulk.recipe import Recipe
from lab.varied.regions import label_regions
from lab.varied.scanning import VariedLayup

Floats = NDArray[np.float64]

STEP_MM, APART_MM = 0.5, 4.0  # step along a fibre, and distance from one fibre to the next
AROUND_MM = 40.0  # width of laid ply round a pocket that may come off the mold as well
LAID_MM = 0.03  # ply lower than this lies on the mold
SHORT_MM = 0.005  # a fibre counts as too short if it is shorter than the mold by more than this
RADII_MM = (1.0, 1e5)
_CELL = 0.5 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])  # half of one, round a box of cells
FAR_MM = 1500.0


@dataclass(frozen=True)
class Section:
    """A fibre that is too short: by how much, and the string of its length over the mold."""

    short_mm: float
    radius_mm: float  # T/P; inf: even the straightest string is too long
    held_mm: float  # μ d, the largest radius that friction holds
    bridge_mm: float  # height of the ply's upper side at the smaller of these radii; 0: it lies down

    @property
    def held(self) -> bool:
        """Return whether friction holds the fibre as it was laid; if not, it slips."""
        return self.radius_mm < self.held_mm


def string(s: Floats, z: Floats, radius_mm: float) -> Floats:
    """Return the heights of a string pressed on a section of the mold: the section's upper hull by arcs of a radius."""
    flat = z - s * s / (2 * radius_mm)
    on: list[int] = []
    for k in range(len(s)):
        while len(on) > 1:
            a, b = on[-2], on[-1]
            if (flat[b] - flat[a]) * (s[k] - s[a]) > (flat[k] - flat[a]) * (s[b] - s[a]):
                break
            on.pop()
        on.append(k)
    return np.interp(s, s[on], flat[on]) + s * s / (2 * radius_mm)


def length(s: Floats, z: Floats) -> float:
    """Return the length of a section."""
    return float(np.hypot(np.diff(s), np.diff(z)).sum())


def solved(s: Floats, z: Floats, short_mm: float) -> float:
    """Return the radius at which the string is shorter than the mold by `short_mm`."""
    low, high = RADII_MM
    whole = length(s, z)
    if whole - length(s, string(s, z, high)) < short_mm:
        return np.inf
    for _ in range(24):
        middle = float(np.sqrt(low * high))
        if whole - length(s, string(s, z, middle)) < short_mm:
            low = middle
        else:
            high = middle
    return high


def highest_mm(layup: VariedLayup, recipe: Recipe) -> float:
    """Return the height of the highest bridge anywhere on a ply, found without any report; 0: it bridges nothing."""
    truth = layup.truth

    def height(x: Floats, y: Floats) -> Floats:
        return truth.ply_height_above_mold(np.stack([x, y], axis=-1))

    feet = label_regions(height, layup.ply_outline, truth.thickness_mm + LAID_MM)
    boxes = (feet.box(label) for label in range(1, int(feet.values.max()) + 1))
    around = (np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]) + _CELL for x0, y0, x1, y1 in boxes)
    return max((one.bridge_mm for foot in around for one in sections(layup, foot, recipe)), default=0.0)


def sections(layup: VariedLayup, foot: Floats, recipe: Recipe) -> list[Section]:
    """Return all fibres over a pocket with this foot, (M, 2) mm, that are too short."""
    centre = 0.5 * (foot.min(axis=0) + foot.max(axis=0))
    reach = 0.5 * float(np.hypot(*np.ptp(foot, axis=0))) + AROUND_MM
    s = np.arange(-reach, reach, STEP_MM)
    short = []
    for angle in np.radians(angles_at(np.array(layup.fibre_angles_deg), centre)):
        along = np.array([np.cos(angle), np.sin(angle)])
        across = np.array([-along[1], along[0]])
        for aside in np.arange(-reach, reach, APART_MM):
            xy = centre + s[:, None] * along + aside * across
            gap = np.maximum(layup.truth.ply_height_above_mold(xy) - layup.truth.thickness_mm, 0.0)
            up = _over(gap > LAID_MM, pocket.inside(foot, xy))
            if not up.any():
                continue
            mold = layup.truth.mold_height(xy)
            lacks = length(s, mold) - length(s, mold + np.where(up, gap, 0.0))
            if lacks > SHORT_MM:
                first, last = np.flatnonzero(up)[[0, -1]]
                ways = [_way_to_edge(layup, xy[k], sign * along) for k, sign in ((first, -1), (last, 1))]
                on = _on_ply(layup, xy, first, last)  # no string goes on beside the ply
                radius, held = solved(s[on], mold[on], lacks), recipe.material.friction * min(ways)
                short.append(Section(lacks, radius, held, _stands(s[on], mold[on], min(radius, held), recipe)))
    return short


def _stands(s: Floats, mold: Floats, radius_mm: float, recipe: Recipe) -> float:
    """Return the height of a string plus the consolidated ply, which a bridge of the net includes as well."""
    gap_mm = float((string(s, mold, radius_mm) - mold).max()) if radius_mm > 0 else 0.0
    return gap_mm + recipe.material.thickness_mm / recipe.material.bulk_factor if gap_mm > LAID_MM else 0.0


def _over(up: NDArray[np.bool_], foot: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return those pieces of a fibre that stand off the mold and reach over the foot."""
    pieces = np.cumsum(np.diff(up, prepend=False))
    return up & np.isin(pieces, pieces[up & foot])


def _on_ply(layup: VariedLayup, xy: Floats, first: int, last: int) -> slice:
    """Return the points of a section that the ply reaches from its first to its last one off the mold."""
    off = np.flatnonzero(~pocket.inside(layup.ply_outline, xy))
    return slice(max(off[off < first] + 1, default=0), min(off[off > last], default=len(xy)))


def _way_to_edge(layup: VariedLayup, start: Floats, along: Floats) -> float:
    t = np.arange(0.0, FAR_MM, 5.0)
    beside = ~pocket.inside(layup.ply_outline, start + t[:, None] * along)
    return float(t[np.argmax(beside)]) if beside.any() else FAR_MM
