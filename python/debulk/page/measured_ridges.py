"""Where a debulked ply is above the limit inside the pockets' outlines: the ridges that a second scan shows."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk.grid import Grid

_MAX_CORNERS = 20_000  # largest number of corners of all ridges as drawn


def measured_ridges(heights: Grid | None, outlines: Sequence[NDArray[np.float64]], above_mm: float) -> str:
    """Return an SVG path, y up, round everything above this height inside the outlines; empty if there is nothing."""
    if heights is None or heights.values.ndim != 2:
        return ""
    inside = np.zeros(heights.values.shape, dtype=np.uint8)
    cells = [np.round((outline - heights.origin_mm) / heights.spacing_mm).astype(np.int32) for outline in outlines]
    for corners in cells:
        if len(corners):
            cv2.fillPoly(inside, [corners.reshape(-1, 1, 2)], 1)
    with np.errstate(invalid="ignore"):
        high = (inside > 0) & (heights.values > above_mm)
    rings, _ = cv2.findContours(high.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_SIMPLE)
    parts: list[str] = []
    left = _MAX_CORNERS
    for ring in sorted(rings, key=len, reverse=True):
        left -= len(ring)
        if left < 0:
            break
        points = heights.origin_mm + heights.spacing_mm * ring.reshape(-1, 2)
        parts.append("M" + "L".join(f"{x:.1f} {-y:.1f}" for x, y in points.tolist()) + "Z")
    return "".join(parts)
