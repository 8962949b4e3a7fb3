"""Regions of a known surface above a level, and their area, volume, peak and outline by quadrature."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from lab.varied.polygons import distance, inside

Floats = NDArray[np.float64]
Height = Callable[[Floats, Floats], Floats]


@dataclass(frozen=True)
class Lattice:
    """Values at x = x0 + i step, y = y0 + j step."""

    x0: float
    y0: float
    step: float
    values: NDArray[np.int32]

    def at(self, x: Floats, y: Floats) -> NDArray[np.int32]:
        """Value of the nearest node, 0 outside."""
        i = np.rint((x - self.x0) / self.step).astype(np.int64)
        j = np.rint((y - self.y0) / self.step).astype(np.int64)
        fits = (i >= 0) & (j >= 0) & (i < self.values.shape[1]) & (j < self.values.shape[0])
        found = self.values[np.clip(j, 0, self.values.shape[0] - 1), np.clip(i, 0, self.values.shape[1] - 1)]
        return np.where(fits, found, 0).astype(np.int32)

    def places(self, chosen: NDArray[np.bool_]) -> tuple[Floats, Floats]:
        """Positions x and y of the nodes that an array like `values` selects."""
        rows, columns = np.nonzero(chosen)
        return self.x0 + self.step * columns.astype(np.float64), self.y0 + self.step * rows.astype(np.float64)

    def box(self, label: int) -> tuple[float, float, float, float]:
        """Lowest and highest x and y of the nodes of a label."""
        x, y = self.places(self.values == label)
        return float(x.min()), float(y.min()), float(x.max()), float(y.max())


@dataclass(frozen=True)
class Measured:
    """A region above the level, exact except for the quadrature's error of some 1e-4 of the area."""

    label: int
    area_mm2: float
    volume_mm3: float
    peak_mm: float
    centre_mm: tuple[float, float]
    outline_mm: Floats
    touches_ply_edge: bool


def label_regions(height: Height, outline: Floats, level: float, step: float = 1.0) -> Lattice:
    """Give numbers to the regions inside the outline above the level, as resolved by nodes `step` apart."""
    low, high = outline.min(axis=0), outline.max(axis=0)
    x, y = np.meshgrid(np.arange(low[0] + 0.013, high[0], step), np.arange(low[1] + 0.017, high[1], step))
    above = ((height(x, y) > level) & inside(outline, x, y)).astype(np.uint8)
    _, labels = cv2.connectedComponents(above, connectivity=8)
    return Lattice(float(x[0, 0]), float(y[0, 0]), step, labels.astype(np.int32))


