"""Whether the ply ends at its outline: inside it lies ply, and outside it the bare mold, where no pocket is looked for.

Stretch by stretch, the edge is where ply and mold meet. Where a pocket lies on the outline, or the ply goes on over a
short part of it, no stretch shows that; so any piece that lies outside counts by itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from debulk.arrays import Bools, Floats, Whole
from debulk.grid import Grid
from debulk.inspection.evidence import medians
from debulk.inspection.evidence.outline import BESIDE_MM, PAST_MIDDLE, STRETCH_MM, Outline
from debulk.inspection.evidence.pieces import pieces_of
from debulk.results.finding import Finding
from debulk.results.number import HIGHEST_MM
from debulk.verdict import Verdict
from debulk.words import in_cm2, in_mm, xy_of


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
    """Of the ply's edge; bench/trust/outlines.py has outlines that are not the ply's.

    Of 30 right layups of both families none had more than 112 mm2 of ply outside it, and any bump that crosses.
    """

    least_strips: int = 3  # that must be known on each side
    blur_mm: float = 6.0  # an edge nearer to the outline than this counts as on it: a map's cells are up to 8 mm wide
    far_mm: float = 20.0  # an edge that is off by so much hides a pocket or makes its edge free
    far_stretches: int = 3  # in a row; of 305 right layups one had a single one, and none had two
    ply: Kind = Kind(PAST_MIDDLE, BESIDE_MM, 200.0, median=0.75)
    # A bump that goes on across the outline; a camera that looks aslant sees the side of a lifted edge 3 mm outside.
    crossing: Kind = Kind(2.0, 4.0, 45.0, crosses=True)
    # Of the greatest height within so many mm inside: a scan that spreads the ply's edge shows less than that outside.
    spread_share: float = 0.5
    spread_mm: float = 12.0
    # Between lines beside the outline, up to `blur_mm` off it, along none of which outside a fibre may be longest, and
    # from point to point of each; a coarser map does not show how long a fibre is.
    along_mm: float = 2.0
    levels_mm: tuple[float, float] = (BESIDE_MM, 28.0)  # distances from the outline between which both levels are read
    levels_share: float = 0.3  # of the outline along which both must be known
    # Of the ply's thickness: in right layups of the third family the step has 0.994 to 1.008. Heights that are 0.9 of
    # the true ones have 0.81 of the excess.
    least_step: float = 0.9


LIMITS = Limits()


def edges_mm(outline: Outline, values: Floats, thickness_mm: float, cut_height_mm: float) -> Floats:
    """Return how far outside the outline the ply's edge lies in each stretch (S,), negative inside it; NaN: unknown.

    `values` (N, K) are the heights in its strips. What rises above the cut hides the edge, as a pocket does, and so
    does an object beside the mold that lies far below it.
    """
    outer = outline.offsets_mm > 0
    values = np.where(np.abs(values) > max(cut_height_mm, 2 * thickness_mm), np.nan, values)
    known = np.isfinite(values)
    ply = values > 0.5 * (thickness_mm + outline.bare_mm)  # False where nothing is known
    bare = known & ~ply
    out = _beyond(ply[:, outer], bare[:, outer]) - _beyond(bare[:, ~outer][:, ::-1], ply[:, ~outer][:, ::-1])
    enough = np.minimum(known[:, outer].sum(axis=1), known[:, ~outer].sum(axis=1)) >= LIMITS.least_strips
    off_mm = np.where(enough, out * float(outline.offsets_mm[1] - outline.offsets_mm[0]), np.nan)
    ranked = np.sort(off_mm.reshape(outline.stretches, -1), axis=1)  # NaN last
    count = np.isfinite(ranked).sum(axis=1)
    middle = np.take_along_axis(ranked, np.maximum(count - 1, 0)[:, None] // 2, axis=1)[:, 0]
    return np.where(2 * count >= ranked.shape[1], middle, np.nan)


def _beyond(marked: Bools, ended: Bools) -> Whole:
    """Return the number of strips, from the outline on, up to the last one marked before one at which it has ended."""
    far = np.arange(1, marked.shape[1] + 1)
    return np.asarray((np.where(marked & ~np.logical_or.accumulate(ended, axis=1), far, 0)).max(axis=1))


def low_step(outline: Outline, values: Floats, thickness_mm: float) -> Finding | None:
    """Say that the step up from the bare mold to the ply is too low; None: it is not, or too little of it is known.

    A scan that stands too high or too low as a whole has the same step. One whose heights are too small, as of frames
    from before and after the ply was laid that were averaged, has a lower one, and lower pockets. `values` (N, K) are
    the heights in the strips.
    """
    off = outline.offsets_mm
    away = (np.abs(off) > LIMITS.levels_mm[0]) & (np.abs(off) < LIMITS.levels_mm[1])
    sides = values[:, away & (off < 0)], (values - outline.bare_mm)[:, away & (off > 0)]
    known = np.all([np.isfinite(side).sum(axis=1) >= LIMITS.least_strips for side in sides], axis=0)
    if np.count_nonzero(known) < LIMITS.levels_share * len(values):
        return None
    inside, outside = (np.nanmedian(side[known], axis=1) for side in sides)
    step, error = medians.with_error(inside - outside)
    least = LIMITS.least_step * thickness_mm
    if step + error >= least:
        return None
    reason = (
        f"at its edge the ply stands {step:.3f} mm above the bare mold, its thickness is {thickness_mm:g} mm: heights "
        "come out too small, as where frames from before and after the ply was laid were averaged, or the scanner's z "
        "is off, or the thickness in the recipe is wrong; check them"
    )
    return Finding("level", Verdict.INVALID, reason, step, least, "mm")


def covered(outline: Outline, heights: Grid, thickness_mm: float) -> Finding | None:
    """Say that ply lies where the outline has a cut-out; None: it does not, or the outline is the outer one.

    However small a cut-out is, fibres that run on over it would be judged as if they ended there.
    """
    above = outline.within(heights)
    limit_mm = PAST_MIDDLE * thickness_mm
    if not len(above) or (middle_mm := float(np.median(above))) <= limit_mm:
        return None
    place = outline.places_mm.mean(axis=0)
    reason = (
        f"the outline has a cut-out round {in_mm(place)} that the scan does not show: in its middle the scan stands "
        f"{middle_mm:.2f} mm above the bare mold; check that the outline is this ply's, and in the mold's frame"
    )
    return Finding("ply_edge", Verdict.INVALID, reason, middle_mm, limit_mm, "mm", xy_of(place))


def misfit(outline: Outline, values: Floats, thickness_mm: float, cut_height_mm: float, most: float) -> Finding | None:
    """Say where the outline does not fit, if the ply's edge lies elsewhere along more than this share of it, or far."""
    off_mm = edges_mm(outline, values, thickness_mm, cut_height_mm)
    judged = np.flatnonzero(np.isfinite(off_mm))
    if not len(judged):
        return None
    share = float(np.mean(np.abs(off_mm[judged]) > LIMITS.blur_mm))
    far = np.abs(off_mm[judged]) >= LIMITS.far_mm
    in_a_row = np.all([np.roll(far, k) for k in range(LIMITS.far_stretches)], axis=0)
    if share <= most and not in_a_row.any():
        return None
    worst = judged[np.argmax(np.abs(off_mm[judged]))]
    place = outline.places_mm.reshape(outline.stretches, -1, 2)[worst].mean(axis=0)
    off = f"{abs(off_mm[worst]):.0f} mm {'outside' if off_mm[worst] > 0 else 'inside'}"
    reason = (
        f"the outline does not fit the scan: along {100 * share:.0f} % of it the ply's edge is elsewhere, round "
        f"{in_mm(place)} {off} it; check that it is this ply's, not mirrored, and in the mold's frame"
    )
    return Finding("ply_edge", Verdict.INVALID, reason, share, most, place_mm=xy_of(place))


