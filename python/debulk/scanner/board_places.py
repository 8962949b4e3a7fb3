"""Where the boards of a calibration stood: how they were tilted, and what parts of the images they reached."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats
from debulk.scanner.inputs import InputError
from debulk.scanner.stereo_fit import Pair, Placed

CELLS = (
    "upper left", "upper middle", "upper right", "left", "middle", "right", "lower left", "lower middle", "lower right",
)  # fmt: skip
"""Names of the ninths of an image, row by row."""


@dataclass(frozen=True, eq=False)
class BoardPlace:
    """One place of the board."""

    name: str
    """Of the pair of images."""
    left_px: Floats
    right_px: Floats
    """`left_px`, `right_px`: (K, 2) outline of the corners in each image."""
    tilt_deg: float
    """Angle between the board's normal and the left camera's axis."""
    towards_deg: float
    """Direction in the image in which the board's nearer side lies, clockwise from right."""
    distance_mm: float
    """Of the corners' mean, along the left camera's axis."""

    def data(self) -> dict[str, Any]:
        """Return the place for a file."""
        return {
            "name": self.name,
            "left_px": np.round(self.left_px, 2).tolist(),
            "right_px": np.round(self.right_px, 2).tolist(),
            "tilt_deg": self.tilt_deg,
            "towards_deg": self.towards_deg,
            "distance_mm": self.distance_mm,
        }

    @classmethod
    def from_data(cls, data: Any) -> BoardPlace:
        """Read what `data` returned."""
        try:
            outlines = [np.array(data[side], np.float64).reshape(-1, 2) for side in ("left_px", "right_px")]
            numbers = [float(data[name]) for name in ("tilt_deg", "towards_deg", "distance_mm")]
            if not (np.isfinite(numbers).all() and all(np.isfinite(outline).all() for outline in outlines)):
                raise ValueError
            return cls(str(data["name"]), outlines[0], outlines[1], *numbers)
        except (KeyError, TypeError, ValueError):
            raise InputError("boards: expected outlines in pixels, tilt and distance of every board") from None


def board_place(pair: Pair, placed: Placed) -> BoardPlace:
    """Describe where a board stood."""
    import cv2

    turn = cv2.Rodrigues(placed.place[:3])[0]
    normal = turn[:, 2] * np.sign(turn[2, 2])  # away from the camera
    centre = turn @ pair.board.mean(axis=0) + placed.place[3:]
    outlines = [
        np.asarray(cv2.convexHull(seen.astype(np.float32)), np.float64).reshape(-1, 2)
        for seen in (pair.left, pair.right)
    ]
    return BoardPlace(
        pair.name,
        outlines[0],
        outlines[1],
        float(np.rad2deg(np.arccos(np.clip(normal[2], -1, 1)))),
        float(np.rad2deg(np.arctan2(normal[1], normal[0]))),
        float(centre[2]),
    )


def covered(outlines: Sequence[Floats], points: Floats) -> NDArray[np.bool_]:
    """Tell which of (N, 2) pixels lie in at least one outline."""
    import cv2

    inside = np.zeros(len(points), np.bool_)
    for outline in outlines:
        hull = outline.astype(np.float32).reshape(-1, 1, 2)
        inside |= np.array([cv2.pointPolygonTest(hull, (float(x), float(y)), False) >= 0 for x, y in points], np.bool_)
    return inside


def cell_of(points: Floats, pixels: tuple[int, int]) -> NDArray[np.int64]:
    """Return in which ninth of the image each of (N, 2) pixels lies, row by row."""
    column, row = np.clip(points * 3 // np.array(pixels), 0, 2).astype(np.int64).T
    return np.asarray(3 * row + column, np.int64)
