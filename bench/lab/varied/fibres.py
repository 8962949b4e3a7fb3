"""Excess length of the fibres over a known pocket, by quadrature of the lengths of the ply's and the mold's curve."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lab.varied.polygons import inside
from lab.varied.regions import Height, Lattice

Floats = NDArray[np.float64]

TOUCH_MM = 1e-3
"""A ply nearer to the mold than this lies on it."""
HELD_MM = 40.0
"""Contact between a foot and the ply's edge, along the fibre, that holds the fibre with certainty: it slips over 6 to
30 mm (docs/model.md, section 6)."""
_BESIDE_MM = 60.0


@dataclass(frozen=True)
class Excess:
    """Largest excess lengths of fibres from foot to foot, mm."""

    any_mm: float = 0.0
    """Largest of all fibres over the pocket, including those that could slip out at the ply's edge."""
    held_mm: float = 0.0
    """Largest of the fibres held at both ends by at least 40 mm of contact; this excess cannot go anywhere."""
    angle_deg: float = 0.0
    """Direction of the fibre of `held_mm`."""


def excess(
    height: Height,
    mold: Height,
    outline: Floats,
    thickness_mm: float,
    angles_deg: tuple[float, float],
    labels: Lattice,
    label: int,
    foot_box: tuple[float, float, float, float],
) -> Excess:
    """Largest excess lengths of fibres over the region `label`, in vertical planes along the directions.

    `height` is that of the ply's upper side above the mold; `foot_box` contains the pocket's foot.
    """
    best = Excess()
    for angle in angles_deg:
        lengths, ways = _runs(height, mold, outline, thickness_mm, angle, labels, label, foot_box)
        if lengths.size == 0:
            continue
        held = float(np.where(ways >= HELD_MM, lengths, 0.0).max())
        best = Excess(
            max(best.any_mm, float(lengths.max())),
            max(best.held_mm, held),
            angle if held > best.held_mm else best.angle_deg,
        )
    return best


def _runs(
    height: Height,
    mold: Height,
    outline: Floats,
    thickness_mm: float,
    angle: float,
    labels: Lattice,
    label: int,
    foot_box: tuple[float, float, float, float],
) -> tuple[Floats, Floats]:
    """Excess of each stretch of fibre that is off the mold and crosses the region, and the shorter way to an edge."""
    c, s = np.cos(np.deg2rad(angle)), np.sin(np.deg2rad(angle))
    x, y = labels.places(labels.values == label)
    across = np.arange((c * y - s * x).min(), (c * y - s * x).max() + 1, max(0.5, np.ptp(c * y - s * x) / 120))
    corners = np.array([(foot_box[i], foot_box[j]) for i in (0, 2) for j in (1, 3)])
    reach = corners @ np.array([c, s])
    step = float(np.clip((np.ptp(reach)) / 1200, 0.1, 0.75))
    along = np.arange(reach.min() - _BESIDE_MM, reach.max() + _BESIDE_MM, step)
    px, py = c * along[None, :] - s * across[:, None], s * along[None, :] + c * across[:, None]
    on_ply = inside(outline, px, py)
    gap = np.where(on_ply, height(px, py) - thickness_mm, 0.0)
    z = mold(px, py)
    off = gap > TOUCH_MM
    more = np.hypot(step, np.diff(z + gap, axis=1)) - np.hypot(step, np.diff(z, axis=1))
    # A segment belongs to the stretch at either of its ends, but not where it leaves the ply.
    more = np.where((off[:, :-1] | off[:, 1:]) & on_ply[:, :-1] & on_ply[:, 1:], more, 0.0)
    begins = off & ~np.pad(off, ((0, 0), (1, 0)))[:, :-1]
    ends = off & ~np.pad(off, ((0, 0), (0, 1)))[:, 1:]
    number = np.cumsum(begins.ravel()).reshape(off.shape)  # 1, 2, ... over all lines
    count = int(number.max(initial=0))
    owner = np.where(off[:, :-1], number[:, :-1], np.where(off[:, 1:], number[:, 1:], 0))
    lengths = np.bincount(owner.ravel(), more.ravel(), count + 1)[1:]
    mine = off & (labels.at(px, py) == label)
    crosses = np.bincount(np.where(mine, number, 0).ravel(), minlength=count + 1)[1:] > 0
    column = np.broadcast_to(np.arange(off.shape[1]), off.shape)
    contact = np.cumsum(on_ply & ~off, axis=1)
    leave = np.maximum.accumulate(np.where(on_ply, -1, column), axis=1)
    leave_after = np.minimum.accumulate(np.where(on_ply, off.shape[1], column)[:, ::-1], axis=1)[:, ::-1]
    line, first = np.nonzero(begins)
    _, last = np.nonzero(ends)
    before, after = leave[line, first], leave_after[line, last]
    way_before = np.where(before < 0, np.inf, step * (contact[line, first] - contact[line, np.maximum(before, 0)]))
    at_end = contact[line, np.minimum(after, off.shape[1] - 1)]
    way_after = np.where(after >= off.shape[1], np.inf, step * (at_end - contact[line, last]))
    return lengths[crosses].astype(np.float64), np.minimum(way_before, way_after)[crosses]
