"""The direction in which a pocket's ply is too long, and where that excess could be smoothed out of the ply."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from debulk.results.report import PocketReport

__all__ = ["Smoothing", "smoothing", "smoothing_line"]


class Smoothing(NamedTuple):
    """How much too long a fibre is, the direction across its decisive ridge, and the nearest edge in that direction.

    Directions are 0 to 180 degrees from the mold's +x. There are two if the ridge is as likely to run along the other
    diagonal of the fibres. `edge_mm` and `away_mm` are None if no outline is known.
    """

    excess_mm: float
    directions_deg: tuple[float, ...]
    edge_mm: tuple[float, float] | None
    away_mm: float | None
    towards_deg: float | None = None
    """Direction to that edge, 0 to 360 degrees; None if no outline is known."""

    @property
    def short(self) -> str:
        """Say in a few words how much is to be pushed out, and in which direction."""
        directions = " or ".join(f"{round(angle) % 180}°" for angle in self.directions_deg)
        return f"{self.excess_mm:.2f} mm along {directions}"


def smoothing(pocket: PocketReport, ply_outline_mm: NDArray[np.float64] | None) -> Smoothing | None:
    """Determine the direction from the crest that the report shows; None if it shows none."""
    if not pocket.ridges:
        return None
    ridge = pocket.ridges[0]
    middle = np.array(ridge.middle_mm[:2])
    crests_deg = [angle for angle in (ridge.direction_deg, ridge.mirrored_deg) if angle is not None]
    across_deg = tuple((angle + 90) % 180 for angle in crests_deg)
    ways = [np.array([math.cos(math.radians(angle)), math.sin(math.radians(angle))]) for angle in across_deg]
    reaches = [] if ply_outline_mm is None else [(_nearest_crossing(middle, way, ply_outline_mm), way) for way in ways]
    met = [(reach, way) for reach, way in reaches if reach is not None]
    if not met:
        return Smoothing(ridge.excess_mm, across_deg, None, None)
    reach, way = min(met, key=lambda one: abs(one[0]))
    x, y = middle + reach * way
    towards = math.degrees(math.atan2(*(reach * way)[::-1])) % 360
    return Smoothing(ridge.excess_mm, across_deg, (float(x), float(y)), abs(reach), towards)


def smoothing_line(found: Smoothing) -> str:
    """Describe the direction and the excess in a sentence."""
    directions = " or ".join(f"{round(angle) % 180}°" for angle in found.directions_deg)
    line = f"fibres are up to {found.excess_mm:.2f} mm too long: push across the worst ridge, at {directions}"
    if found.edge_mm is not None:
        x, y = found.edge_mm
        line += f"; the nearest edge that way is {found.away_mm:.0f} mm off, at ({x:.0f}, {y:.0f}) mm"
    return line


def _nearest_crossing(
    point: NDArray[np.float64], way: NDArray[np.float64], outline: NDArray[np.float64]
) -> float | None:
    """Return how far along the line through a point the closed outline is met, on the nearer side; None: nowhere."""
    start, side = outline - point, np.roll(outline, -1, axis=0) - outline
    turn = way[0] * side[:, 1] - way[1] * side[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (start[:, 0] * side[:, 1] - start[:, 1] * side[:, 0]) / turn
        share = (start[:, 0] * way[1] - start[:, 1] * way[0]) / turn
    met = along[(turn != 0) & (share >= 0) & (share < 1)]
    return float(met[np.argmin(np.abs(met))]) if met.size else None
