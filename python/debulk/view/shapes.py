"""The shapes that `view` draws, as points and lines in space, without Open3D."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError
from debulk.arrays import Floats
from debulk.page.net import cells_of
from debulk.page.scales import HeightScale, colours, ridge_colours
from debulk.pocket import inside_outline
from debulk.report import Report
from debulk.results.looks import VERDICT_COLOURS
from debulk.results.report import PocketReport
from debulk.view.strokes import strokes

Rgb = tuple[float, float, float]
_MAX_POINTS = 400_000
_MAGNIFICATIONS = (1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0)
_HIGH = 0.3  # heights with an automatic magnification stay below this share of the width
_ABOVE_MM = 0.3  # outlines are drawn this far above the cut height, clear of the ply
_BEFORE_RGB = (0.34, 0.71, 0.91)
_RIDGE_RGB = (1.0, 0.18, 0.49)
_LIMIT_MM = 0.6  # of a ridge, for the colours of a report without a recipe
_PER_CELL = 14  # points along each side of a net's cell: so many that the surface is closed
_STRAY = 99.9  # single heights above this percentile are not ply, unless a pocket is as high
_LETTERS = 0.026  # height of a pocket's number over the width of the whole drawing
_PIN = 1.6  # length of the pin below a number, in heights of the number
_DARK: Rgb = (0.1, 0.1, 0.1)
_NUMBER_RGB: Rgb = (0.8, 0.47, 0.65)  # readable on the map, on white, and in front of the nets of all verdicts


@dataclass(frozen=True, eq=False)
class Lines:
    """Coloured line segments."""

    corners: Floats
    segments: NDArray[np.int32]
    rgb: Floats
    """`corners`, `segments`, `rgb`: (M, 3) corners, (K, 2) numbers of a segment's corners, (K, 3) colours."""

    @classmethod
    def joined(cls, parts: Sequence[tuple[Floats, NDArray[np.int32], Rgb]]) -> Lines:
        """Join parts that each have one colour."""
        firsts = np.cumsum([0, *(len(corners) for corners, _, _ in parts)])
        return cls(
            corners=np.concatenate([np.empty((0, 3)), *(corners for corners, _, _ in parts)]),
            segments=np.concatenate(
                [np.empty((0, 2), np.int32), *(s + first for (_, s, _), first in zip(parts, firsts, strict=False))]
            ).astype(np.int32),
            rgb=np.concatenate([np.empty((0, 3)), *(np.tile(rgb, (len(s), 1)) for _, s, rgb in parts)]),
        )


@dataclass(frozen=True, eq=False)
class Shapes:
    """The shapes to draw, in mm, with heights above the reference, magnified."""

    magnify: float
    """Factor by which heights are drawn larger than lengths."""
    points: Floats
    point_rgb: Floats
    """`points`, `point_rgb`: (N, 3) points of the ply: of the height map in the colours of the page's map, and where a
    pocket has a net, of the ply after debulking, blue below the limit of a ridge and orange above it."""
    lines: Lines
    """Outlines in the verdict's colour, nets before debulking in light blue, and the predicted ridges that may exceed
    the limit."""
    labels: Lines
    """The pockets' numbers above the pockets, and one scale each for lengths and heights."""
    legend: tuple[tuple[Rgb, str], ...] = ()
    """What each colour means: its red, green and blue, and the words."""


def shapes(report: Report, pocket: int | None = None, magnify: float | None = None) -> Shapes:
    """Make the shapes that `view` draws; arguments and errors are the same."""
    if magnify is not None and not (np.isfinite(magnify) and magnify > 0):
        raise InputError(f"magnify: expected a positive factor, but got {magnify!r}")
    chosen = [p for p in report.pockets if pocket in (None, p.id)]
    if pocket is not None and not chosen:
        raise InputError(f"pocket: expected one of 1 to {len(report.pockets)}, but got {pocket!r}")
    limit = report.limit_mm or _LIMIT_MM
    points = _map_points(report, chosen, None if pocket is None else chosen[0])
    if len(points) == 0 and not chosen:
        raise InputError("report: expected a height map or a pocket to draw, but it has neither")
    cut = float(report.recipe.get("segmentation", {}).get("cut_height_mm", 2.0))
    parts = [part for p in chosen for part in _pocket_parts(p, cut + _ABOVE_MM, limit)]
    debulked = np.concatenate([np.empty((0, 3)), *(_debulked(p) for p in chosen)])
    lines = Lines.joined(parts)
    everything = np.concatenate([points, debulked, lines.corners])
    top = max(float(everything[:, 2].max()), 1.0)
    width = float(np.ptp(everything[:, :2], axis=0).max())
    if magnify is None:
        magnify = max([f for f in _MAGNIFICATIONS if f * top <= _HIGH * width], default=1.0)
    scale = np.array([1.0, 1.0, magnify])
    labels = [_number(p, magnify, _LETTERS * width) for p in chosen if len(p.outline_mm)]
    labels += _scales(everything, top, magnify)
    return Shapes(
        magnify=magnify,
        points=np.concatenate([points, debulked]) * scale,
        point_rgb=np.concatenate([HeightScale.up_to(top).paint(points[:, 2]) / 255, _ridge_rgb(debulked[:, 2], limit)]),
        lines=Lines(lines.corners * scale, lines.segments, lines.rgb),
        labels=Lines.joined(labels),
        legend=_legend(report, chosen, limit),
    )


