"""Checks whether scan, reference, pose, outline and recipe belong together, made before any pocket is judged."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from debulk import _core, pocket
from debulk.arrays import Floats
from debulk.grid import Grid
from debulk.inspection.clouds.enough import PLACES
from debulk.inspection.clouds.thinning import pitch_of, widest_mm
from debulk.inspection.clouds.unit import unit_reason
from debulk.inspection.evidence.outline import Outline, edge_seen, outlines_of
from debulk.inspection.evidence.ply_zones import Blocks, PlyZones, off_pockets
from debulk.inspection.evidence.sample import Sample, sampled
from debulk.inspection.evidence.two_layers import layers_apart_mm, layers_reason
from debulk.inspection.find.found import Found
from debulk.inspection.place import plateaus, ply_edge
from debulk.inspection.place.level import LIMITS, Deviation, departure, deviation, level_of
from debulk.inspection.place.level_reason import few_squares_reason, level_reason, same_reason, stale_reason
from debulk.inspection.place.steep import too_steep
from debulk.inspection.ply import excess
from debulk.inspection.ply.ply_on_mold import Setup
from debulk.inspection.reference import frame
from debulk.inspection.reference.resolution import coarse_reason
from debulk.recipe import options
from debulk.results.finding import Finding
from debulk.results.level import Level
from debulk.verdict import Verdict

_SURE = 0.02  # most error of a share of the outline that is read at so many by so many places


@dataclass(frozen=True, eq=False)
class Placed:
    """The result of the checks: the level (None: too little to read it from), and what is wrong (None: nothing)."""

    level: Level | None
    finding: Finding | None = None
    edge: Outline | None = None
    """The ply's edge as the scan shows it, for checks of how sharp it is, if no outline was given."""
    beyond: str = ""
    """How far outline and reference reach, if too little of the ply can be seen as the outline reaches beyond."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """Warnings for the reader of the report."""
        if self.level is None or not (loose := self.level.loose_share):
            return ()
        return (
            f"the ply stands loose in places: {100 * loose:.0f} % of it between the pockets does not lie on the "
            "mold; what stands up there is judged or listed as elsewhere",
        )


class Placing:
    """Checks scan after scan. Everything that does not depend on the scan is prepared in the constructor.

    The ply may be thinner than the recipe says, down to `least_mm`. `zones` are where its level is read, and `outline`
    serves the checks of its outer edge; None: it is not known.
    """

    def __init__(self, setup: Setup, least_mm: float | None = None) -> None:
        prepared, ply_outline = setup.prepared, setup.outline
        self._setup, self._recipe = setup, setup.recipe
        self._thickness_mm = setup.recipe.material.thickness_mm
        self._least_mm = self._thickness_mm if least_mm is None else least_mm
        self._tol_mm = options.level_tol_mm(setup.recipe)
        low, high = prepared.reference.box_mm
        self._wide_mm = high - low
        frame.check_tilt(prepared.reference, low, high, ply_outline)
        if ply_outline is not None:
            frame.check_outline_on(ply_outline, low, high)
        edges = [] if ply_outline is None else outlines_of(ply_outline, prepared.bare_mm)
        self.outline = edges[0] if edges else None
        self._edges = [(edge, self._missed_at(edge)) for edge in edges]  # the outer one, and those of the cut-outs
        self.zones = PlyZones(ply_outline, low, high)
        self._beyond = self._beyond_reference()
        self._steep = None if self._beyond else too_steep(setup)

    def look(self, scan: NDArray[np.float32], stop: _core.Stop) -> Sample:
        """Return the sample of a scan for all checks."""
        sample = sampled(scan, self._setup)
        on_ply = self.zones.inside(sample)
        pitch_mm = pitch_of(sample.points_mm[on_ply, :2], sample.each)
        return replace(
            sample,
            on_ply=on_ply,
            pitch_mm=pitch_mm,
            widest_mm=widest_mm(scan, pitch_mm, self._setup.pose, stop),
            apart_mm=layers_apart_mm(scan, self._setup, pitch_mm),
        )

    def gross(self, sample: Sample) -> Placed | None:
        """Judge errors that no pocket can cause, so that pockets need not be looked for; None: no such error."""
        finding = next(self._of_cloud(sample), None)
        if finding is not None:
            return Placed(None, finding)
        if self._beyond:  # coverage says it; the level inside such an outline is that of something else
            return None
        off = departure(self._blocks(sample, ()), self._thickness_mm, self._least_mm)
        if len(off) < LIMITS.least_squares or np.mean(np.abs(off) > self._tol_mm) <= LIMITS.ply_share:
            return None
        placed = self._judge(sample, ())
        return placed if placed.finding else None

    def _of_cloud(self, sample: Sample) -> Iterator[Finding]:
        """Yield what is wrong with a cloud whatever its level is."""
        on = sample.on_ply
        # Points beside the ply do not count, for both scans show the same surface there. Without an outline the ply may
        # be a small part of the scan, and nearly all points have to be the same.
        same = float(np.mean(sample.same[on])) if on.any() else 0.0
        limit = LIMITS.ply_share if self.outline is not None else LIMITS.bare_share
        if same > limit:
            yield Finding("same_scan", Verdict.INVALID, same_reason(same), same, limit)
        if self.outline is not None and not sample.rounded:
            limit = LIMITS.same_square
            same, place = self.zones.most_marked(sample, LIMITS.same_points)
            if same > limit:
                yield Finding("same_scan", Verdict.INVALID, stale_reason(same, place), same, limit, place_mm=place)
        if unit := unit_reason(sample.points_mm, self._wide_mm):
            yield Finding("unit", Verdict.INVALID, unit.text, remedy=unit.remedy)
        if sample.apart_mm > 0:
            reason = layers_reason(sample.apart_mm)
            yield Finding("two_layers", Verdict.INVALID, reason, sample.apart_mm, unit="mm")
        if on.any() and (coarse := coarse_reason(sample.widest_mm, int(on.sum()), self._recipe)):
            yield Finding("point_spacing", Verdict.INVALID, f"the scan is too coarse: {coarse}")
        if self._steep is not None:
            yield self._steep

    def _beyond_reference(self) -> str:
        """Return how far outline and reference reach, if too little of the ply can be seen as the outline is larger."""
        outline, box_mm = self._setup.outline, self._setup.prepared.reference.box_mm
        if outline is None or not ((outline < box_mm[0]) | (outline > box_mm[1])).any():
            return ""
        xy = frame.spread(outline.min(axis=0), outline.max(axis=0), PLACES)
        known = self._setup.prepared.between(xy[pocket.inside(outline, xy)]).any(axis=1)
        lacking = known.size and float(known.mean()) < self._recipe.verdict.min_coverage - _SURE
        return frame.boxes(outline, *box_mm) if lacking else ""

    def plateaus(self, heights: Grid, stop: _core.Stop) -> list[Finding]:
        """Judge the places of a map of heights where the ply is missing, lies double, or lies on something."""
        return plateaus.findings(plateaus.find(heights, self.zones, self._setup, stop), self._thickness_mm)

    def judge(self, sample: Sample, found: Found) -> Placed:
        """Judge the level between the pockets."""
        outlines = [p.foot.outline_mm if len(p.foot.outline_mm) else p.pocket.outline_mm for p in found.pockets]
        return replace(self.judge_between(sample, outlines, found.overview), beyond=self._beyond)

    def judge_between(
        self, sample: Sample, outlines_mm: Sequence[Floats], heights: Grid, *, debulked: bool = False
    ) -> Placed:
        """Judge the level outside the pockets' outlines, (M, 2) each, and the ply's edge in a map of heights.

        Over the edge of a debulked ply folds may run, and no pocket is sought beside it.
        """
        placed = self._judge(sample, outlines_mm)
        if placed.finding:
            return placed
        if self.outline is None:
            edge = edge_seen(heights, self._setup.prepared.bare_mm, self._least_mm)
            if edge is None:
                return placed
            finding = ply_edge.low_step(edge, edge.strips(heights) - self._missed_at(edge), self._least_mm)
            return replace(placed, finding=finding, edge=edge)
        raised_mm = 0.0 if placed.level is None else placed.level.laid_mm - self._thickness_mm
        found = (self._of_edge(edge, heights, missed, raised_mm, debulked) for edge, missed in self._edges)
        finding = next(filter(None, found), None)
        return placed if finding is None else replace(placed, finding=finding)

    def _of_edge(
        self, edge: Outline, heights: Grid, missed: Floats, raised_mm: float, debulked: bool
    ) -> Finding | None:
        recipe, thickness_mm, strips = self._recipe, self._thickness_mm, edge.strips(heights)
        cut_mm, share = recipe.segmentation.cut_height_mm, recipe.level.largest_edge_share
        most_mm = excess.of_ridge(options.counts_from_mm(recipe), recipe)
        return (
            ply_edge.covered(edge, heights, thickness_mm)
            or ply_edge.misfit(edge, strips, thickness_mm, cut_mm, share)
            or ply_edge.left_out(edge, strips - missed, thickness_mm, raised_mm, heights.spacing_mm)
            or (None if debulked else ply_edge.longer_outside(edge, heights, missed, raised_mm + thickness_mm, most_mm))
            or ply_edge.low_step(edge, strips - missed, self._least_mm)
        )

    def _missed_at(self, edge: Outline) -> Floats:
        """Return by how much the reference stands above its surface beside an edge."""
        return edge.missed(self._setup.prepared.missed_mm, 0.5 * self._thickness_mm)

    def _blocks(self, sample: Sample, outlines: Sequence[Floats]) -> Blocks:
        """Return the squares of the ply outside the outlines, without the bare mold if the ply's outline is unknown."""
        used = sample.on_ply & off_pockets(sample.points_mm, outlines)
        if self.outline is None:
            above_mm = sample.height_mm - self._setup.prepared.bare_mm(sample.points_mm[:, :2])
            bare = np.abs(above_mm) <= self._tol_mm
            if np.count_nonzero(bare & used) < LIMITS.bare_share * np.count_nonzero(used):
                used &= ~bare
        return self.zones.blocks(sample, used)

    def _judge(self, sample: Sample, outlines: Sequence[Floats]) -> Placed:
        recipe, zones = self._recipe, self.zones
        blocks = self._blocks(sample, outlines)
        if len(blocks.height_mm) < LIMITS.least_squares:
            outlined = self.outline is not None
            reason = few_squares_reason(zones, sample, share=blocks.ply_share, outlined=outlined)
            return Placed(None, Finding("level", Verdict.INVALID, reason.text, remedy=reason.remedy))
        found = deviation(blocks, self._thickness_mm, self._least_mm)
        level = level_of(found, self._thickness_mm, self._tol_mm)
        loose = self._loose_share(found)
        doubt = level_reason(level, found, recipe, 0.0 if outlines else LIMITS.loose_share, loose)
        needed = level.low_share + level.high_share > recipe.level.largest_share
        if not doubt:
            return Placed(replace(level, loose_share=loose) if needed else level)
        off_mm = level.laid_mm - level.thickness_mm
        finding = Finding("level", Verdict.INVALID, doubt.text, off_mm, self._tol_mm, "mm", remedy=doubt.remedy)
        return Placed(level, finding)

    def _loose_share(self, found: Deviation) -> float:
        """Return the share of the squares that stand up while the rest of the ply lies level: air lifts them.

        Whatever stands up is judged by its fibres, and only looks longer if the cause is another one. It is 0 if
        anything else is wrong: a motion or a bend of the scan, or another reference, also leaves squares too low, or a
        fit that is not level. More than a fifth of the ply is neither a loose border nor bumps.
        """
        tol = self._tol_mm
        off = found.off(tol)
        if np.mean(off < 0) > LIMITS.low_share:
            return 0.0
        loose = np.flatnonzero(off > 0)
        share = len(loose) / len(off)
        level = float(np.max(np.abs(found.fits_mm))) <= tol or found.level_without(loose, tol)
        return share if level and share <= LIMITS.loose_share else 0.0
