"""The second layer of the map: how high a ridge the excess of the fibres makes at each place."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk.page.heights import png

if TYPE_CHECKING:
    from debulk.results.report import ReportData

__all__ = ["ExcessLayer", "excess_layer", "ridge_colours"]

# Below the limit blue, above it orange, which colour-blind people tell apart.
_BELOW, _ABOVE = ((0xE3, 0xEC, 0xF7), (0x4C, 0x7F, 0xB8)), ((0xF7, 0xA8, 0x55), (0x7F, 0x2A, 0x04))
_TIMES_LIMIT = 2.0  # the last colour
_LEAST_MM = 0.03  # excess from which it is drawn: less is noise


class ExcessLayer(NamedTuple):
    """A PNG in base64, north up, transparent where no fibre is too long; its place; and the scale of its colours.

    `lines` is an SVG path along the fibre of each pocket that may exceed the limit.
    """

    png: str
    box: tuple[float, float, float, float]
    top_mm: float
    ticks: list[tuple[float, str]]
    lines: str


def excess_layer(report: ReportData, png_bytes: int) -> ExcessLayer | None:
    """Draw the ridges that the excess makes; None if the report does not have the excess, or no limit.

    The picture is made coarser until it has no more than `png_bytes`.
    """
    grid, limit = report.excess_map, report.recipe.get("verdict", {}).get("max_ridge_mm")
    thickness = report.recipe.get("material", {}).get("thickness_mm")
    if grid is None or not grid.values.size or not limit or not thickness:
        return None
    values = np.asarray(grid.values, dtype=np.float64)[::-1]
    top_mm = _TIMES_LIMIT * limit

    def paint(size: tuple[int, int]) -> NDArray[np.uint8]:
        excess_mm = cv2.resize(values, size, interpolation=cv2.INTER_NEAREST)
        ridge_mm = _core.ridge.ridge_height_of_excess(excess_mm, thickness)
        levels = np.clip(255 * ridge_mm / top_mm, 0, 255).round().astype(np.uint8)
        alpha = np.where(excess_mm > _LEAST_MM, 255, 0)
        return np.dstack([np.array(_table())[levels][..., ::-1], alpha]).astype(np.uint8)

    ny, nx = values.shape
    x, y = (np.asarray(grid.origin_mm) - grid.spacing_mm / 2).tolist()
    box = (x, -(y + ny * grid.spacing_mm), nx * grid.spacing_mm, ny * grid.spacing_mm)
    ticks = [(0.0, "0"), (50.0, f"{limit:g} limit"), (100.0, f"{top_mm:g}")]
    return ExcessLayer(png(paint, (nx, ny), png_bytes), box, top_mm, ticks, _lines(report, limit))


def ridge_colours() -> list[str]:
    """Return the hexadecimal colours of the scale, which changes at the limit, in its middle."""
    return [f"#{r:02x}{g:02x}{b:02x}" for r, g, b in _table()]


def _table() -> list[tuple[int, int, int]]:
    def ramp(ends: tuple[tuple[int, int, int], tuple[int, int, int]]) -> NDArray[np.int64]:
        share = np.linspace(0.0, 1.0, 128)[:, None]
        mixed = (1 - share) * np.array(ends[0], dtype=np.float64) + share * np.array(ends[1], dtype=np.float64)
        return np.asarray(np.rint(mixed), dtype=np.int64)

    return [(int(r), int(g), int(b)) for r, g, b in np.vstack([ramp(_BELOW), ramp(_ABOVE)])]


def _lines(report: ReportData, limit: float) -> str:
    known = [p.excess for p in report.pockets if p.excess is not None and p.excess.range_mm[1] > limit]
    ends = [(one.from_mm, one.to_mm) for one in known if one.from_mm is not None and one.to_mm is not None]
    return "".join(f"M{a[0]:.1f} {-a[1]:.1f}L{b[0]:.1f} {-b[1]:.1f}" for a, b in ends)
