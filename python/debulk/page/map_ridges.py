"""The predicted ridges on the map: a line, and a band beside it that shows how far off it may be."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk.results.number import number
from debulk.results.report import PocketReport

_MAX_CORNERS = 80  # largest number in the outline of a foot as drawn


class Ridge(NamedTuple):
    """All ridges of a pocket; x to the right and y down, mm.

    The ridges may lie anywhere within a band of the given width; `low` are those that stay below the limit. `foot`
    encloses the area where the ply is off the mold, outside which there is no ridge; it is empty if that is not known.
    """

    path: str
    band_mm: float
    title: str
    low: bool = False
    foot: str = ""


def ridge_path(lines: Sequence[NDArray[np.float64]]) -> str:
    """Return an SVG path along lines of (M, 2) points, y up."""
    return "".join("M" + "L".join(f"{x:.1f} {-y:.1f}" for x, y in line.tolist()) for line in lines)


def ridges(pockets: Sequence[PocketReport], limit_mm: float | None) -> list[Ridge]:
    """Return the ridges of the pockets that have any; those that cannot exceed the limit are low."""
    found = []
    for pocket in pockets:
        if not pocket.ridges:
            continue
        ridge, place_mm = pocket.deciding_ridge, pocket.ridges[0].place_spread_mm
        heights = f", {number(ridge.height_mm, 2)} mm high {ridge.spread}".rstrip() if ridge else ""
        either = ", along either line" if pocket.ridges[0].mirrored_mm is not None else ""
        title = f"predicted ridge of pocket {pocket.id}{heights}{either}, its place known to ±{place_mm:.1f} mm"
        low = ridge is not None and limit_mm is not None and ridge.most_mm <= limit_mm
        lines = [line[:, :2] for one in pocket.ridges for line in one.lines_mm]
        foot = "" if pocket.foot_outline_mm is None else _closed(pocket.foot_outline_mm)
        found.append(Ridge(ridge_path(lines), 2 * place_mm, title, low, foot))
    return found


def says(pocket: PocketReport) -> str:
    """Describe a pocket for the text beside the cursor on the map."""
    ridge = pocket.deciding_ridge
    known = "" if ridge is None else f", ridge {number(ridge.height_mm, 2)} mm"
    return f"pocket {pocket.id}: {pocket.verdict.name}{known}"


def _closed(outline_mm: NDArray[np.float64]) -> str:
    thin = outline_mm[:: math.ceil(len(outline_mm) / _MAX_CORNERS) or 1]
    return ridge_path([thin]) + "Z"
