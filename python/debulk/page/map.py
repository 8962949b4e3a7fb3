"""The picture of the page: heights in colour, and over it the outlines of the ply and its pockets."""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk.page import map_marks
from debulk.page.map_marks import Spot, Tick

if TYPE_CHECKING:
    from debulk.grid import Grid
    from debulk.results.report import ReportData

_MAX_PIXELS = 1400  # width and height of the picture
_MAX_PNG_BYTES = 1_350_000
_MAX_CORNERS = 400  # of an outline as drawn
_MAX_ALL_CORNERS = 25_000


class Mark(NamedTuple):
    """A pocket on the map."""

    id: int
    verdict: str
    path: str
    label_x: float
    label_y: float
    anchor: str


class PlyMap(NamedTuple):
    """What the template draws; x to the right and y down, mm."""

    x: float
    y: float
    width: float
    height: float
    image: str
    image_box: tuple[float, float, float, float]
    top_mm: float
    ticks: list[tuple[float, str]]
    stops: list[str]
    ply: str
    marks: list[Mark]
    font: float
    x_ticks: list[Tick]
    y_ticks: list[Tick]
    holes: list[Spot]
    bumps: list[Spot]
    wrinkles: list[Spot]
    fibres: list[Spot]


def colours(count: int) -> list[str]:
    """Return cividis, which reads the same to the colour-blind and in grey, as so many hexadecimal colours."""
    ramp = np.linspace(0, 255, count).round().astype(np.uint8).reshape(-1, 1)
    table = cv2.applyColorMap(ramp, cv2.COLORMAP_CIVIDIS).reshape(-1, 3)
    return [f"#{r:02x}{g:02x}{b:02x}" for b, g, r in table.tolist()]


def path(points: NDArray[np.float64], corners: int) -> str:
    """Return a closed SVG path through (M, 2) points, y up, thinned to so many corners."""
    thin = points[:: max(1, math.ceil(len(points) / corners))]
    return "M" + "L".join(f"{x:.1f} {-y:.1f}" for x, y in thin.tolist()) + "Z"


class Area(NamedTuple):
    """A pocket to be drawn: its number, what the outline's colour says, and the outline."""

    id: int
    verdict: str
    outline_mm: NDArray[np.float64]


