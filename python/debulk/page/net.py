"""A pocket's net before and after debulking: heights above the mold, drawn over a flat mold, seen from one side.

`net_views` draws the still picture, which appears without a script and in print. `templates/turn.js` draws the same
from the same coordinates when the reader turns it, and a test compares the two.
"""

from __future__ import annotations

import json
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats
from debulk.page.scales import colours, ridge_colours
from debulk.results.report import PocketNet, PocketReport

WIDTH, HEIGHT = 420, 260
COLOURS = 32
AFTER = "after debulking"
COARSE = "coarse net at its minimum"
_EDGE = 12.0
_ELEVATION = np.radians(32.0)
_EXAGGERATIONS = (1, 2, 3, 5, 8, 12, 20)


class View(NamedTuple):
    """One drawing; its markup contains nothing from the report but numbers."""

    title: str
    markup: str
    high_mm: float
    lift: int = 1

    @property
    def coarse(self) -> bool:
        """Whether this is the net that was solved."""
        return self.title == COARSE

    @property
    def after(self) -> bool:
        """Whether this is the ply after debulking, in the colours of ridges."""
        return self.title == AFTER


class NetViews(NamedTuple):
    """The net before and after, at the same scale; `data` is what the script turns.

    The last view is the coarse net that was solved. The view before it is the ply derived from it, with ridges as high
    as those of the real ply: beside the pocket they would be invisible, so its heights are drawn `lift` times as high
    as those of the other views, in colours that change at the limit of a ridge.
    """

    views: list[View]
    exaggeration: int
    top_mm: float
    data: str

    @property
    def size(self) -> int:
        """Bytes of markup."""
        return sum(len(view.markup) for view in self.views)


def net_views(pocket: PocketReport, limit_mm: float, section: list[int] | None = None) -> NetViews | None:
    """Draw a pocket's net, or return None if it has none; `section` are the nodes that the profile shows."""
    net = pocket.net
    if net is None or len(net.nodes_mm) < 3:
        return None
    states = [("before", net.nodes_mm, initial_gap(pocket))]
    if pocket.debulked_mm is not None and pocket.debulked_gap_mm is not None:
        if pocket.post_processed_gap_mm is not None:
            states.append((AFTER, pocket.debulked_mm, pocket.post_processed_gap_mm))
        states.append((COARSE, pocket.debulked_mm, pocket.debulked_gap_mm))
    turn = _side(net.nodes_mm)
    flat = [nodes[:, :2] @ turn for _, nodes, _ in states]
    every = np.concatenate(flat)
    centre = 0.5 * (every.min(axis=0) + every.max(axis=0))
    # The script gets the same values that are drawn here, equally rounded, to keep them small.
    solids = [np.column_stack([xy - centre, gap]).round(2) + 0.0 for xy, (_, _, gap) in zip(flat, states, strict=True)]
    radius = max(float(np.hypot(s[:, 0], s[:, 1]).max()) for s in solids) or 1.0
    top = max(float(s[:, 2].max()) for s in solids)
    exaggeration = next((f for f in reversed(_EXAGGERATIONS) if f * top <= 0.6 * radius), 1)
    # Twice the limit is the end of the ridges' scale, and may be as high as the pocket; a laid ply stays flat.
    after = {title: max(float(gap.max()), 2 * limit_mm) for title, _, gap in states if title == AFTER}
    lifts = [
        max((f for f in _EXAGGERATIONS if f * after[title] <= top), default=1) if title in after else 1
        for title, _, _ in states
    ]
    raised = [np.column_stack([s[:, :2], lift * s[:, 2]]) for s, lift in zip(solids, lifts, strict=True)]
    frame = _frame(raised, radius, exaggeration)
    scales = [(2 * limit_mm, ridge_colours(COLOURS)) if t in after else (top, colours(COLOURS)) for t, _, _ in states]
    shape = _Shape(cells_of(net), net.kinds.tolist(), section or [])
    loose = _loose(net, shape.cells)
    views = [
        View(title, _markup(solid, shape, loose, frame, exaggeration * lift, scale), float(gap.max()), lift)
        for solid, (title, _, gap), lift, scale in zip(solids, states, lifts, scales, strict=True)
    ]
    data: dict[str, Any] = {
        "states": [s.ravel().tolist() for s in solids],
        "cells": shape.cells.ravel().tolist(),
        "loose": loose.ravel().tolist(),
        "kinds": "".join(map(str, shape.kinds)),
        "section": shape.section,
        "radius": round(radius, 2),
        "tops": [round(scale[0], 2) for scale in scales],
        "lifts": lifts,
        "after": [int(title in after) for title, _, _ in states],
        "heights": exaggeration,
    }
    return NetViews(views, exaggeration, top, json.dumps(data, separators=(",", ":")))


def initial_gap(pocket: PocketReport) -> Floats:
    """Heights before debulking; if the report does not have them, from the mold under the debulked nodes."""
    assert pocket.net is not None
    if pocket.initial_gap_mm is not None:
        return pocket.initial_gap_mm
    z = pocket.net.nodes_mm[:, 2]
    if pocket.debulked_mm is not None and pocket.debulked_gap_mm is not None:
        return np.asarray(z - (pocket.debulked_mm[:, 2] - pocket.debulked_gap_mm), dtype=np.float64)
    return np.asarray(z - z.min(), dtype=np.float64)