def _components(colour: str) -> tuple[float, float, float]:
    """Red, green and blue, each from 0 to 1, of a colour such as #0072b2."""
    red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return red, green, blue


def _ridge_rgb(heights_mm: Floats, limit_mm: float) -> Floats:
    """Colours of the page's scale of ridges, which change at the limit."""
    table = np.array([_components(colour) for colour in ridge_colours(64)])
    return np.asarray(table[np.clip(heights_mm / (2 * limit_mm) * 64, 0, 63).astype(int)], dtype=np.float64)


def _legend(report: Report, chosen: Sequence[PocketReport], limit_mm: float) -> tuple[tuple[Rgb, str], ...]:
    """Name the colours that are drawn."""
    below, above = (_components(ridge_colours(64)[k]) for k in (24, 40))
    entries = [
        (_components(VERDICT_COLOURS[v]), f"outline of a pocket: {v.name}")
        for v in VERDICT_COLOURS
        if any(p.verdict is v for p in chosen)
    ]
    if any(p.net is not None for p in chosen):
        entries.append((_BEFORE_RGB, "ply before debulking, as a net"))
        entries.append((below, f"ply after debulking, as the net has it, below the limit of {limit_mm:g} mm"))
        entries.append((above, "the same, above the limit"))
    if any(p.ridges for p in chosen):
        entries.append((_RIDGE_RGB, "predicted ridge that may exceed the limit"))
    if report.height_map is not None:
        entries.append((_components(colours(8)[1]), "rest of the ply, lighter where it is higher"))
    return tuple(entries)


def _debulked(pocket: PocketReport) -> Floats:
    """Return (N, 3) points on the ply after debulking, over the cells of the pocket's net."""
    net, gap = pocket.net, pocket.post_processed_gap_mm
    if net is None or gap is None or pocket.debulked_mm is None:
        return np.empty((0, 3))
    corners = np.column_stack([pocket.debulked_mm[:, :2], gap])[cells_of(net)]
    u, v = (one.ravel()[None, :, None] for one in np.meshgrid(*[np.linspace(0.0, 1.0, _PER_CELL)] * 2))
    a, b, c, d = (corners[:, None, k] for k in range(4))
    return np.asarray(((1 - u) * (1 - v) * a + u * (1 - v) * b + u * v * c + (1 - u) * v * d).reshape(-1, 3))


