"""Which way a pocket's ply has too much length, and where that could leave the ply."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from debulk.results.report import PocketReport

__all__ = ["Smoothing", "smoothing", "smoothing_line"]


class Smoothing(NamedTuple):
    """By how much the ply is too long, along which direction its worst ridge folds, and the nearest edge that way.

    The direction is -90 (excluded) to 90 degrees from the mold's +x; `edge_mm` is None where no outline is known.
    """

    excess_mm: float
    direction_deg: float
    edge_mm: tuple[float, float] | None
    away_mm: float | None


def smoothing(pocket: PocketReport, ply_outline_mm: NDArray[np.float64] | None) -> Smoothing | None:
    """Read the direction from the section across the worst ridge; None where the report knows of no ridge."""
    net, nodes, middle = pocket.net, pocket.ridge_nodes, pocket.centroid_mm
    excess = pocket.excess.length_mm if pocket.excess else pocket.excess_length_mm
    if net is None or nodes is None or len(nodes) < 2 or middle is None or not excess:
        return None
    across = net.nodes_mm[nodes[-1], :2] - net.nodes_mm[nodes[0], :2]
    length = float(np.hypot(*across))
    if length == 0:
        return None
    way = across / length
    angle = math.degrees(math.atan2(way[1], way[0]))
    angle -= 180 * math.ceil((angle - 90) / 180)
    reach = None if ply_outline_mm is None else _nearest_crossing(np.array(middle), way, ply_outline_mm)
    if reach is None:
        return Smoothing(excess, angle, None, None)
    edge = np.array(middle) + reach * way
    return Smoothing(excess, angle, (float(edge[0]), float(edge[1])), abs(reach))


def smoothing_line(found: Smoothing) -> str:
    """Say it in a sentence."""
    degrees = round(found.direction_deg)
    line = f"the ply is up to {found.excess_mm:.2f} mm too long, "
    line += f"and its worst ridge folds along the fibre at {90 if degrees == -90 else degrees}°"
    if found.edge_mm is not None:
        x, y = found.edge_mm
        line += f"; the nearest edge that way is {found.away_mm:.0f} mm off, at ({x:.0f}, {y:.0f}) mm"
    return line


def _nearest_crossing(
    point: NDArray[np.float64], way: NDArray[np.float64], outline: NDArray[np.float64]
) -> float | None:
    """Return how far along the line through a point it meets the closed outline, on the nearer side; None: nowhere."""
    start, side = outline - point, np.roll(outline, -1, axis=0) - outline
    turn = way[0] * side[:, 1] - way[1] * side[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (start[:, 0] * side[:, 1] - start[:, 1] * side[:, 0]) / turn
        share = (start[:, 0] * way[1] - start[:, 1] * way[0]) / turn
    met = along[(turn != 0) & (share >= 0) & (share < 1)]
    return float(met[np.argmin(np.abs(met))]) if met.size else None
