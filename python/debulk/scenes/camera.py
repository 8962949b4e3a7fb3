"""The scanner: a tilted pinhole camera above the mold, with one ray per pixel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from debulk._core import InputError
from debulk.arrays import Floats
from debulk.scenes import mold

# If the mold fills the image, this share of the image's width stays clear on each side.
_MARGIN = 0.01


@dataclass(frozen=True, eq=False)
class Camera:
    """A pinhole camera: pixel (row i, column j) looks along ((j - cx) / f, (i - cy) / f, 1) in the scanner frame.

    The scanner frame is OpenCV's: x to the right in the image, y down, z along the optical axis, mm.
    ``x_mold = rotation @ x_scanner + centre``.
    """

    width: int
    height: int
    f: float
    cx: float
    cy: float
    rotation: Floats
    centre: Floats

    def project(self, points_mold: Floats) -> Floats:
        """Convert (N, 3) points in the mold frame to (N, 2) pixel coordinates (column, row)."""
        p = (points_mold - self.centre) @ self.rotation
        return np.asarray(p[:, :2] / p[:, 2:] * self.f + np.array([self.cx, self.cy]))

    def box(self, points_mold: Floats, spare: int = 2) -> tuple[int, int, int, int]:
        """First row, past-last row, first column, past-last column of the pixels that contain these points, clipped."""
        pixel = self.project(points_mold)
        low = np.floor(pixel.min(axis=0)).astype(int) - spare
        high = np.ceil(pixel.max(axis=0)).astype(int) + spare + 1
        return (
            int(np.clip(low[1], 0, self.height)),
            int(np.clip(high[1], 0, self.height)),
            int(np.clip(low[0], 0, self.width)),
            int(np.clip(high[0], 0, self.width)),
        )

    @property
    def mold_from_scanner(self) -> Floats:
        """4x4, x_mold = T x_scanner."""
        t = np.eye(4)
        t[:3, :3] = self.rotation
        t[:3, 3] = self.centre
        return t


def aim(rng: np.random.Generator, pixels: tuple[int, int], pitch_mm: float | None) -> Camera:
    """Set up a camera 2.4 m above the mold, tilted by about 8.5 degrees, with a focal length for the wanted pitch.

    It is always above the ply, so every ray moves outwards as it descends and none enters under a raised edge. The ray
    caster relies on that.
    """
    width, height = pixels
    centre = np.array([140.0, -330.0, 2400.0]) + rng.uniform(-1, 1, 3) * np.array([20.0, 20.0, 10.0])
    roll = np.deg2rad(rng.uniform(-1.5, 1.5))
    forward = np.array([0.0, 0.0, -15.0]) - centre
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 1.0, 0.0])  # right in the image is mold +x, down is mold -y
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    right, down = np.cos(roll) * right + np.sin(roll) * down, np.cos(roll) * down - np.sin(roll) * right
    rotation = np.stack([right, down, forward], axis=1)

    unit = Camera(width, height, 1.0, 0.0, 0.0, rotation, centre)
    rim = unit.project(mold.rim())
    reach = np.abs(rim).max(axis=0)
    largest_f = float(min((0.5 - _MARGIN) * width / reach[0], (0.5 - _MARGIN) * height / reach[1]))
    if pitch_mm is None:
        f = largest_f
    else:
        x, y = rim.T  # f² · mold area in the normalised image = number of points; each takes pitch²
        image_area = 0.5 * abs(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
        points_per_f2 = image_area / (4 * mold.HALF_X_MM * mold.HALF_Y_MM)
        f = float(1.0 / (pitch_mm * np.sqrt(points_per_f2)))
        if f > largest_f:
            smallest = 1.0 / (largest_f * np.sqrt(points_per_f2))
            raise InputError(
                f"pitch_mm: expected at least {smallest:.3f} mm, so that the mold fits into {width} x {height} pixels, "
                f"but got {pitch_mm}"
            )
    return Camera(width, height, f, (width - 1) / 2, (height - 1) / 2, rotation, centre)
