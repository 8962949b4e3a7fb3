"""The predicted ridges on the map: a line, and beside it how far off it may be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk.page.pockets import deciding_ridge
from debulk.results.report_text import number
from debulk.results.ridge_lines import ridge_lines
from debulk.verdict import Verdict

if TYPE_CHECKING:
    from debulk.results.report import PocketReport

__all__ = ["Ridge", "ridge_path", "ridges"]


class Ridge(NamedTuple):
    """All ridges of a pocket; x to the right and y down, mm.

    They may stand within a band so wide; `low` are those of a pocket that ceases.
    """

    path: str
    band_mm: float
    title: str
    low: bool = False


def ridge_path(lines: Sequence[NDArray[np.float64]]) -> str:
    """Return an SVG path along lines of (M, 2) points, y up; a single point becomes a dot."""
    parts = []
    for line in lines:
        points = [f"{x:.1f} {-y:.1f}" for x, y in line.tolist()]
        parts.append("M" + "L".join(points) + ("h0" if len(points) == 1 else ""))
    return "".join(parts)


def ridges(pockets: Sequence[PocketReport]) -> list[Ridge]:
    """Return the ridges of the pockets that have any."""
    found = []
    for pocket in pockets:
        lines, spacing = ridge_lines(pocket), pocket.spacing_mm
        if not lines or spacing is None:
            continue
        ridge = deciding_ridge(pocket)
        heights = f", {number(ridge.height_mm, 2)} mm high {ridge.spread}".rstrip() if ridge else ""
        # A coarse net folds at its nodes, the real ply anywhere between the nodes beside them.
        title = f"predicted ridge of pocket {pocket.id}{heights}, its place known to ±{spacing:.1f} mm"
        found.append(Ridge(ridge_path(lines), 2 * spacing, title, pocket.verdict is Verdict.CEASE))
    return found
