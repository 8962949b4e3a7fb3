"""Polylines in space: their length and their direction."""

from __future__ import annotations

import math

import numpy as np

from debulk.arrays import Floats


def length_mm(line: Floats) -> float:
    """Return the length of a line through (K, 2) or (K, 3) points."""
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def perimeter_mm(outline: Floats) -> float:
    """Return the length of a line through (K, 2) corners and back to the first."""
    return length_mm(np.vstack([outline, outline[:1]]))


def axis(line: Floats) -> Floats:
    """Return the (3,) unit vector of a line's longest principal axis, with every segment weighted by its length."""
    steps, middles = np.diff(line, axis=0), (line[1:] + line[:-1]) / 2
    weights = np.linalg.norm(steps, axis=1)
    off = middles - weights @ middles / weights.sum()
    moments = (weights[:, None] * off).T @ off + (weights[:, None] * steps).T @ steps / 12
    return np.asarray(np.linalg.eigh(moments)[1][:, -1])


def direction_deg(way: Floats) -> float:
    """Return the angle of a vector, seen along z, counter-clockwise from +x: from 0 to less than 180.

    Examples
    --------
    >>> direction_deg(np.array([0.0, -2.0, 1.0]))
    90.0
    """
    angle = math.degrees(math.atan2(way[1], way[0])) % 180.0
    return angle if angle < 180.0 else 0.0  # the remainder of -1e-20 is rounded to 180
