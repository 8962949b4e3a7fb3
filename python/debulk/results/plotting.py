"""A report as a Matplotlib picture (the extra "plot"); Matplotlib is imported only here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from debulk import rings
from debulk._core import InputError
from debulk.arguments import of_type
from debulk.results.extras import imported
from debulk.results.looks import VERDICT_COLOURS, VERDICT_SIGNS
from debulk.results.number import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Annotation
    from matplotlib.transforms import Bbox

    from debulk.results.report import PocketReport, ReportData

_MARGIN_MM = 20.0  # margin round the ply
_RIDGE = "#ff2f7e"  # as on the page
_HIGHEST = 99.9  # percentile of the heights at which the colours end: so that single spikes do not set the scale


def plot(report: ReportData, ax: Axes | None = None) -> Axes:
    """Draw the map with the pockets, and return its axes."""
    if ax is not None and not hasattr(ax, "imshow"):
        raise InputError(f"ax: expected axes of Matplotlib, but got {of_type(ax)}")
    if ax is None:
        ax = imported("matplotlib.pyplot", "plot", "plot").subplots(figsize=(9, 6.5), layout="constrained")[1]
    grid = report.height_map
    if grid is not None and np.isfinite(grid.values).any():
        half = grid.spacing_mm / 2
        extent = (grid.x_mm[0] - half, grid.x_mm[-1] + half, grid.y_mm[0] - half, grid.y_mm[-1] + half)
        top = max(float(np.nanpercentile(grid.values, _HIGHEST)), 1e-3)
        norm = imported("matplotlib.colors", "plot", "plot").PowerNorm(
            0.5, vmin=0.0, vmax=top, clip=True
        )  # so that small heights show
        image = ax.imshow(grid.values, origin="lower", extent=extent, cmap="cividis", norm=norm)
        ax.figure.colorbar(image, ax=ax, label="height above the reference, mm", shrink=0.8)
    if report.ply_outline_mm is not None:
        for ring in rings.split(report.ply_outline_mm):
            ax.plot(*_closed(ring), color="white", linewidth=1.0)
        low, high = report.ply_outline_mm.min(axis=0) - _MARGIN_MM, report.ply_outline_mm.max(axis=0) + _MARGIN_MM
        ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))  # beside the ply the scan does not show its height
    names = [text for pocket in report.pockets if (text := _draw(pocket, ax, report.limit_mm)) is not None]
    found = [verdict for verdict in VERDICT_COLOURS if any(p.verdict is verdict for p in report.pockets)]
    for verdict in found:
        ax.plot([], [], color=VERDICT_COLOURS[verdict], linewidth=2.5, label=f"{VERDICT_SIGNS[verdict]} {verdict.name}")
    if any(p.ridges for p in report.pockets):
        ax.plot([], [], color=_RIDGE, linewidth=2.0, label="predicted ridge; thin: below the limit")
    if found:
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=5, fontsize="small", facecolor="0.7")
    ax.set(aspect="equal", xlabel="mold x, mm", ylabel="mold y, mm", title=_title(report))
    _part(names, ax)
    return ax


def _draw(pocket: PocketReport, ax: Axes, limit_mm: float | None) -> Annotation | None:
    """Draw a pocket, and return its label; None if it has no place."""
    if len(pocket.outline_mm):
        ax.plot(*_closed(pocket.outline_mm), color="black", linewidth=3.5)
        ax.plot(*_closed(pocket.outline_mm), color=VERDICT_COLOURS[pocket.verdict], linewidth=2.2)
    ridge = pocket.deciding_ridge
    low = ridge is not None and limit_mm is not None and ridge.most_mm <= limit_mm
    for line in (line for one in pocket.ridges for line in one.lines_mm):
        ax.plot(*line[:, :2].T, color=_RIDGE, linewidth=0.8 if low else 2.2)
    if not len(pocket.outline_mm) or pocket.centroid_mm is None:
        return None
    height = f": {number(ridge.height_mm, 2)} mm" if ridge else ""
    above = pocket.centroid_mm[0], float(pocket.outline_mm[:, 1].max())
    name = f"{pocket.id} {VERDICT_SIGNS[pocket.verdict]}{height}"
    text = ax.annotate(name, above, (0, 3), textcoords="offset points", ha="center", va="bottom", fontsize=8)
    effects = imported("matplotlib.patheffects", "plot", "plot")
    text.set_path_effects([effects.withStroke(linewidth=2.5, foreground="white")])
    return text


def _part(names: Sequence[Annotation], ax: Axes) -> None:
    """Move each label to the side of its place where it covers the labels before it least."""
    for text in names:
        text.set_in_layout(False)
    for _ in range(3):  # only then are the sizes of the texts known, and the layout changes no more
        ax.figure.canvas.figure.draw_without_rendering()
    inside = ax.get_window_extent()
    taken: list[Bbox] = []
    for text in names:
        boxes = []
        for x, y in _SIDES:
            text.set_position((x, y))
            box = text.get_window_extent().padded(2)
            covered = sum(_shared(box, other) for other in taken)
            out = box.width * box.height - _shared(box, inside)
            boxes.append((covered + out, (x, y), box))
        _, place, box = min(boxes, key=lambda one: one[0])
        text.set_position(place)
        taken.append(box)


def _shared(a: Bbox, b: Bbox) -> float:
    """Return the area that two boxes share."""
    width, height = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
    return float(max(0.0, width) * max(0.0, height))


_SIDES = (
    (0, 3), (0, 14), (34, 3), (-34, 3), (34, -12), (-34, -12), (0, -24), (40, 16), (-40, 16), (0, 25), (58, 3),
    (-58, 3), (50, -24), (-50, -24),
)  # fmt: skip  # points


def _closed(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    x, y = np.vstack([corners, corners[:1]]).T
    return x, y


def _title(report: ReportData) -> str:
    counts = [f"{n} {v.name}" for v in VERDICT_COLOURS if (n := sum(p.verdict is v for p in report.pockets))]
    return f"{report.verdict.name}: {', '.join(counts) or 'no pocket'}"
