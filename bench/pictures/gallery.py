"""Make the pictures of docs/examples.md: each example runs as it stands, and what it leaves is drawn.

This needs Matplotlib (extra "bench").
"""

from __future__ import annotations

import runpy
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from browser import save
from PIL import Image

from debulk.results.looks import VERDICT_COLOURS, VERDICT_SIGNS
from debulk.verdict import Verdict

matplotlib.use("agg")
import matplotlib.pyplot as plt
from matplotlib.collections import LineCollection

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "docs" / "examples"


def cell_cycle(left: dict[str, Any]) -> plt.Figure:
    """The report that the cell stores."""
    return left["report"].plot().figure


def stack(left: dict[str, Any]) -> plt.Figure:
    """The ply after its vacuum, in the outlines of its pockets before it."""
    figure, axes = plt.subplots(figsize=(9, 6), layout="constrained")
    report = left["reports"][-1]
    heights = left["inspector"].compare(report, left["after_vacuum"]).height_map
    shown = axes.pcolormesh(heights.x_mm, heights.y_mm, heights.values, vmin=0, vmax=1.2, cmap="cividis")
    for pocket in report.pockets:
        axes.plot(*pocket.outline_mm.T, color=VERDICT_COLOURS[pocket.verdict], lw=1.6)
        axes.annotate(f"{pocket.id} {VERDICT_SIGNS[pocket.verdict]}", pocket.outline_mm.max(axis=0), color="white")
    figure.colorbar(shown, ax=axes, label="height after debulking, mm", shrink=0.7)
    axes.set(
        aspect="equal", xlabel="mold x, mm", ylabel="mold y, mm", title="after its vacuum, with what was predicted"
    )
    return figure


def limits(left: dict[str, Any]) -> plt.Figure:
    """How many pockets get which verdict by each recipe."""
    figure, axes = plt.subplots(figsize=(7, 2.6), layout="constrained")
    for row, found in enumerate(left["found"].values()):
        start = 0
        for verdict in Verdict:
            count = found.count(verdict.name)
            axes.barh(row, count, left=start, color=VERDICT_COLOURS[verdict], label=None if row else verdict.name)
            if count:
                axes.text(start + count / 2, row, count, ha="center", va="center", color="white", weight="bold")
            start += count
    axes.set(xlim=(0, 18), yticks=range(len(left["found"])), yticklabels=left["found"], xlabel="pockets")
    axes.invert_yaxis()
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(ncols=4, loc="lower right", bbox_to_anchor=(1, 1), frameon=False)
    return figure


def stages(left: dict[str, Any]) -> plt.Figure:
    """The net as laid, and at its minimum."""
    net, solution = left["net"], left["solution"]
    figure, both = plt.subplots(1, 2, figsize=(10, 3.4), subplot_kw={"projection": "3d"}, layout="constrained")
    for axes, nodes, title in (
        (both[0], net.nodes_mm, "laid on the scan"),
        (both[1], solution.nodes_mm, "under vacuum"),
    ):
        axes.add_collection3d(_segments(nodes[net.edges]))
        axes.scatter(*nodes[net.kinds == 1].T, s=6, color="black")
        low, high = nodes.min(axis=0), nodes.max(axis=0)
        axes.set(
            title=title,
            xlim=(low[0], high[0]),
            ylim=(low[1], high[1]),
            zlim=(0, net.nodes_mm[:, 2].max()),
            zlabel="mm",
            zticks=(0, 5),
        )
        axes.set_box_aspect((1, 1, 0.3))
    return figure


def _segments(ends: np.ndarray) -> LineCollection:
    from mpl_toolkits.mplot3d.art3d import Line3DCollection

    return Line3DCollection(ends, colors="#0a3d91", linewidths=1.0)


def main() -> None:
    """Run the examples and draw what they leave."""
    for draw in (cell_cycle, stack, limits, stages):
        name = draw.__name__
        figure = draw(runpy.run_path(str(EXAMPLES / f"{name}.py"), run_name="__main__"))
        figure.canvas.draw()
        drawn = Image.fromarray(np.asarray(figure.canvas.buffer_rgba())).convert("RGB")
        save(drawn, HERE / f"example_{name}.png")


if __name__ == "__main__":
    main()
