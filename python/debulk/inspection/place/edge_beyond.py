"""A check that nothing of the ply lies outside the outline, where no pocket is looked for.

A step from ply to mold along the outline shows where the ply ends. Where the ply goes on at both sides there is no such
step, and where a pocket lies on the outline none is seen. The other half of the evidence is what lies beside the
outline: outside it the scan shows the reference, or nothing.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import cv2
import numpy as np

from debulk.arrays import Bools, Floats, Whole
from debulk.inspection.evidence.edge_check import Outline
from debulk.inspection.evidence.sample import HIGHEST_MM
from debulk.results.area import in_cm2


@dataclass(frozen=True)
class Kind:
    """One kind of evidence: which heights count, and how much of them is too much."""

    thicknesses: float  # least height above the reference
    from_mm: float  # distance outside the outline from which the area counts
    least_mm2: float
    crosses: bool = False  # whether only pieces that begin inside the outline count
    median: float = 0.0  # thicknesses that half of the piece must reach


@dataclass(frozen=True)
class Limits:
    """Of what lies outside the outline; bench/trust/outlines.py has outlines that leave a part of the ply out.

    Of 30 right layups of both families none had more than 112 mm2 of ply, 64 mm2 of a bump, and any that crosses.
    """

    ply: Kind = Kind(0.55, 8.0, 200.0, median=0.75)  # more than the half of its height that its edge's middle has
    bump: Kind = Kind(3.0, 4.0, 110.0)  # more than a ply and the blur of its edge
    # A bump that goes on across the outline; a camera that looks aslant sees the side of a lifted edge 3 mm outside.
    crossing: Kind = Kind(2.0, 4.0, 45.0, crosses=True)
    begins_mm: float = 16.0  # a piece that begins farther off the outline is no part of the ply
    # Of the greatest height within so many mm inside: a scan that spreads the ply's edge shows less than that outside.
    spread_share: float = 0.5
    spread_mm: float = 12.0


LIMITS = Limits()


@dataclass(frozen=True)
class Beyond:
    """A piece of ply, or a bump, outside the outline."""

    at_mm: tuple[float, float]
    """A place in its middle, mold XY."""
    area_mm2: float
    """Its area within 40 mm of the outline."""
    height_mm: float
    """Its median height above the reference."""


def find_beyond(
    outline: Outline, values: Floats, thickness_mm: float, raised_mm: float, spacing_mm: float = 0.0
) -> Beyond | None:
    """Return the largest piece that lies outside the outline; None: there is none of a size that matters.

    `values` (N, K) are the heights in its strips, of a map of this spacing: two cells beside the outline, and less than
    nine, say nothing. `raised_mm` is by how much the whole scan stands too high, within the tolerance of the level.
    """
    off = outline.offsets_mm
    cell_mm2 = outline.step_mm * float(off[1] - off[0])
    height = values - raised_mm
    inside = np.nan_to_num(height[:, (off < 0) & (off > -LIMITS.spread_mm)]).max(axis=1, initial=0.0)
    spread_mm = np.where(off > 0, LIMITS.spread_share * inside[:, None], -np.inf)
    pieces = []
    with np.errstate(invalid="ignore"):  # NaN compares as False: what is not known is not counted
        for kind in (_seen_from(kind, spacing_mm) for kind in (LIMITS.ply, LIMITS.bump, LIMITS.crossing)):
            up = (height > np.maximum(kind.thicknesses * thickness_mm, spread_mm)) & (height < HIGHEST_MM)
            level = kind.median * thickness_mm
            found = _pieces(up, off, kind, kind.least_mm2 / cell_mm2)
            pieces += [
                piece for piece in found if np.median(height[piece]) >= level and _attached(height, piece, off, level)
            ]
    if not pieces:
        return None
    row, column = max(pieces, key=lambda piece: len(piece[0]))
    at = outline.places_mm[row] + off[column, None] * outline.normals[row]
    x, y = at[np.argmin(((at - at.mean(axis=0)) ** 2).sum(axis=1))].tolist()
    return Beyond((x, y), len(row) * cell_mm2, float(np.median(values[row, column])))


def _seen_from(kind: Kind, spacing_mm: float) -> Kind:
    """Return a kind of evidence as a map of this spacing can show it."""
    from_mm, least_mm2 = max(kind.from_mm, 2 * spacing_mm), max(kind.least_mm2, 9 * spacing_mm**2)
    return replace(kind, from_mm=from_mm, least_mm2=least_mm2)


def _attached(height: Floats, piece: tuple[Whole, Whole], off: Floats, level: float) -> bool:
    """Return whether a piece of ply goes on up to the outline, as a ply does that was left out.

    Where a filter met the border of the image, a scan may stand up beside the outline, but not at it.
    """
    if not level:
        return True
    between = height[np.unique(piece[0])][:, (off > 0) & (off < off[piece[1]].min())]
    known = between[np.isfinite(between)]
    return not known.size or float(np.median(known)) >= level


def beyond_reason(found: Beyond) -> str:
    """Say that something lies outside the outline, and what to do."""
    x, y = found.at_mm
    return (
        f"the outline leaves out a part of the ply: beside it, at ({x:.0f}, {y:.0f}) mm, {in_cm2(found.area_mm2)} "
        f"stand {found.height_mm:.2f} mm above the reference, where no pocket was looked for; check that the outline "
        "is this ply's, whole, not mirrored, in the mold's frame; if something else lies there, remove it or mask it"
    )


def _pieces(up: Bools, off: Floats, kind: Kind, least: float) -> list[tuple[Whole, Whole]]:
    """Return places and strips of the part outside of each piece with at least so many cells there."""
    marks = up & (off > (off[0] if kind.crosses else kind.from_mm))
    if np.count_nonzero(marks & (off > kind.from_mm)) < least:
        return []
    # The outline is closed: its first half is repeated behind its last place, so that pieces at the seam are whole.
    number = len(marks)
    around = np.concatenate([marks, marks[: number // 2]]).astype(np.uint8)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(around, connectivity=4)
    out = []
    for label in np.flatnonzero(stats[1:, cv2.CC_STAT_AREA] >= least) + 1:
        row, column = np.nonzero(labels == label)
        begins = off[column].min()
        if begins > (0.0 if kind.crosses else LIMITS.begins_mm):
            continue
        outside = np.unique(np.stack([row % number, column], axis=1)[off[column] > kind.from_mm], axis=0)
        if len(outside) >= least:
            out.append((outside[:, 0], outside[:, 1]))
    return out
