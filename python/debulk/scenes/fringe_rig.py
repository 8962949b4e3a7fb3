"""Two cameras and a projector above the mold, and the surfaces that their rays meet."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from debulk.arrays import Floats
from debulk.scanner import Calibration
from debulk.scanner.undistort import undistorted
from debulk.scenes import mold
from debulk.scenes.raycast import Rays, Target, hit

BASELINE_MM = 420.0
PROJECTOR_DOWN_MM = 60.0  # distance from the baseline, towards the image's lower edge
_DISTORTION = np.array([-0.09, 0.06, 4e-4, -3e-4, 0.0])
_LOOK_AT = np.array([0.0, 0.0, -15.0])
_BLOCK_ROWS = 64


@dataclass(frozen=True, eq=False)
class View:
    """A camera or projector: x_mold = rotation @ x + centre in OpenCV's frame; matrix and distortion give pixels."""

    rotation: Floats
    centre: Floats
    matrix: Floats
    distortion: Floats
    width: int
    height: int

    def project(self, points: Floats) -> Floats:
        """Convert (N, 3) points in the mold's frame to (N, 2) pixels."""
        import cv2

        local = (points - self.centre) @ self.rotation
        pixels, _ = cv2.projectPoints(local[:, None], np.zeros(3), np.zeros(3), self.matrix, self.distortion)
        return np.asarray(pixels, np.float64).reshape(-1, 2)

    def rays(self, rows: slice) -> Floats:
        """(rows, W, 3) directions in the mold's frame, one unit along the axis."""
        some = np.arange(rows.start, rows.stop, dtype=np.float64)
        column, row = np.meshgrid(np.arange(self.width, dtype=np.float64), some)
        pixels = np.stack([column.ravel(), row.ravel()], axis=1)
        seen = undistorted(pixels, self.matrix, self.distortion, most=50, accuracy=1e-10)
        local = np.concatenate([seen, np.ones((len(seen), 1))], axis=1)
        return np.asarray(local @ self.rotation.T).reshape(len(some), self.width, 3)


@dataclass(frozen=True, eq=False)
class Rig:
    """The virtual scanner: two cameras and a projector."""

    left: View
    right: View
    projector: View

    def calibration(self) -> Calibration:
        """Return the true calibration."""
        turn = self.right.rotation.T @ self.left.rotation
        way = self.right.rotation.T @ (self.left.centre - self.right.centre)
        matrices, distortions = [self.left.matrix, self.right.matrix], [self.left.distortion, self.right.distortion]
        return Calibration(matrices, distortions, turn, way, (self.left.width, self.left.height))


def rig(seed: int, pixels: tuple[int, int], projector_pixels: tuple[int, int]) -> Rig:
    """Set up the cameras 420 mm apart, 2.4 m above the middle of the mold, and the projector between them."""
    rng = np.random.Generator(np.random.SFC64([seed, 7]))
    middle = np.array([140.0, -330.0, 2400.0]) + rng.uniform(-10, 10, 3)
    along = np.array([BASELINE_MM, 0, 0])
    views = []
    for side in (-0.5, 0.5):
        rotation = _aim(middle + side * along, rng.normal(0, 0.004, 3))
        views.append(_view(rotation, middle + side * along, pixels, _DISTORTION * rng.uniform(0.8, 1.2, 5)))
    place = middle - np.array([0, PROJECTOR_DOWN_MM, 0])
    return Rig(views[0], views[1], _view(_aim(place, np.zeros(3)), place, projector_pixels, np.zeros(5)))


def _aim(centre: Floats, off_rad: Floats) -> Floats:
    import cv2

    forward = _LOOK_AT - centre
    forward /= np.linalg.norm(forward)
    right = np.cross(forward, [0.0, 1.0, 0.0])
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(forward, right), forward], axis=1)
    return np.asarray(rotation @ cv2.Rodrigues(off_rad)[0])


def _view(rotation: Floats, centre: Floats, pixels: tuple[int, int], distortion: Floats) -> View:
    """Choose the focal length at which the mold fills the image except for a margin of 3 %."""
    width, height = pixels
    seen = (mold.rim() - centre) @ rotation
    reach = np.abs(seen[:, :2] / seen[:, 2:]).max(axis=0)
    f = float(min(0.47 * width / reach[0], 0.47 * height / reach[1]))
    matrix = np.array([[f, 0, (width - 1) / 2 + 0.004 * width], [0, f, (height - 1) / 2 - 0.003 * height], [0, 0, 1]])
    return View(rotation, centre, matrix, distortion, width, height)


def depths(
    view: View, directions: Floats, first: int, centre: Floats, target: Target, ply: bool, spare: int = 6
) -> Floats:
    """Find the distance to the first surface along each of (rows, W, 3) directions, those of ``view`` from a row on.

    It says where bells may be.
    """
    height, width = directions.shape[:2]
    out = np.empty((height, width))
    boxes = (
        [_box(view, bell.foot(90), target.thickness_mm, bell.height_mm, spare) for bell in target.bells] if ply else []
    )
    bells = Target(target.ply, target.thickness_mm, target.bells if ply else (), target.bell_steps)
    for start in range(0, height, _BLOCK_ROWS):
        rows = slice(start, min(start + _BLOCK_ROWS, height))
        part = directions[rows]
        rays = Rays(centre, part[..., 0], part[..., 1], part[..., 2])
        with_ply = rays.depth_at(mold.TABLE_Z_MM)
        without = with_ply.copy()
        hit(rays, first + start, 0, bells, boxes, with_ply, without)
        out[rows] = with_ply if ply else without
    return out


def _box(view: View, foot: Floats, thickness_mm: float, height_mm: float, spare: int) -> tuple[int, int, int, int]:
    z = mold.height(foot[:, 0], foot[:, 1]) + thickness_mm
    pixel = view.project(np.concatenate([np.column_stack([foot, z]), np.column_stack([foot, z + height_mm])]))
    low, high = np.floor(pixel.min(axis=0)).astype(int) - spare, np.ceil(pixel.max(axis=0)).astype(int) + spare + 1
    return max(int(low[1]), 0), min(int(high[1]), view.height), max(int(low[0]), 0), min(int(high[0]), view.width)
