"""The map on the page: heights in colour, with the outlines of the ply and its pockets over them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk import rings
from debulk.grid import Grid
from debulk.page import map_frame, map_marks
from debulk.page.heights import MAX_PNG_BYTES, picture
from debulk.page.map_frame import Frame, Rose
from debulk.page.map_labels import labels
from debulk.page.map_layers import Layer, layers
from debulk.page.map_marks import Spot, Tick
from debulk.page.map_ridges import Ridge
from debulk.page.scales import nice
from debulk.results.advice import advice
from debulk.results.report import ReportData
from debulk.verdict import Verdict

_MAX_CORNERS = 400  # largest number in an outline as drawn
_MAX_ALL_CORNERS = 25_000


class Mark(NamedTuple):
    """A pocket on the map; `says` is shown beside the cursor."""

    id: int
    verdict: Verdict
    says: str
    path: str
    label_x: float
    label_y: float
    anchor: str


class PlyMap(NamedTuple):
    """The content of the map as the template draws it; x to the right and y down, mm."""

    x: float
    y: float
    width: float
    height: float
    image: str
    image_box: tuple[float, float, float, float]
    hatch: str
    top_mm: float
    stops: list[str]
    ticks: list[tuple[float, str]]
    ply: str
    marks: list[Mark]
    font: float
    x_ticks: list[Tick]
    y_ticks: list[Tick]
    holes: list[Spot]
    bumps: list[Spot]
    wrinkles: list[Spot]
    fibres: list[Spot]
    pushes: list[map_marks.Push]
    ridges: Sequence[Ridge]
    measured: str
    frame: Frame
    rose: Rose | None
    layers: list[Layer]

    @property
    def verdicts(self) -> list[Verdict]:
        """Those of its pockets."""
        return [verdict for verdict in Verdict if any(mark.verdict is verdict for mark in self.marks)]


def path(points: NDArray[np.float64], corners: int) -> str:
    """Return a closed SVG path through each ring of (M, 2) points, y up, thinned to the given number of corners."""
    parts = rings.split(points)
    every = max(1, math.ceil(len(points) / corners))
    thin = [ring[:: min(every, max(1, len(ring) // 4))] for ring in parts] if len(parts) > 1 else [points[::every]]
    return "".join("M" + "L".join(f"{x:.1f} {-y:.1f}" for x, y in ring.tolist()) + "Z" for ring in thin)


class Area(NamedTuple):
    """A pocket to be drawn: its number, the meaning of its colour, its outline, and the text beside the cursor."""

    id: int
    verdict: Verdict
    outline_mm: NDArray[np.float64]
    says: str = ""


def ply_map(
    grid: Grid | None,
    ply_outline: NDArray[np.float64] | None,
    areas: Sequence[Area],
    top_mm: float | None,
    report: ReportData | None = None,
    ridges: Sequence[Ridge] = (),
    measured: str = "",
    png_bytes: int = MAX_PNG_BYTES,
) -> PlyMap | None:
    """Return the map, or None if there is nothing to draw.

    The colours end at `top_mm`; None: at the highest that was seen, apart from a thousandth of the map. A `report` adds
    holes, bumps, fibre directions and the layers of the fibres' excess and of shear; `measured` is the path of the
    ridges that a second scan shows. The picture of the heights takes at most `png_bytes`.
    """
    areas = [area for area in areas if len(area.outline_mm)]
    outlines = [area.outline_mm for area in areas]
    bounds = _bounds(grid, outlines if ply_outline is None else [*outlines, ply_outline])
    if bounds is None:
        return None
    low, high = bounds
    drawn = None
    if grid is not None and grid.values.ndim == 2 and grid.values.size:
        drawn = picture(grid, low, high, top_mm, keep_all=ply_outline is None, png_bytes=png_bytes)
    if drawn is not None and ply_outline is None:
        low, high = np.minimum(low, drawn.low), np.maximum(high, drawn.high)
    width, height = (float(length) for length in high - low)
    font = max(width, height) / (36 * float(np.clip(np.sqrt(len(areas) / 25), 1, 2)))
    image_box = drawn.box if drawn else (0.0, 0.0, 0.0, 0.0)
    spacing = nice(max(width, height) / 8)
    pushes = map_marks.pushes(advice(report) if report else (), font)
    return PlyMap(
        float(low[0]), -float(high[1]), width, height,
        drawn.png if drawn else "", image_box, map_marks.hatch(image_box, 0.35 * font) if drawn else "",
        drawn.scale.top_mm if drawn else 1.0,
        drawn.scale.stops() if drawn else [], drawn.scale.ticks() if drawn else [],
        "" if ply_outline is None else path(ply_outline, _MAX_CORNERS),
        _marks(areas, font, low, high, pushes), font,
        map_marks.ticks(float(low[0]), float(high[0]), spacing, 1),
        map_marks.ticks(float(low[1]), float(high[1]), spacing, -1),
        map_marks.holes(report.unseen if report else ()),
        map_marks.bumps(report.left_out if report else (), report.pockets if report else (), 0.3 * font),
        map_marks.wrinkles(report.wrinkles if report else ()),
        map_marks.fibres(report.pockets if report else (), 0.7 * font),
        pushes,
        ridges, measured,
        map_frame.frame(low, high, font), map_frame.rose(report, outlines, low, high, font),
        layers(report, png_bytes) if report and drawn else [],
    )  # fmt: skip


def _bounds(
    grid: Grid | None, outlines: Sequence[NDArray[np.float64]]
) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
    """Corners of the drawing: round all outlines with a margin or, if there are none, round the heights."""
    if outlines:
        corners = np.concatenate(outlines)
        low, high = corners.min(axis=0), corners.max(axis=0)
        margin = 0.015 * float((high - low).max()) + 2.0
        return low - margin, high + margin
    if grid is not None:
        return np.array([grid.x_mm[0], grid.y_mm[0]]), np.array([grid.x_mm[-1], grid.y_mm[-1]])
    return None


def _marks(
    areas: Sequence[Area],
    font: float,
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    pushes: Sequence[map_marks.Push],
) -> list[Mark]:
    corners_each = max(24, min(_MAX_CORNERS, _MAX_ALL_CORNERS // max(1, len(areas))))
    arrows = [np.array([[p.x, -p.y], [p.x + p.tip[0], -p.y - p.tip[1]]]) for p in pushes]
    places = labels([area.outline_mm for area in areas], font, low, high, arrows)
    return [
        Mark(area.id, area.verdict, area.says, path(area.outline_mm, corners_each), *place)
        for area, place in zip(areas, places, strict=True)
    ]