def _map_points(report: Report, chosen: Sequence[PocketReport], pocket: PocketReport | None) -> Floats:
    """Points of the height map (round the pocket if one is chosen), no more than can be drawn.

    Where the ply after debulking is drawn, those of before are left out.
    """
    grid = report.height_map
    if grid is None:
        return np.empty((0, 3))
    known = np.isfinite(grid.values)
    if report.ply_outline_mm is not None:
        known &= inside_outline(report.ply_outline_mm, grid)
    for p in chosen:
        if p.net is not None and p.debulked_mm is not None and p.post_processed_gap_mm is not None:
            cells = np.rint((p.debulked_mm[cells_of(p.net), :2] - grid.origin_mm) / grid.spacing_mm).astype(np.int32)
            hidden = np.zeros(known.shape, dtype=np.uint8)
            for cell in cells:
                cv2.fillConvexPoly(hidden, cell, 1)
            known &= hidden == 0
    x, y = np.meshgrid(grid.x_mm, grid.y_mm)
    points = np.column_stack([x[known], y[known], grid.values[known].astype(np.float64)])
    if pocket is not None:
        low, high = pocket.outline_mm.min(axis=0) - 20.0, pocket.outline_mm.max(axis=0) + 20.0
        points = points[((points[:, :2] >= low) & (points[:, :2] <= high)).all(axis=1)]
    if len(points):
        peak = max((p.peak_mm for p in report.pockets), default=0.0)
        low_mm, high_mm = np.percentile(points[:, 2], [100 - _STRAY, _STRAY])
        points = points[(points[:, 2] >= low_mm) & (points[:, 2] <= max(high_mm, peak))]
    return points[:: max(1, -(-len(points) // _MAX_POINTS))]


def _pocket_parts(
    pocket: PocketReport, outline_height_mm: float, limit_mm: float
) -> list[tuple[Floats, NDArray[np.int32], Rgb]]:
    """Corners, segments and colour of a pocket's outline, its net before debulking, and ridges above the limit."""
    count = len(pocket.outline_mm)
    ring = np.column_stack([np.arange(count), np.roll(np.arange(count), -1)]).astype(np.int32)
    rgb = _components(VERDICT_COLOURS[pocket.verdict])
    parts = [(np.column_stack([pocket.outline_mm, np.full(count, outline_height_mm)]), ring, rgb)]
    if pocket.net is not None and pocket.initial_gap_mm is not None:
        nodes = np.column_stack([pocket.net.nodes_mm[:, :2], pocket.initial_gap_mm])
        parts.append((nodes, pocket.net.edges, _BEFORE_RGB))
    ridge = pocket.deciding_ridge
    height = ridge.height_mm if ridge else 0.0
    drawn = pocket.ridges if ridge is None or ridge.most_mm > limit_mm else ()
    for line in (line for one in drawn for line in one.lines_mm):
        steps = np.column_stack([np.arange(len(line) - 1), np.arange(1, len(line))]).astype(np.int32)
        parts.append((np.column_stack([line[:, :2], np.full(len(line), height + _ABOVE_MM)]), steps, _RIDGE_RGB))
    return parts


def _number(pocket: PocketReport, magnify: float, height: float) -> tuple[Floats, NDArray[np.int32], Rgb]:
    """Write a pocket's number upright on a pin above the pocket's highest point."""
    x, y = pocket.centroid_mm or pocket.outline_mm.mean(axis=0)
    corners, segments = strokes(str(pocket.id))
    peak = magnify * max(pocket.peak_mm, 0.0)
    across = corners[:, 0] - 0.5 * (corners[:, 0].min() + corners[:, 0].max())
    placed = np.column_stack(
        [x + height * across, np.full(len(corners), y), peak + height * (_PIN + 0.2 + corners[:, 1])]
    )
    pin = np.array([[x, y, peak], [x, y, peak + height * _PIN]])
    ends = np.array([[0, 1]], np.int32) + len(placed)
    return np.vstack([placed, pin]), np.vstack([segments, ends]), _NUMBER_RGB


def _scales(drawn: Floats, top_mm: float, magnify: float) -> list[tuple[Floats, NDArray[np.int32], Rgb]]:
    """Draw a bar of a round length in front of the ply, and an upright bar of a round height at its end."""
    (x, y), (right, back) = drawn[:, :2].min(axis=0), drawn[:, :2].max(axis=0)
    width = max(right - x, back - y, 1.0)
    letters, front = 1.2 * _LETTERS * width, y - 0.05 * width
    length, height = _round(0.25 * width), _round(top_mm)
    bars = np.array([[x, front, 0.0], [x + length, front, 0.0], [x, front, magnify * height]])
    parts = [(bars, np.array([[0, 1], [0, 2]], np.int32), _DARK)]
    for text, at_x, at_z in ((f"{length:g} mm", x + length + letters, 0.0), (f"{height:g} mm", None, magnify * height)):
        corners, segments = strokes(text)
        if at_x is None:  # to the left of the upright bar
            at_x = x - letters * (corners[:, 0].max() + 0.5)
        placed = np.column_stack(
            [at_x + letters * corners[:, 0], np.full(len(corners), front), at_z + letters * corners[:, 1]]
        )
        parts.append((placed, segments, _DARK))
    return parts


def _round(length: float) -> float:
    """Return the largest of 1, 2, 5, 10, ... that is not greater."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(max(f * power for f in (1, 2, 5) if f * power <= length * (1 + 1e-9)))
