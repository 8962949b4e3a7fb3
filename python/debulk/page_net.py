"""A pocket's net before and after debulking as SVG: heights above the mold over a flat mold, seen from one side."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk.page_map import colours

if TYPE_CHECKING:
    from debulk.report import PocketNet, PocketReport

_WIDTH = 420.0
_ELEVATION = np.radians(32.0)
_EXAGGERATIONS = (1, 2, 3, 5, 8, 12, 20)
_COLOURS = 32

Floats = NDArray[np.float64]


class View(NamedTuple):
    """One drawing; only numbers went into its markup."""

    title: str
    markup: str
    low_mm: float
    high_mm: float


class NetViews(NamedTuple):
    """Before and after, at one scale."""

    views: list[View]
    width: float
    height: float
    exaggeration: int

    @property
    def size(self) -> int:
        """Bytes of the markup."""
        return sum(len(view.markup) for view in self.views)


def net_views(pocket: PocketReport) -> NetViews | None:
    """Draw a pocket's net, or return None if it has none."""
    net = pocket.net
    if net is None or len(net.nodes_mm) < 3:
        return None
    before = _initial_gap(pocket)
    states = [("before", net.nodes_mm, before)]
    if pocket.debulked_mm is not None and pocket.debulked_gap_mm is not None:
        states.append(("after debulking", pocket.debulked_mm, pocket.debulked_gap_mm))
    centre, turn = _side(net.nodes_mm)
    flat = [(nodes[:, :2] - centre) @ turn for _, nodes, _ in states]
    length = float(max(np.ptp(xy[:, 0]) for xy in flat)) or 1.0
    highest = float(max(np.max(gap) for _, _, gap in states))
    exaggeration = next((f for f in reversed(_EXAGGERATIONS) if f * highest <= 0.3 * length), 1)
    drawn = [
        np.column_stack([xy[:, 0], -(xy[:, 1] * np.sin(_ELEVATION) + exaggeration * gap * np.cos(_ELEVATION))])
        for xy, (_, _, gap) in zip(flat, states, strict=True)
    ]
    every = np.concatenate(drawn)
    scale = (_WIDTH - 20) / length
    low = every.min(axis=0)
    height = float(np.ptp(every[:, 1])) * scale + 20
    views = [
        View(title, _markup(net, (uv - low) * scale + 10, xy[:, 1], gap), float(gap.min()), float(gap.max()))
        for (title, _, gap), uv, xy in zip(states, drawn, flat, strict=True)
    ]
    return NetViews(views, _WIDTH, height, exaggeration)


def _initial_gap(pocket: PocketReport) -> Floats:
    """Heights before debulking; from the mold under the debulked nodes where the report has them not."""
    assert pocket.net is not None
    if pocket.initial_gap_mm is not None:
        return pocket.initial_gap_mm
    z = pocket.net.nodes_mm[:, 2]
    if pocket.debulked_mm is not None and pocket.debulked_gap_mm is not None:
        return np.asarray(z - (pocket.debulked_mm[:, 2] - pocket.debulked_gap_mm), dtype=np.float64)
    return np.asarray(z - z.min(), dtype=np.float64)


def _side(nodes: Floats) -> tuple[Floats, Floats]:
    """Return the centre and the axes that show the net's long side from the front."""
    centre = nodes[:, :2].mean(axis=0)
    axes = np.linalg.svd(nodes[:, :2] - centre, full_matrices=False)[2]
    long = axes[0] * (1.0 if axes[0, 0] >= 0 else -1.0)
    return centre, np.column_stack([long, [-long[1], long[0]]])


def _cells(net: PocketNet) -> NDArray[np.int64]:
    """(C, 4) corners of the net's full cells: a node, its e, the n of that, its own n."""
    count = len(net.nodes_mm)
    node = np.arange(count)
    east, north = net.neighbours[:, 0].astype(np.int64), net.neighbours[:, 2].astype(np.int64)
    far = np.where(east >= 0, north[east], -1)
    good = (east >= 0) & (north >= 0) & (far >= 0)
    good &= np.where(north >= 0, east[north], -1) == far
    return np.column_stack([node, east, far, north])[good]


def _markup(net: PocketNet, uv: Floats, depth: Floats, gap: Floats) -> str:
    """Cells from the back to the front, then loose segments, then nodes."""
    palette = colours(_COLOURS)
    span = max(float(np.ptp(gap)), 1e-9)

    def colour(heights: Floats) -> list[str]:
        levels = np.clip((heights - gap.min()) / span * (_COLOURS - 1), 0, _COLOURS - 1).round().astype(int)
        return [palette[level] for level in levels]

    parts = []
    cells = _cells(net)
    cells = cells[np.argsort(-depth[cells].mean(axis=1), kind="stable")]
    for corners, fill in zip(uv[cells].tolist(), colour(gap[cells].mean(axis=1)), strict=True):
        parts.append(f'<path fill="{fill}" d="M' + "L".join(f"{u:.1f} {v:.1f}" for u, v in corners) + 'Z"/>')
    lines = "".join(f"M{a[0]:.1f} {a[1]:.1f}L{b[0]:.1f} {b[1]:.1f}" for a, b in uv[net.edges].tolist())
    parts.append(f'<path class="fibre" d="{lines}"/>')
    order = np.argsort(-depth, kind="stable")
    fills = colour(gap)
    for k in order.tolist():
        u, v = uv[k].tolist()
        match int(net.kinds[k]):
            case 1:
                parts.append(f'<rect class="fixed" x="{u - 2.4:.1f}" y="{v - 2.4:.1f}" width="4.8" height="4.8"/>')
            case 2:
                parts.append(f'<path class="free" d="M{u:.1f} {v - 4:.1f}l3.6 6.4h-7.2Z"/>')
            case _:
                parts.append(f'<circle cx="{u:.1f}" cy="{v:.1f}" r="2.2" fill="{fills[k]}"/>')
    return "".join(parts)
