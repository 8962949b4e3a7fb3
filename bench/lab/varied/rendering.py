"""The view of mold, ply, table and clamp by a scanner with one camera and a second eye, without any fault."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from lab.varied.bumps import steepness
from lab.varied.molds import Mold
from lab.varied.ply import Ply
from lab.varied.polygons import inside
from lab.varied.seeing import Camera, Floats, first_hit

Bools = NDArray[np.bool_]


@dataclass(frozen=True)
class Clamp:
    """A bar with a flat top: centre, direction of its length, half length and half width, height of its top."""

    centre_mm: tuple[float, float]
    angle: float
    half_length_mm: float
    half_width_mm: float
    top_mm: float

    def crossing(self, camera: Camera, rays: tuple[Floats, ...]) -> tuple[Floats, Floats, Floats]:
        """Depths at which each ray enters and leaves the bar's column, and at which it meets the top's plane."""
        c, s = np.cos(self.angle), np.sin(self.angle)
        away = camera.centre[:2] - np.array(self.centre_mm)
        enter, leave = np.full(rays[0].shape, -np.inf), np.full(rays[0].shape, np.inf)
        for axis, half in (((c, s), self.half_length_mm), ((-s, c), self.half_width_mm)):
            rate = axis[0] * rays[0] + axis[1] * rays[1]
            rate = np.where(np.abs(rate) < 1e-12, 1e-12, rate)
            at = axis[0] * away[0] + axis[1] * away[1]
            one, two = (-half - at) / rate, (half - at) / rate
            enter, leave = np.maximum(enter, np.minimum(one, two)), np.minimum(leave, np.maximum(one, two))
        return enter, leave, (self.top_mm - camera.centre[2]) / rays[2]


@dataclass(frozen=True)
class View:
    """Depth of every pixel, NaN where nothing is seen, and where a clamp hid the ply."""

    depth: Floats
    clamped: Bools


@dataclass(frozen=True)
class Stage:
    """Camera, second eye and ply, with the data that both scans share."""

    camera: Camera
    second_eye: Floats
    ply: Ply
    clamp: Clamp | None

    @property
    def mold(self) -> Mold:
        """The mold below the ply."""
        return self.ply.mold

    @cached_property
    def _bounds(self) -> tuple[float, float, float]:
        """Lowest and highest height and largest slope of the mold in the view."""
        xs, ys = self._view_box()
        x, y = np.meshgrid(xs, ys)
        z = self.mold.smooth_height(x, y)
        slope = np.hypot(*np.gradient(z, ys, xs))
        return float(z.min()) - 5, float(z.max()) + 5, 1.1 * float(slope.max())

    def _view_box(self) -> tuple[Floats, Floats]:
        dx, dy, dz = self.camera.directions()
        crest = float(self.mold.smooth_height(*self.ply.outline.T).max())
        t = (crest - 400 - self.camera.centre[2]) / dz[[0, 0, -1, -1], [0, -1, 0, -1]]
        x = self.camera.centre[0] + t * dx[[0, 0, -1, -1], [0, -1, 0, -1]]
        y = self.camera.centre[1] + t * dy[[0, 0, -1, -1], [0, -1, 0, -1]]
        return np.linspace(x.min(), x.max(), 700), np.linspace(y.min(), y.max(), 700)

    @cached_property
    def reference(self) -> Floats:
        """Depths without the ply; NaN on the walls of a cliff and behind them."""
        low, high, steep = self._bounds
        depth = first_hit(self.camera, self.mold.smooth_height, self.mold.smooth_height, low, high, steep)
        if self.mold.part_outline is not None:
            on_part = inside(self.mold.part_outline, *self.at(depth))
            table = (self.mold.table_mm - self.camera.centre[2]) / self.camera.directions()[2]
            wall = inside(self.mold.part_outline, *self.at(table))
            depth = np.where(on_part, depth, np.where(wall, np.nan, table))
        return self._without_shadows(depth, with_ply=False)

    @cached_property
    def scan(self) -> View:
        """Depths with the ply, and with the clamp if there is one."""
        low, high, steep = self._bounds
        slopes = sorted((steepness(b) for b in self.ply.bumps), reverse=True)[:2]
        tallest = sum(sorted((b.height_mm for b in self.ply.bumps), reverse=True)[:3]) + 3 * self.ply.thickness_mm

        def in_image(x: Floats, y: Floats) -> Floats:
            return self.ply.laid(x, y) + self.ply.gap_in_image(x, y)

        depth = first_hit(self.camera, self.ply.top, in_image, low, high + tallest, steep + sum(slopes))
        on_ply = inside(self.ply.outline, *self.at(depth))
        below = self.reference
        with np.errstate(invalid="ignore"):
            under_edge = inside(self.ply.outline, *self.at(below))
        depth = np.where(on_ply, depth, np.where(under_edge, np.nan, below))
        depth = self._without_shadows(depth, with_ply=True)
        clamped = np.zeros(depth.shape, dtype=bool)
        if self.clamp is not None:
            rays = self.camera.directions()
            enter, leave, top = self.clamp.crossing(self.camera, rays)
            from_above = (enter < top) & (top < leave)
            behind = np.where(np.isfinite(depth), depth, np.inf)
            from_the_side = (enter < leave) & (enter >= top) & (enter < behind)
            clamped = from_above | from_the_side
            depth = np.where(from_above, top, np.where(from_the_side, np.nan, depth))
        return View(depth, clamped)

    def at(self, depth: Floats) -> tuple[Floats, Floats]:
        """Mold x and y of each pixel at a depth."""
        dx, dy, _ = self.camera.directions()
        return self.camera.centre[0] + depth * dx, self.camera.centre[1] + depth * dy

    def _without_shadows(self, depth: Floats, with_ply: bool) -> Floats:
        """Set NaN where the second eye's view is blocked, judged on every second pixel with heights on a 2 mm grid."""
        xs, ys = self._view_box()
        pitch = 2.0
        xs, ys = np.arange(xs[0], xs[-1], pitch), np.arange(ys[0], ys[-1], pitch)
        x, y = np.meshgrid(xs, ys)
        table = self.mold.height(x, y)
        if with_ply:
            table = table + np.where(
                inside(self.ply.outline, x, y), self.ply.thickness_mm + self.ply.gap_in_image(x, y), 0
            )
        table = table.astype(np.float32)
        jump = max(float(np.abs(np.diff(table, axis=k)).max()) for k in (0, 1)) / pitch
        highest = float(table.max())
        dx, dy, dz = (d[::2, ::2] for d in self.camera.directions())
        t = depth[::2, ::2]
        p = [self.camera.centre[k] + t * d for k, d in enumerate((dx, dy, dz))]
        lean = [(self.second_eye[k] - p[k]) / (self.second_eye[2] - p[2]) for k in (0, 1)]
        if jump * float(np.nanmax(np.hypot(*lean))) < 1:
            return depth
        blocked = np.zeros(t.shape, dtype=bool)
        rise = np.nan_to_num(highest - p[2])
        for share in np.linspace(0, 1, 25)[1:] ** 1.5:  # denser near the point itself
            up = share * rise
            i = np.clip(np.nan_to_num((p[0] + up * lean[0] - xs[0]) / pitch).astype(np.int32), 0, len(xs) - 1)
            j = np.clip(np.nan_to_num((p[1] + up * lean[1] - ys[0]) / pitch).astype(np.int32), 0, len(ys) - 1)
            blocked |= table[j, i] > p[2] + up + 1.0
        mask = cv2.resize(blocked.astype(np.uint8), None, fx=2, fy=2, interpolation=cv2.INTER_NEAREST)
        return np.where(mask[: depth.shape[0], : depth.shape[1]] > 0, np.nan, depth)
