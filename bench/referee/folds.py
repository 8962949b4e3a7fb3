"""The worst fold at the end of a fine simulation: its place, direction and length, and the excess it has gathered."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from debulk import surface

TOUCH_MM = 0.03  # nodes nearer to the mold than this lie on it
_WEST, _EAST = (1, 3), (0, 2)  # columns of the neighbours back and ahead, by fibre


@dataclass(frozen=True)
class Fold:
    """The highest fold; all zero if the ply lies flat."""

    height_mm: float = 0.0  # from the mold, along its normal
    x_mm: float = 0.0
    y_mm: float = 0.0
    direction_deg: float = 0.0  # of the crest, counter-clockwise from mold +x, 0 to 180
    length_mm: float = 0.0  # of the part of the crest that is higher than half the height
    gathered_mm: float = 0.0  # largest excess of a fibre's piece between the fold's two feet
    folds: int = 0  # number of folds higher than half of this one


def mold_feet(points: np.ndarray, reference: surface.Reference) -> tuple[np.ndarray, np.ndarray]:
    """Return (N, 2) nearest points of the mold, seen from above, and (N,) distances from it, negative below."""
    xy = points[:, :2].copy()
    for _ in range(12):  # each step contracts the error by height times curvature, which is below 0.1 here
        xy = points[:, :2] + (points[:, 2] - reference.height(xy))[:, None] * reference.gradient(xy)
    rise = points[:, 2] - reference.height(xy)
    slope = np.sum(reference.gradient(xy) ** 2, axis=1)
    return xy, rise * np.sqrt(1 + slope)


def fibres(neighbours: np.ndarray, fibre: int) -> list[np.ndarray]:
    """Return the numbers of the nodes of every fibre of one family, from end to end."""
    back, ahead = neighbours[:, _WEST[fibre]], neighbours[:, _EAST[fibre]]
    found = []
    for first in np.flatnonzero((back < 0) & (ahead >= 0)):
        line = [int(first)]
        while (following := int(ahead[line[-1]])) >= 0:
            line.append(following)
        found.append(np.array(line))
    return found


def mold_length(a: np.ndarray, b: np.ndarray, chords: int, reference: surface.Reference) -> float:
    """Return the length of the mold over the straight line from a to b, in as many chords as the fibre has."""
    xy = a + (b - a) * np.linspace(0, 1, chords + 1)[:, None]
    line = np.column_stack([xy, reference.height(xy)])
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def worst_fold(nodes: np.ndarray, neighbours: np.ndarray, kinds: np.ndarray, reference: surface.Reference) -> Fold:
    """Find the highest fold of a debulked net; bridges, where the ply is too short for the mold, are not folds."""
    feet, gaps = mold_feet(nodes, reference)
    gathered = np.zeros(len(nodes))
    top = np.zeros(len(nodes), dtype=bool)
    for fibre in (0, 1):
        for line in fibres(neighbours, fibre):
            heights = gaps[line]
            for k in range(1, len(line) - 1):
                if heights[k] <= TOUCH_MM or heights[k] < heights[k - 1] or heights[k] <= heights[k + 1]:
                    continue
                first, last = _foot(heights, k, -1), _foot(heights, k, +1)
                piece = nodes[line[first : last + 1]]
                length = float(np.linalg.norm(np.diff(piece, axis=0), axis=1).sum())
                more = length - mold_length(feet[line[first]], feet[line[last]], last - first, reference)
                if more > 0:
                    top[line[k]] = True
                    gathered[line[k]] = max(gathered[line[k]], more)
    top &= kinds != 1
    if not top.any():
        return Fold()
    peak = int(np.argmax(np.where(top, gaps, -1)))
    half = gaps > gaps[peak] / 2
    part = _joined(peak, half, neighbours)
    ridge = np.flatnonzero(part & top)
    flat = feet[ridge] - feet[ridge].mean(axis=0)
    along = np.linalg.svd(flat, full_matrices=False)[2][0] if len(ridge) > 1 else np.zeros(2)
    others, count = top & half & ~part, 1
    while others.any():
        others &= ~_joined(int(np.argmax(others)), half, neighbours)
        count += 1
    return Fold(
        height_mm=float(gaps[peak]),
        x_mm=float(nodes[peak, 0]),
        y_mm=float(nodes[peak, 1]),
        direction_deg=float(np.degrees(np.arctan2(along[1], along[0])) % 180),
        length_mm=float(np.ptp(flat @ along)),
        gathered_mm=float(gathered[ridge].max()),
        folds=count,
    )


def _foot(heights: np.ndarray, peak: int, step: int) -> int:
    """Return where the fold ends: on the mold, in the valley before the next fold, or at the net's border."""
    lowest = peak
    k = peak + step
    while 0 <= k < len(heights):
        if heights[k] < heights[lowest]:
            lowest = k
        if heights[lowest] <= TOUCH_MM or heights[k] > heights[lowest] + TOUCH_MM:
            break
        k += step
    return lowest


def _joined(start: int, of: np.ndarray, neighbours: np.ndarray) -> np.ndarray:
    """Return the nodes that are joined to a node by segments within a set."""
    found = np.zeros(len(of), dtype=bool)
    found[start] = True
    edge = np.array([start])
    while edge.size:
        beside = neighbours[edge].ravel()
        beside = np.unique(beside[beside >= 0])
        edge = beside[of[beside] & ~found[beside]]
        found[edge] = True
    return found