class _Frame(NamedTuple):
    """Scale, and height in the middle of the picture."""

    scale: float
    middle: float


class _Shape(NamedTuple):
    cells: NDArray[np.int64]
    kinds: list[int]
    section: list[int]


def _frame(solids: list[Floats], radius: float, exaggeration: int) -> _Frame:
    """Fit the nets into the picture for any rotation about the vertical, so that turning never changes the scale."""
    sine, cosine = np.sin(_ELEVATION), np.cos(_ELEVATION)
    every = np.concatenate(solids)
    reach, raised = np.hypot(every[:, 0], every[:, 1]) * sine, exaggeration * every[:, 2] * cosine
    low, high = float((raised - reach).min()), float((raised + reach).max())
    scale = min((WIDTH - 2 * _EDGE) / (2 * radius), (HEIGHT - 2 * _EDGE) / max(high - low, 1e-9))
    return _Frame(scale, 0.5 * (low + high))


def _side(nodes: Floats) -> Floats:
    """Return the axes that show the net's long side from the front."""
    axes = np.linalg.svd(nodes[:, :2] - nodes[:, :2].mean(axis=0), full_matrices=False)[2]
    long = axes[0] * (1.0 if axes[0, 0] >= 0 else -1.0)
    return np.column_stack([long, [-long[1], long[0]]])


def cells_of(net: PocketNet) -> NDArray[np.int64]:
    """Return the (C, 4) corners of the net's complete cells: a node, its e, the n of that node, and its own n."""
    count = len(net.nodes_mm)
    node = np.arange(count)
    east, north = net.neighbours[:, 0].astype(np.int64), net.neighbours[:, 2].astype(np.int64)
    far = np.where(east >= 0, north[east], -1)
    good = (east >= 0) & (north >= 0) & (far >= 0)
    good &= np.where(north >= 0, east[north], -1) == far
    return np.column_stack([node, east, far, north])[good]


def _loose(net: PocketNet, cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """(K, 2) segments that border on no complete cell."""
    sides = {
        frozenset((int(a), int(b))) for a, b in zip(cells.ravel(), np.roll(cells, -1, axis=1).ravel(), strict=True)
    }
    loose = [edge for edge in net.edges.tolist() if frozenset(edge) not in sides]
    return np.array(loose, dtype=np.int64).reshape(-1, 2)


def _markup(
    solid: Floats,
    shape: _Shape,
    loose: NDArray[np.int64],
    frame: _Frame,
    exaggeration: int,
    scale: tuple[float, list[str]],
) -> str:
    """Draw cells, segments without cells and nodes from back to front, and over all of it the section.

    `scale` has the gap with the last colour, and the colours.
    """
    (top, palette), cells = scale, shape.cells
    sine, cosine = np.sin(_ELEVATION), np.cos(_ELEVATION)
    x, y, h = solid.T
    raised = exaggeration * h
    u = 0.5 * WIDTH + frame.scale * x
    v = 0.5 * HEIGHT - frame.scale * (y * sine + raised * cosine - frame.middle)
    depth = y * cosine - raised * sine

    def colour(heights: Floats) -> list[str]:
        level = np.clip(np.floor(heights / max(top, 1e-9) * COLOURS), 0, COLOURS - 1).astype(int)
        return [palette[k] for k in level]

    at = [f"{a:.1f} {b:.1f}" for a, b in zip(u.tolist(), v.tolist(), strict=True)]
    parts: list[tuple[float, str]] = []
    nearest = depth.copy()  # a node lies on top of the cells that it belongs to
    if len(cells):
        away = depth[cells].mean(axis=1)
        np.minimum.at(nearest, cells.ravel(), np.repeat(away, 4))
        for corners, fill, far in zip(cells.tolist(), colour(h[cells].mean(axis=1)), away.tolist(), strict=True):
            parts.append((far, f'<path fill="{fill}" d="M{"L".join(at[k] for k in corners)}Z"/>'))
    parts += [(float(depth[[a, b]].mean()), f'<path d="M{at[a]}L{at[b]}"/>') for a, b in loose.tolist()]
    for k, fill in enumerate(colour(h)):
        match shape.kinds[k]:
            case 1:
                mark = f'<path class="fixed" d="M{at[k]}m-2 -2h4v4h-4z"/>'
            case 2:
                mark = f'<path class="free" d="M{at[k]}m0 -4l3.6 6.4h-7.2z"/>'
            case _:
                mark = f'<circle cx="{u[k]:.1f}" cy="{v[k]:.1f}" r="2.2" fill="{fill}"/>'
        parts.append((float(nearest[k]) - 1e-6, mark))
    parts.sort(key=lambda part: -part[0])
    drawn = "".join(mark for _, mark in parts)
    if len(shape.section) > 1:
        drawn += f'<path class="section" d="M{"L".join(at[k] for k in shape.section)}"/>'
    return drawn