def left_out(
    outline: Outline, values: Floats, thickness_mm: float, raised_mm: float, spacing_mm: float = 0.0
) -> Finding | None:
    """Name the largest piece that lies outside the outline; None: there is none of a size that matters.

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
        for kind in (_seen_from(kind, spacing_mm) for kind in (LIMITS.ply, LIMITS.crossing)):
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
    place = at[np.argmin(((at - at.mean(axis=0)) ** 2).sum(axis=1))]
    area_mm2 = len(row) * cell_mm2
    reason = (
        f"the outline leaves out a part of the ply: beside it, at {in_mm(place)}, {in_cm2(area_mm2)} stand "
        f"{np.median(values[row, column]):.2f} mm above the reference, where no pocket was looked for; check that the "
        "outline is this ply's, whole, not mirrored, in the mold's frame; if something else lies there, remove it or "
        "mask it"
    )
    return Finding("ply_edge", Verdict.INVALID, reason, area_mm2, unit="mm²", place_mm=xy_of(place))


def longer_outside(outline: Outline, heights: Grid, missed: Floats, bare_mm: float, most_mm: float) -> Finding | None:
    """Name the place just outside the outline at which a fibre along it is longer than allowed, and than those inside.

    A pocket that the ply's edge cuts may be highest at the edge, and an outline that is a few millimetres short leaves
    the longest fibre out. In the map of heights a ply that lies on the mold stands `bare_mm` high; `most_mm` is the
    excess that is allowed. `missed` (N, K) is `Outline.missed`: beside an edge of the mold, and from a place that was
    not seen to the next, the heights show no fibre.
    """
    if heights.spacing_mm > LIMITS.along_mm:
        return None
    out_mm = np.arange(LIMITS.along_mm, LIMITS.blur_mm + LIMITS.along_mm, LIMITS.along_mm)
    off_mm = np.concatenate([-out_mm[::-1], out_mm])
    lifted = outline.lines(heights, off_mm, LIMITS.along_mm) - bare_mm
    nearest = np.arange(len(lifted)) * len(outline.places_mm) // len(lifted)
    edges: Bools = np.asarray(np.isnan(missed[:, np.abs(outline.offsets_mm) <= off_mm.max()]).any(axis=1))
    unknown = np.isnan(lifted) | edges[nearest, None]
    lifted[unknown] = 0.0
    lifted[(lifted < 0) | (lifted > HIGHEST_MM)] = 0.0
    before, after = np.roll(lifted, 1, axis=0), np.roll(lifted, -1, axis=0)
    low, high = np.minimum(before, after), np.maximum(before, after)
    calm = np.clip(lifted, low, high)  # the middle one of three: without single points
    excess = np.hypot(np.diff(calm, axis=0, append=calm[:1]), LIMITS.along_mm) - LIMITS.along_mm
    excess[unknown | np.roll(unknown, -1, axis=0)] = 0.0
    half = round(0.5 * STRETCH_MM / LIMITS.along_mm)
    longer = np.sum([np.roll(excess, k, axis=0) for k in range(-half, half)], axis=0)
    outer = off_mm > 0
    around = np.max([np.roll(calm, k, axis=0) for k in range(-half, half)], axis=0)
    # The side of a lifted edge, seen aslant, is ragged and so long, but it is lower than the edge.
    rising = around[:, outer] > around[:, ~outer].max(axis=1, keepdims=True)
    inside, outside = longer[:, ~outer].max(axis=1), np.where(rising, longer[:, outer], 0.0).max(axis=1)
    worst = int(np.argmax(np.where(outside > inside, outside, 0.0)))
    if outside[worst] <= max(inside[worst], most_mm):
        return None
    here = np.arange(worst - half, worst + half) % len(longer)
    middle = here[np.argmax(calm[here][:, outer].max(axis=1))]
    place = outline.places_mm[nearest[middle]]
    reason = (
        f"the outline leaves out a part of the ply: just outside it, at {in_mm(place)}, a fibre along the edge "
        f"is {outside[worst]:.2f} mm longer than the mold, and none inside is so long; check that the outline reaches "
        "the ply's edge, in the mold's frame"
    )
    return Finding("ply_edge", Verdict.INVALID, reason, float(outside[worst]), most_mm, "mm", xy_of(place))


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


def _pieces(up: Bools, off: Floats, kind: Kind, least: float) -> list[tuple[Whole, Whole]]:
    """Return places and strips of the part outside of each piece with at least so many cells there."""
    marks = up & (off > (off[0] if kind.crosses else kind.from_mm))
    if np.count_nonzero(marks & (off > kind.from_mm)) < least:
        return []
    # The outline is closed: its first half is repeated behind its last place, so that pieces at the seam are whole.
    number = len(marks)
    pieces = pieces_of(np.concatenate([marks, marks[: number // 2]]), 4)
    out = []
    for piece in pieces.of_size(least):
        row, column = np.nonzero(pieces.labels == piece)
        if kind.crosses and off[column].min() > 0:
            continue
        outside = np.unique(np.stack([row % number, column], axis=1)[off[column] > kind.from_mm], axis=0)
        if len(outside) >= least:
            out.append((outside[:, 0], outside[:, 1]))
    return out
