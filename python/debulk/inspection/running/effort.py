"""An estimate of what a recipe costs, so that one that takes hours or gigabytes is refused beforehand."""

from __future__ import annotations

import numpy as np

from debulk._core import InputError
from debulk.arrays import Floats
from debulk.recipe import Recipe

_MOST_GB = 4.0  # for a height map and all the maps that are kept beside it
_CELL_BYTES = 80  # per cell, for all maps together
# A hole of this width takes about a second and 64 MB, which grow as the fourth and the third power of its width.
_MOST_HOLE_CELLS = 200
_MOST_POCKET_S = 60.0  # sixty such pockets take an hour
# Time of one start on one thread, measured with nets of 100, 300 and 900 nodes, and how many times slower the other
# methods are (bench/study/study.txt).
_HUNDRED_NODES_S, _POWER = 0.004, 2.3
_TIMES_SLOWER = {"ipopt": 25.0, "nlopt": 250.0}


def check_map(low_mm: Floats, high_mm: Floats, spacing_mm: float, recipe: Recipe) -> None:
    """Refuse a height map that takes gigabytes for this box, and holes in it that take minutes each.

    The error names the setting, the estimate and what would be accepted.
    """
    columns, rows = np.maximum(1.0, (high_mm - low_mm) / spacing_mm)
    gigabytes = columns * rows * _CELL_BYTES / 1e9
    if gigabytes > _MOST_GB:
        coarser = spacing_mm * np.sqrt(gigabytes / _MOST_GB)
        raise InputError(
            f"clean.grid_spacing_mm: expected a height map of at most {_MOST_GB:g} GB, but {spacing_mm:.3g} mm over "
            f"{columns * spacing_mm:.0f} by {rows * spacing_mm:.0f} mm takes about {gigabytes:.3g} GB; take "
            f"{coarser:.2g} mm or more, and see that the reference has no stray points far off"
        )
    cells = recipe.clean.max_hole_mm / spacing_mm
    if cells > _MOST_HOLE_CELLS:
        seconds = (cells / _MOST_HOLE_CELLS) ** 4
        raise InputError(
            f"clean.max_hole_mm: expected at most {_MOST_HOLE_CELLS * spacing_mm:g} mm, {_MOST_HOLE_CELLS} spacings of "
            f"the height map, but got {recipe.clean.max_hole_mm:g} mm: filling one such hole takes about "
            f"{_duration(seconds)}"
        )


def check_solves(recipe: Recipe, area_mm2: float | None = None) -> None:
    """Refuse settings with which the solves of one pocket take more than a minute.

    The area of a pocket's foot is needed if the recipe sets the spacing of the nets; None if it is not known yet.
    """
    net, solve = recipe.net, recipe.solve
    if net.spacing_mm is None:
        nodes, name = float(net.node_target), "net.node_target"
    elif area_mm2 is None:
        return
    else:
        nodes, name = area_mm2 / net.spacing_mm**2, "net.spacing_mm"
    starts = max(solve.starts, solve.most_starts)
    one_s = _HUNDRED_NODES_S * (nodes / 100) ** _POWER * _TIMES_SLOWER.get(solve.method, 1.0)
    if starts * one_s > _MOST_POCKET_S:
        raise InputError(
            f"{name}, solve.most_starts: expected at most {_MOST_POCKET_S:g} s of solves a pocket, but {nodes:.0f} "
            f"nodes from {starts} starts take about {_duration(starts * one_s)}; take fewer nodes or starts"
        )


def _duration(seconds: float) -> str:
    for unit, size in (("days", 86400.0), ("hours", 3600.0), ("minutes", 60.0)):
        if seconds >= 2 * size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds:.3g} s"
