"""The ply's outline, and the heights beside it: in strips parallel to it, place by place along it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from debulk import pocket, rings
from debulk.arrays import Floats
from debulk.grid import Grid
from debulk.inspection.clouds.enough import PLACES
from debulk.inspection.evidence.pieces import grown

STRETCH_MM = 40.0  # length of a stretch along the outline, and the strips' reach to each side of it
STRIP_MM = 4.0  # width of a strip, and distance of the places along the outline and on the ply
BESIDE_MM = 2 * STRIP_MM  # of an edge: so near a scan may have points between both levels, and show it from the side
PAST_MIDDLE = 0.55  # of the height of an edge: just beyond the half that its middle has in a blurred scan


class Outline:
    """An edge of the ply with its strips, prepared once and used for scan after scan.

    Ring 0 of the ply's outline is its outer edge, the others are the edges of its cut-outs.

    `bare_mm` gives the heights (N,) of the bare mold above the datum at (N, 2) places; None: 0 everywhere. The
    attribute of that name has them in the strips, (N, K).

    `places_mm` and `normals` are (N, 2) points along it, `step_mm` apart, and the outward unit normals there;
    `offsets_mm` (K,) are the distances of the strips' middles from it, positive outside it. `stretches` is the number
    of stretches of equally many places, of about 40 mm.
    """

    def __init__(self, outline_mm: Floats, bare_mm: Callable[[Floats], Floats] | None = None, ring: int = 0) -> None:
        corners_mm = rings.split(outline_mm)[ring]
        ends = np.roll(corners_mm, -1, axis=0)
        lengths = np.linalg.norm(ends - corners_mm, axis=1)
        along_mm = np.concatenate([[0.0], np.cumsum(lengths)])
        count = max(3, round(along_mm[-1] / STRETCH_MM))
        steps = max(2, round(along_mm[-1] / count / STRIP_MM))
        at = (np.arange(count * steps) + 0.5) / (count * steps) * along_mm[-1]
        side = np.clip(np.searchsorted(along_mm, at, side="right") - 1, 0, len(corners_mm) - 1)
        share = ((at - along_mm[side]) / lengths[side])[:, None]
        points = corners_mm[side] + share * (ends - corners_mm)[side]
        # Normals are taken over some 16 mm: the short sides of a noisy outline have no useful normals of their own.
        reach = max(1, round(0.25 * STRETCH_MM / STRIP_MM))
        along = np.roll(points, -reach, axis=0) - np.roll(points, reach, axis=0)
        normal = np.stack([along[:, 1], -along[:, 0]], axis=1)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
        if pocket.polygon_area(outline_mm) < 0:
            normal = -normal
        self.offsets_mm = np.arange(-STRETCH_MM + 0.5 * STRIP_MM, STRETCH_MM, STRIP_MM)
        xy = points[:, None, :] + self.offsets_mm[None, :, None] * normal[:, None, :]
        # At corners a strip's points may lie on the other side of another stretch; these are not used.
        inside = pocket.inside(outline_mm, xy.reshape(-1, 2)).reshape(xy.shape[:2])
        near = pocket.distance_to_outline(outline_mm, xy.reshape(-1, 2)).reshape(xy.shape[:2])
        own = (inside == (self.offsets_mm < 0)) & (near > 0.7 * np.abs(self.offsets_mm))
        self._xy, self._own = xy, own
        self.places_mm, self.normals = points, normal
        self.step_mm = float(along_mm[-1]) / (count * steps)
        self.stretches = count
        self.bare_mm = np.zeros(own.shape) if bare_mm is None else bare_mm(xy.reshape(-1, 2)).reshape(own.shape)
        self._corners, self._bare, self._cut_out = corners_mm, bare_mm, ring > 0

    def strips(self, heights: Grid) -> Floats:
        """Return the (N, K) heights at the places and offsets, from a height map; NaN: nothing known."""
        return np.where(self._own, heights.at(self._xy), np.nan)

    def within(self, heights: Grid) -> Floats:
        """Return (N,) heights of a map above the bare mold in the middle of a cut-out; of the outer edge none.

        Its middle is the half of it that is farthest from its edge, by which a blurred scan shows the mold too high.
        """
        if not self._cut_out:
            return np.empty(0)
        low, high = self._corners.min(axis=0), self._corners.max(axis=0)
        step = max(heights.spacing_mm, float(np.max(high - low)) / PLACES)
        xy = np.stack(np.meshgrid(*(np.arange(a, b, step) for a, b in zip(low, high, strict=True))), axis=-1)
        xy = xy[pocket.inside(self._corners, xy.reshape(-1, 2)).reshape(xy.shape[:2])]
        off = pocket.distance_to_outline(self._corners, xy)
        xy = xy[off >= 0.5 * off.max(initial=0.0)]
        above = heights.at(xy) - (0.0 if self._bare is None else self._bare(xy))
        return np.asarray(above[np.isfinite(above)])

    def lines(self, heights: Grid, offsets_mm: Floats, step_mm: float) -> Floats:
        """Return heights (M, K) of a map along lines parallel to the outline, some `step_mm` apart; NaN: not known."""
        count = len(self.places_mm)
        at = np.linspace(0, count, max(count, round(count * self.step_mm / step_mm)), endpoint=False)
        before, share = at.astype(np.int64), (at % 1)[:, None]
        places, normals = (
            (1 - share) * of[before] + share * of[(before + 1) % count] for of in (self.places_mm, self.normals)
        )
        return np.asarray(heights.at(places[:, None] + offsets_mm[:, None] * normals[:, None]))

    def missed(self, missed_mm: Callable[[Floats], Floats], off_mm: float) -> Floats:
        """Return by how much the reference stands above its surface at the places and offsets, (N, K); 0: not known.

        `missed_mm` is `Prepared.missed_mm`. Within `BESIDE_MM` of places where the surface is off by more than
        `off_mm`, the result is NaN: a blurred scan stands up there, too.
        """
        out = np.where(self._own, np.nan_to_num(missed_mm(self._xy.reshape(-1, 2)).reshape(self._own.shape)), 0.0)
        return np.where(grown(np.abs(out) > off_mm, round(BESIDE_MM / STRIP_MM)), np.nan, out)


def outlines_of(ply_outline: Floats, bare_mm: Callable[[Floats], Floats]) -> list[Outline]:
    """Return the edges of a ply, the outer one first, then those of its cut-outs."""
    return [Outline(ply_outline, bare_mm, ring) for ring in range(len(rings.split(ply_outline)))]


def edge_seen(heights: Grid, bare_mm: Callable[[Floats], Floats], thickness_mm: float) -> Outline | None:
    """Return the edge of the largest piece of ply that a map shows on the bare mold; None: there is none.

    It serves checks of how a scan shows an edge where no outline was given; it says nothing about what the ply's is.
    """
    xy = np.stack(np.meshgrid(heights.x_mm, heights.y_mm), axis=-1)
    above = heights.values - bare_mm(xy.reshape(-1, 2)).reshape(xy.shape[:2])
    map_ = Grid(above.astype(np.float32), heights.origin_mm, heights.spacing_mm)
    pieces = pocket.segment(map_, 0.5 * thickness_mm, STRETCH_MM**2, 0.0, smooth_mm=0.0).pockets
    return Outline(pieces[0].outline_mm, bare_mm) if pieces else None
