"""What the map shows instead of heights: how high a ridge the excess of the fibres makes, and how the ply shears."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk.grid import Grid
from debulk.page.heights import png
from debulk.page.scales import colours, nice, ridge_colours
from debulk.results.report import ReportData

_TIMES_LIMIT = 2.0  # the last colour of ridges
_LEAST_MM = 0.03  # excess from which it is drawn: less is noise
_LEAST_DEG = 1.0  # least range of the colours of shear: below it, noise would look like shear


class Layer(NamedTuple):
    """A PNG in base64, north up, transparent where there is nothing to show; its place; and the scale of its colours.

    `name` is its class on the page, `button` what the switch says, `key` what the colours mean, and `lines` an SVG path
    over the picture.
    """

    name: str
    button: str
    png: str
    box: tuple[float, float, float, float]
    top: float
    ticks: list[tuple[float, str]]
    ramp: str
    key: str
    lines: str


def layers(report: ReportData, png_bytes: int) -> list[Layer]:
    """Draw what the report has of them. Each picture is made coarser until it has no more than `png_bytes`."""
    made = (_excess_layer(report, png_bytes), _shear_layer(report, png_bytes))
    return [layer for layer in made if layer is not None]


def _excess_layer(report: ReportData, png_bytes: int) -> Layer | None:
    grid, limit = report.excess_map, report.limit_mm
    thickness = report.recipe.get("material", {}).get("thickness_mm")
    if grid is None or not grid.values.size or not limit or not thickness:
        return None
    top_mm = _TIMES_LIMIT * limit
    ridge_mm = _core.ridge.ridge_height_of_excess(np.asarray(grid.values, dtype=np.float64), thickness)
    lines = _long_fibres(report, limit)
    table = ridge_colours()
    ramp = f"{table[0]},{table[127]} 50%,{table[128]} 50%,{table[255]}"
    ticks = [(0.0, "0"), (50.0, f"{limit:g} limit"), (100.0, f"{top_mm:g}")]
    key = (
        "ridge, mm, that the excess of the fibres makes where it is largest; no colour: no fibre is too long for the "
        "mold there"
    )
    if lines:
        key += "; lines: the fibres that may exceed the limit, from where they leave the mold to where they come back"
    picture = _picture(grid, ridge_mm / top_mm, grid.values > _LEAST_MM, table, png_bytes)
    return Layer("excess", "fibres too long", *picture, top_mm, ticks, ramp, key, lines)


def _shear_layer(report: ReportData, png_bytes: int) -> Layer | None:
    grid = report.shear_map
    if grid is None or not np.isfinite(grid.values).any():
        return None
    top = nice(max(_LEAST_DEG, float(np.nanmax(grid.values))))
    locking = report.recipe.get("material", {}).get("locking_deg", 90.0)
    locked = _contours(grid, np.nan_to_num(grid.values) > locking)
    key = "shear of the ply, degrees: how far its fibres cross otherwise than at a right angle"
    if locked:
        key += f"; outlined: beyond the locking angle of {locking:g} degrees"
    ticks = [(0.0, "0"), (50.0, f"{top / 2:g}"), (100.0, f"{top:g}")]
    picture = _picture(grid, grid.values / top, np.isfinite(grid.values), colours(256), png_bytes)
    return Layer("shear", "shear of the ply", *picture, top, ticks, ",".join(colours(9)), key, locked)


def _picture(
    grid: Grid, shares: NDArray[np.floating], shown: NDArray[np.bool_], table: list[str], png_bytes: int
) -> tuple[str, tuple[float, float, float, float]]:
    """Paint shares of the scale, and return the picture and its place."""
    levels = np.where(shown, np.clip(255 * np.nan_to_num(shares), 0, 255).round(), 0).astype(np.uint8)[::-1]
    alpha = np.where(shown, 255, 0).astype(np.uint8)[::-1]
    painted = np.array([[int(colour[k : k + 2], 16) for k in (5, 3, 1)] for colour in table], dtype=np.uint8)

    def paint(size: tuple[int, int]) -> NDArray[np.uint8]:
        parts = (cv2.resize(one, size, interpolation=cv2.INTER_NEAREST) for one in (levels, alpha))
        coarse, seen = parts
        return np.dstack([painted[coarse], seen])

    ny, nx = grid.values.shape
    x, y = (np.asarray(grid.origin_mm) - grid.spacing_mm / 2).tolist()
    box = (x, -(y + ny * grid.spacing_mm), nx * grid.spacing_mm, ny * grid.spacing_mm)
    return png(paint, (nx, ny), png_bytes), box


def _long_fibres(report: ReportData, limit: float) -> str:
    known = [p.excess for p in report.pockets if p.excess is not None and p.excess.range_mm[1] > limit]
    ends = [(one.from_mm, one.to_mm) for one in known if one.from_mm is not None and one.to_mm is not None]
    return "".join(f"M{a[0]:.1f} {-a[1]:.1f}L{b[0]:.1f} {-b[1]:.1f}" for a, b in ends)


def _contours(grid: Grid, marked: NDArray[np.bool_]) -> str:
    """Return an SVG path round the cells of the marked points."""
    thirds = marked.astype(np.uint8).repeat(3, axis=0).repeat(3, axis=1)  # so that the path runs near the cells' sides
    found, _ = cv2.findContours(thirds, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    path = ""
    for contour in found:
        xy = grid.origin_mm + grid.spacing_mm * (contour.reshape(-1, 2) - 1) / 3
        path += "M" + "L".join(f"{x:.1f} {-y:.1f}" for x, y in xy.tolist()) + "Z"
    return path