def ply_map(
    grid: Grid | None,
    ply_outline: NDArray[np.float64] | None,
    areas: Sequence[Area],
    top_mm: float | None,
    report: ReportData | None = None,
) -> PlyMap | None:
    """Return the map, or None if there is nothing to draw.

    Parameters
    ----------
    grid, ply_outline
        Heights, and the ply's edge; None: unknown.
    areas
        The pockets.
    top_mm
        Upper end of the colours; None: the highest that was seen but for a thousandth of the map.
    report
        Whose holes, bumps and fibre directions are marked; None: none are.
    """
    areas = [area for area in areas if len(area.outline_mm)]
    outlines = [area.outline_mm for area in areas]
    if ply_outline is not None:
        outlines.append(ply_outline)
    if outlines:
        corners = np.concatenate(outlines)
        low, high = corners.min(axis=0), corners.max(axis=0)
        margin = 0.015 * float((high - low).max()) + 2.0
        low, high = low - margin, high + margin
    elif grid is not None:
        low, high = np.array([grid.x_mm[0], grid.y_mm[0]]), np.array([grid.x_mm[-1], grid.y_mm[-1]])
    else:
        return None
    image, image_box, top = "", (0.0, 0.0, 0.0, 0.0), 1.0
    if grid is not None and grid.values.ndim == 2 and grid.values.size:
        cropped = _crop(grid, low, high, keep_all=ply_outline is None)
        if cropped is not None:
            values, first = cropped
            top = _top(top_mm, values)
            image = _png(values, top)
            half = 0.5 * grid.spacing_mm
            size = grid.spacing_mm * np.array(values.shape[::-1])
            image_box = (first[0] - half, -(first[1] - half + size[1]), float(size[0]), float(size[1]))
            if ply_outline is None:
                low, high = np.minimum(low, first - half), np.maximum(high, first - half + size)
    width, height = (float(length) for length in high - low)
    font = max(width, height) / (36 * float(np.clip(np.sqrt(len(areas) / 25), 1, 2)))
    corners_each = max(24, min(_MAX_CORNERS, _MAX_ALL_CORNERS // max(1, len(areas))))
    places = _labels([area.outline_mm for area in areas], font, low, high)
    marks = [
        Mark(area.id, area.verdict, path(area.outline_mm, corners_each), *place)
        for area, place in zip(areas, places, strict=True)
    ]
    step = nice(top / 5)
    ticks = [(100 * k * step / top, f"{k * step:g}") for k in range(int(top / step + 1e-9) + 1)]
    spacing = nice(max(width, height) / 8)
    ply = "" if ply_outline is None else path(ply_outline, _MAX_CORNERS)
    return PlyMap(
        float(low[0]), -float(high[1]), width, height, image, image_box, top, ticks, colours(12), ply, marks, font,
        map_marks.ticks(float(low[0]), float(high[0]), spacing, 1),
        map_marks.ticks(float(low[1]), float(high[1]), spacing, -1),
        map_marks.holes(report.unseen if report else ()),
        map_marks.bumps(report.left_out if report else (), report.pockets if report else (), 0.3 * font),
        map_marks.wrinkles(report.wrinkles if report else ()),
        map_marks.fibres(report.pockets if report else (), 0.7 * font),
    )  # fmt: skip


def _crop(
    grid: Grid, low: NDArray[np.float64], high: NDArray[np.float64], *, keep_all: bool
) -> tuple[NDArray[np.float32], NDArray[np.float64]] | None:
    """Cut the window out of the height map; with it the position of its first cell."""
    values = np.asarray(grid.values, dtype=np.float32)
    if keep_all:
        return values, np.asarray(grid.origin_mm, dtype=np.float64)
    ny, nx = values.shape
    i0, j0 = np.clip(np.floor((low - grid.origin_mm) / grid.spacing_mm).astype(int), 0, [nx, ny])
    i1, j1 = np.clip(np.ceil((high - grid.origin_mm) / grid.spacing_mm).astype(int) + 1, 0, [nx, ny])
    if i1 <= i0 or j1 <= j0:
        return None
    return values[j0:j1, i0:i1], grid.origin_mm + grid.spacing_mm * np.array([i0, j0])


def _top(top: float | None, values: NDArray[np.float32]) -> float:
    if top is None or not math.isfinite(top):
        seen = values[np.isfinite(values)]
        top = float(np.quantile(seen, 0.999)) if seen.size else 1.0
    return max(top, 0.1)


def nice(step: float) -> float:
    """Return the next of 1, 2, 5, 10 ... from a step up."""
    power = 10.0 ** math.floor(math.log10(step))
    return float(next(power * k for k in (1, 2, 5, 10) if power * k >= step * 0.999))


def _png(values: NDArray[np.float32], top: float) -> str:
    """Return the heights as a PNG in base64, north up; what is missing is transparent."""
    seen = np.isfinite(values)
    shown = np.where(seen, values, 0).astype(np.float32)[::-1]
    weight = seen.astype(np.float32)[::-1]
    scale = min(1.0, _MAX_PIXELS / max(values.shape))
    while True:
        size = tuple(max(1, round(length * scale)) for length in values.shape[::-1])
        share = cv2.resize(weight, size, interpolation=cv2.INTER_AREA)
        mean = cv2.resize(shown, size, interpolation=cv2.INTER_AREA) / np.maximum(share, 1e-6)
        level = np.clip(mean * (255 / top), 0, 255).round().astype(np.uint8)
        picture = cv2.cvtColor(cv2.applyColorMap(level, cv2.COLORMAP_CIVIDIS), cv2.COLOR_BGR2BGRA)
        picture[share < 0.5] = 0
        data = cv2.imencode(".png", picture, [cv2.IMWRITE_PNG_COMPRESSION, 6])[1].tobytes()
        if len(data) <= _MAX_PNG_BYTES:
            return base64.b64encode(data).decode("ascii")
        scale *= 0.8


def _labels(
    outlines: list[NDArray[np.float64]], font: float, low: NDArray[np.float64], high: NDArray[np.float64]
) -> list[tuple[float, float, str]]:
    """Put a number inside a large pocket, and beside a small one where it covers least of the others."""
    boxes = [np.concatenate([outline.min(axis=0), outline.max(axis=0)]) for outline in outlines]
    taken, places = list(boxes), []
    for own in boxes:
        middle = 0.5 * (own[:2] + own[2:])
        if (own[2:] - own[:2]).min() > 2.4 * font:
            spots = [(middle[0], middle[1], "middle")]
        else:
            spots = [
                (own[2] + 0.4 * font, middle[1], "start"),
                (own[0] - 0.4 * font, middle[1], "end"),
                (middle[0], own[3] + 0.8 * font, "middle"),
                (middle[0], own[1] - 0.8 * font, "middle"),
            ]
        costs = []
        for x, y, anchor in spots:
            box = _label_box(x, y, anchor, font)
            inside = np.clip(box, [*low, *low], [*high, *high])
            outside = np.prod(box[2:] - box[:2]) - np.prod(inside[2:] - inside[:2])
            others = [other for other in taken if len(spots) == 1 or other is not own]
            costs.append(2 * float(outside) + sum(_overlap(box, other) for other in others))
        x, y, anchor = spots[int(np.argmin(costs))]
        taken.append(_label_box(x, y, anchor, font))
        places.append((float(x), float(-y + 0.35 * font), anchor))
    return places


def _label_box(x: float, y: float, anchor: str, font: float) -> NDArray[np.float64]:
    """(4,) lower and upper corner of a label such as "12 ✓"."""
    width = 2.6 * font
    left = {"start": x, "end": x - width, "middle": x - 0.5 * width}[anchor]
    return np.array([left, y - 0.55 * font, left + width, y + 0.55 * font])


def _overlap(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    size = np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2])
    return float(np.prod(np.maximum(size, 0.0)))