def measure(height: Height, outline: Floats, level: float, lattice: Lattice, label: int) -> Measured | None:
    """Integrate over one region on a grid of some 300 cells along it, each cell cut by the level and the ply's edge.

    The height must continue smoothly beyond the outline, or be 0 there (then cells on the edge count whole or not at
    all). None: the region is a sliver between the nodes of the grid.
    """
    x0, y0, x1, y1 = lattice.box(label)
    grow = 2 * lattice.step
    size = max(x1 - x0, y1 - y0) + 2 * grow
    step = max(0.1, size / 400)
    xs, ys = np.arange(x0 - grow, x1 + grow, step), np.arange(y0 - grow, y1 + grow, step)
    x, y = np.meshgrid(xs, ys)
    values = height(x, y)
    inner = distance(outline, x, y)
    _, parts = cv2.connectedComponents(((values > level) & (inner > 0)).astype(np.uint8), connectivity=8)
    wanted = np.bincount(parts[(lattice.at(x, y) == label) & (parts > 0)], minlength=1)
    if not wanted.any():
        return None
    mine = parts == int(wanted.argmax())
    # The level counts only near this region: in neighbouring regions within the box, heights are pushed below the
    # level.
    near = cv2.dilate(mine.astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    above = np.where(near, values - level, np.minimum(values - level, -1e-9))
    share, mean_above = _cells(above)
    share_inner, _ = _cells(np.clip(inner, -step, step))
    area = float((share * share_inner).sum()) * step**2
    volume = level * area + float((mean_above * share_inner).sum()) * step**2
    top = np.unravel_index(np.argmax(np.where(mine, values, -np.inf)), values.shape)
    peak_at = _climb(height, outline, float(x[top]), float(y[top]), step)
    contour = _contour(height, level, mine, xs, ys)
    return Measured(
        label=label,
        area_mm2=area,
        volume_mm3=volume,
        peak_mm=peak_at[2],
        centre_mm=(peak_at[0], peak_at[1]),
        outline_mm=contour,
        touches_ply_edge=bool((inner[mine] < 1.5 * step).any()),
    )


def _cells(f: Floats) -> tuple[Floats, Floats]:
    """Share of each cell where f > 0, and mean of max(f, 0) over it, from four triangles round the cell's centre."""
    corners = [f[:-1, :-1], f[:-1, 1:], f[1:, 1:], f[1:, :-1]]
    middle = 0.25 * (corners[0] + corners[1] + corners[2] + corners[3])
    share, mean = np.zeros(middle.shape), np.zeros(middle.shape)
    for k in range(4):
        one, two = _triangle(corners[k], corners[(k + 1) % 4], middle)
        share += 0.25 * one
        mean += 0.25 * two
    return share, mean


def _triangle(a: Floats, b: Floats, c: Floats) -> tuple[Floats, Floats]:
    """Share of a triangle where a linear function of these corner values is positive; mean of its positive part."""
    least, most = np.minimum(a, b), np.maximum(a, b)
    low, mid, high = np.minimum(least, c), np.maximum(least, np.minimum(most, c)), np.maximum(most, c)
    with np.errstate(divide="ignore", invalid="ignore"):
        top = high**2 / ((high - low) * (high - mid))  # only `high` is positive
        bottom = low**2 / ((low - mid) * (low - high))  # only `low` is not positive
    total = (a + b + c) / 3
    share = np.select([low > 0, mid > 0, high > 0], [np.ones_like(a), 1 - bottom, top], 0.0)
    mean = np.select([low > 0, mid > 0, high > 0], [total, total - low / 3 * bottom, high / 3 * top], 0.0)
    return share, mean


def _climb(height: Height, outline: Floats, x: float, y: float, step: float) -> tuple[float, float, float]:
    """Highest point of the region near a start, by successively finer grids."""
    for _ in range(8):
        gx, gy = np.meshgrid(x + step * np.linspace(-1, 1, 9), y + step * np.linspace(-1, 1, 9))
        values = np.where(distance(outline, gx, gy) >= 0, height(gx, gy), -np.inf)
        top = np.unravel_index(np.argmax(values), values.shape)
        x, y, step = float(gx[top]), float(gy[top]), step / 3
    return x, y, float(values[top])


def _contour(height: Height, level: float, mine: NDArray[np.bool_], xs: Floats, ys: Floats) -> Floats:
    """Outer contour of a mask, moved onto the level where the level is near it."""
    found, _ = cv2.findContours(mine.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    pixels = max(found, key=len)[:, 0, :]
    step = float(xs[1] - xs[0])
    points = np.column_stack([xs[pixels[:, 0]], ys[pixels[:, 1]]])
    x, y = points[:, 0], points[:, 1]
    for _ in range(3):
        d = 1e-3
        fx = (height(x + d, y) - height(x - d, y)) / (2 * d)
        fy = (height(x, y + d) - height(x, y - d)) / (2 * d)
        off = (height(x, y) - level) / np.maximum(fx**2 + fy**2, 1e-12)
        far = np.hypot(off * fx, off * fy) > 3 * step  # at the ply's edge, the level is not nearby
        x, y = np.where(far, x, x - off * fx), np.where(far, y, y - off * fy)
    return np.column_stack([x, y])
