"""A report as a Matplotlib picture (the extra "plot"); Matplotlib is imported only here."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from debulk._core import InputError
from debulk.arguments import of_type
from debulk.results.extras import imported
from debulk.results.notebook import VERDICT_COLOURS
from debulk.results.number import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from debulk.results.report import PocketReport, ReportData

__all__ = ["plot"]

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
        ax.plot(*_closed(report.ply_outline_mm), color="white", linewidth=1.0)
        low, high = report.ply_outline_mm.min(axis=0) - _MARGIN_MM, report.ply_outline_mm.max(axis=0) + _MARGIN_MM
        ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))  # beside the ply the scan does not show its height
    limit_mm = report.recipe.get("verdict", {}).get("max_ridge_mm")
    for pocket in report.pockets:
        _draw(pocket, ax, limit_mm)
    found = [verdict for verdict in VERDICT_COLOURS if any(p.verdict is verdict for p in report.pockets)]
    for verdict in found:
        ax.plot([], [], color=VERDICT_COLOURS[verdict], linewidth=2.5, label=verdict.name)
    if any(p.ridges for p in report.pockets):
        ax.plot([], [], color=_RIDGE, linewidth=2.0, label="predicted ridge; thin: below the limit")
    if found:
        ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=5, fontsize="small", facecolor="0.7")
    ax.set(aspect="equal", xlabel="mold x, mm", ylabel="mold y, mm", title=_title(report))
    return ax


def _draw(pocket: PocketReport, ax: Axes, limit_mm: float | None) -> None:
    if len(pocket.outline_mm):
        ax.plot(*_closed(pocket.outline_mm), color="black", linewidth=3.5)
        ax.plot(*_closed(pocket.outline_mm), color=VERDICT_COLOURS[pocket.verdict], linewidth=2.2)
    ridge = pocket.deciding_ridge
    low = ridge is not None and limit_mm is not None and ridge.most_mm <= limit_mm
    for line in (line for one in pocket.ridges for line in one.lines_mm):
        ax.plot(*line[:, :2].T, color=_RIDGE, linewidth=0.8 if low else 2.2)
    if len(pocket.outline_mm) and pocket.centroid_mm is not None:
        height = f": {number(ridge.height_mm, 2)} mm" if ridge else ""
        above = pocket.centroid_mm[0], float(pocket.outline_mm[:, 1].max())
        text = ax.annotate(
            f"{pocket.id}{height}", above, (0, 3), textcoords="offset points", ha="center", va="bottom", fontsize=8
        )
        effects = imported("matplotlib.patheffects", "plot", "plot")
        text.set_path_effects([effects.withStroke(linewidth=2.5, foreground="white")])


def _closed(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    x, y = np.vstack([corners, corners[:1]]).T
    return x, y


def _title(report: ReportData) -> str:
    counts = [f"{n} {v.name}" for v in VERDICT_COLOURS if (n := sum(p.verdict is v for p in report.pockets))]
    return f"{report.verdict.name}: {', '.join(counts) or 'no pocket'}"
