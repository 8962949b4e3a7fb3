"""Ray casting with one ray per pixel; hits are found by Newton's iteration on the depth, in blocks of rows.

The camera is above the ply, so that a ray moves outwards as it descends, and every surface is less steep than the rays.
So each (extended) surface is met exactly once, and the place of a hit alone decides whether it counts: on the ply if it
is inside the ply's outline, otherwise on the mold if inside its rectangle, otherwise on the table.
"""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from debulk.arrays import Floats, Singles
from debulk.scenes import mold
from debulk.scenes.bump import Bell
from debulk.scenes.camera import Camera
from debulk.scenes.outline import StarPolygon
from debulk.scenes.spoil import Spoiling

_BLOCK_ROWS = 16  # this affects the result, as each block has its own stream of noise
_MOLD_STEPS = 3  # the error falls from 60 mm to about 1e-1, 1e-6, below 1e-12 mm
_BELL_STEPS = 4  # from 15 mm to below 1e-10 mm; the narrow ridges of a debulked ply need more


@dataclass(frozen=True, eq=False)
class Target:
    """The objects in front of the camera."""

    ply: StarPolygon
    thickness_mm: float
    bells: tuple[Bell, ...]
    bell_steps: int = _BELL_STEPS


@dataclass(frozen=True, eq=False)
class Rays:
    """A block of rays, x_mold = centre + depth · (dx, dy, dz)."""

    centre: Floats
    dx: Floats
    dy: Floats
    dz: Floats

    def part(self, rows: slice, columns: slice) -> Rays:
        """Cut out a part of the block."""
        return Rays(self.centre, self.dx[rows, columns], self.dy[rows, columns], self.dz[rows, columns])

    def xy(self, depth: Floats) -> tuple[Floats, Floats]:
        """Mold XY at these depths."""
        return self.centre[0] + depth * self.dx, self.centre[1] + depth * self.dy

    def depth_at(self, z_mm: float) -> Floats:
        """Depths at which the rays pass a height."""
        return np.asarray((z_mm - self.centre[2]) / self.dz)


def cast(
    camera: Camera, target: Target, scan: Spoiling, reference: Spoiling | None, threads: int
) -> tuple[Singles, Singles | None]:
    """Cast the scan with the ply and, if requested, the reference without it, (H, W, 3), scanner frame, mm."""
    shape = (camera.height, camera.width, 3)
    with_cloud = np.empty(shape, dtype=np.float32)
    without_cloud = None if reference is None else np.empty(shape, dtype=np.float32)
    rim = mold.rim()
    low, high = rim.copy(), rim.copy()
    low[:, 2], high[:, 2] = mold.LOWEST_MM, mold.HIGHEST_MM + 20.0
    mold_box = camera.box(np.concatenate([low, high]))
    bell_boxes = [_bell_box(camera, bell, target.thickness_mm) for bell in target.bells]

    def block(start: int) -> None:
        rows = slice(start, min(start + _BLOCK_ROWS, camera.height))
        u = (np.arange(camera.width) - camera.cx)[None, :] / camera.f
        v = (np.arange(rows.start, rows.stop) - camera.cy)[:, None] / camera.f
        r = camera.rotation
        rays = Rays(camera.centre, *(r[k, 0] * u + (r[k, 1] * v + r[k, 2]) for k in range(3)))
        with_ply = rays.depth_at(mold.TABLE_Z_MM)
        without = with_ply.copy()
        if max(rows.start, mold_box[0]) < min(rows.stop, mold_box[1]):
            columns = slice(mold_box[2], mold_box[3])
            inner = rays.part(slice(None), columns)
            hit(inner, rows.start, columns.start, target, bell_boxes, with_ply[:, columns], without[:, columns])
        range_per_depth = np.sqrt(1.0 + u * u + v * v)
        for depth, faults, cloud in ((with_ply, scan, with_cloud), (without, reference, without_cloud)):
            if faults is None or cloud is None:
                continue
            faults.block(rows, range_per_depth, depth)
            depth[faults.dropout[rows]] = np.nan
            np.multiply(depth, u, out=cloud[rows, :, 0], casting="same_kind")
            np.multiply(depth, v, out=cloud[rows, :, 1], casting="same_kind")
            cloud[rows, :, 2] = depth

    with ThreadPoolExecutor(threads) as pool:
        for _ in pool.map(block, range(0, camera.height, _BLOCK_ROWS)):
            pass
    return with_cloud, without_cloud


def hit(
    rays: Rays,
    row: int,
    column: int,
    target: Target,
    bell_boxes: list[tuple[int, int, int, int]],
    with_ply: Floats,
    without: Floats,
) -> None:
    """Depths of the hits on mold and ply, which replace the table's; ``row``, ``column``: the block's first pixel."""
    depth = rays.depth_at(0.5 * (mold.LOWEST_MM + mold.HIGHEST_MM))
    for _ in range(_MOLD_STEPS):
        x, y = rays.xy(depth)
        z, zx, zy = mold.height_and_slopes(x, y)
        closing = rays.dz - zx * rays.dx - zy * rays.dy  # change of the clearance with depth, about -1
        depth = depth - (rays.centre[2] + depth * rays.dz - z) / closing
    x, y = rays.xy(depth)
    on_mold = mold.inside(x, y)
    np.copyto(with_ply, depth, where=on_mold)
    np.copyto(without, depth, where=on_mold)

    # One step suffices for the thickness, as its error is F'' t² / 2, about 1e-6 mm.
    depth = depth + target.thickness_mm / closing
    for bell, box in zip(target.bells, bell_boxes, strict=True):
        i0, i1 = max(box[0] - row, 0), min(box[1] - row, depth.shape[0])
        j0, j1 = max(box[2] - column, 0), min(box[3] - column, depth.shape[1])
        if i0 < i1 and j0 < j1:
            window = slice(i0, i1), slice(j0, j1)
            _hit_bell(rays.part(*window), target, bell, depth[window])
    x, y = rays.xy(depth)
    np.copyto(with_ply, depth, where=target.ply.inside(x, y))


def _hit_bell(rays: Rays, target: Target, bell: Bell, depth: Floats) -> None:
    """Replace depths on the laid ply with those of hits on a bell where the hit is within the bell's foot."""
    at = depth.copy()
    for _ in range(target.bell_steps):
        x, y = rays.xy(at)
        z, zx, zy = mold.height_and_slopes(x, y)
        rise, bx, by, _ = bell.rise_and_slopes(x, y)
        closing = rays.dz - (zx + bx) * rays.dx - (zy + by) * rays.dy
        at -= (rays.centre[2] + at * rays.dz - z - rise - target.thickness_mm) / closing
    u, v = bell.to_unit(*rays.xy(at))
    np.copyto(depth, at, where=u * u + v * v < 1.0)


def _bell_box(camera: Camera, bell: Bell, thickness_mm: float) -> tuple[int, int, int, int]:
    """Pixels that may see a bell: the image of its foot at the heights of the foot and of the top."""
    foot = bell.foot(90)
    z = mold.height(foot[:, 0], foot[:, 1]) + thickness_mm
    low, high = np.column_stack([foot, z]), np.column_stack([foot, z + bell.height_mm])
    return camera.box(np.concatenate([low, high]), spare=4)
