"""Held excess of the first family's bumps: the second family's quadrature over the first's public surfaces."""

from __future__ import annotations

import cv2
import numpy as np

from debulk import scenes
from lab.varied.fibres import excess
from lab.varied.regions import label_regions

_DRAWN_IN = 2e-3  # share of the distance to the middle: about a millimetre


def held_excess_mm(layup: scenes.Layup) -> list[float]:
    """Return the held excess of every bump, pockets before decoys, along straight fibres of 0 and 90 degrees."""
    truth = layup.truth

    def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return truth.ply_height_above_mold(np.stack([x, y], axis=-1))

    def mold(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return truth.mold_height(np.stack([x, y], axis=-1))

    # Some forty of the thousand corners of the outline are enough: this moves it by 0.3 mm. It is then drawn in by more
    # than that, because a line along the edge that left the ply and came back would include the steps down and up.
    outline = cv2.approxPolyDP(layup.ply_outline.astype(np.float32)[:, None], 0.3, True)[:, 0].astype(float)
    outline += _DRAWN_IN * (outline.mean(axis=0) - outline)
    feet = label_regions(height, outline, truth.thickness_mm + 3e-3, 2.0)
    found = []
    for bump in (*truth.pockets, *truth.decoys):
        label = int(feet.at(*(np.array(v) for v in bump.centre_mm)))
        box = feet.box(label)
        found.append(excess(height, mold, outline, truth.thickness_mm, (0.0, 90.0), feet, label, box).held_mm)
    return found
