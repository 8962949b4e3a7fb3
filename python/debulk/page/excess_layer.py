"""The second layer of the map: how high a ridge the excess of the fibres makes at each place."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk.page.heights import png
from debulk.page.scales import ridge_colours

if TYPE_CHECKING:
    from debulk.results.report import ReportData

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
        table = np.array([[int(colour[k : k + 2], 16) for k in (5, 3, 1)] for colour in ridge_colours()])
        return np.dstack([table[levels], alpha]).astype(np.uint8)

    ny, nx = values.shape
    x, y = (np.asarray(grid.origin_mm) - grid.spacing_mm / 2).tolist()
    box = (x, -(y + ny * grid.spacing_mm), nx * grid.spacing_mm, ny * grid.spacing_mm)
    ticks = [(0.0, "0"), (50.0, f"{limit:g} limit"), (100.0, f"{top_mm:g}")]
    return ExcessLayer(png(paint, (nx, ny), png_bytes), box, top_mm, ticks, _lines(report, limit))


def _lines(report: ReportData, limit: float) -> str:
    known = [p.excess for p in report.pockets if p.excess is not None and p.excess.range_mm[1] > limit]
    ends = [(one.from_mm, one.to_mm) for one in known if one.from_mm is not None and one.to_mm is not None]
    return "".join(f"M{a[0]:.1f} {-a[1]:.1f}L{b[0]:.1f} {-b[1]:.1f}" for a, b in ends)
