"""The mold frame on the map: its origin, the directions of x and y, and those of the ply's fibres."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk.results.report import ReportData


class Frame(NamedTuple):
    """The arrows of x (to the right) and y (down), mm; at the origin, or in a corner if the origin is off the map."""

    x: float
    y: float
    length: float
    at_origin: bool


class Rose(NamedTuple):
    """The two fibre directions of the whole ply: lines through a centre, and a figure at the end of each."""

    x: float
    y: float
    path: str
    texts: list[tuple[float, float, str]]


def frame(low: NDArray[np.float64], high: NDArray[np.float64], font: float) -> Frame:
    """Return the arrows for a map between two corners in the mold frame."""
    length = 2.2 * font
    room = length + font
    at_origin = bool((low < -0.2 * font).all() and (high > room).all())
    x, y = (0.0, 0.0) if at_origin else (float(low[0]) + 0.8 * font, float(low[1]) + 0.8 * font)
    return Frame(x, -y, length, at_origin)


def rose(
    report: ReportData | None,
    outlines: Sequence[NDArray[np.float64]],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    font: float,
) -> Rose | None:
    """Return the fibre directions, in the corner farthest from all pockets; None if they are not known."""
    trace = report.trace if report else None
    if trace is None or trace.fibre_angles_deg is None:
        return None
    radius, off = 1.5 * font, 3.2 * font
    corners = [(x, y) for y in (low[1] + off, high[1] - off) for x in (low[0] + off, high[0] - off)]

    def room(corner: tuple[float, float]) -> float:
        return min((float(np.hypot(*(outline - corner).T).min()) for outline in outlines), default=0.0)

    x, y = max(corners, key=room)
    path, texts = "", []
    for angle in trace.fibre_angles_deg.tolist():
        c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
        path += f"M{-radius * c:.1f} {radius * s:.1f}L{radius * c:.1f} {-radius * s:.1f}"
        texts.append((1.65 * radius * c, -1.4 * radius * s + 0.2 * font, f"{angle:g}°".replace("-", "−")))
    return Rose(float(x), float(-y), path, texts)
