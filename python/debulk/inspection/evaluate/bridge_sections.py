"""The height of a bridge from sections along the fibres, for a bump or a pocket that is CREASE for its bridge alone.

A bridge is a ply that spans a hollow because it is too short to reach the bottom. A net of some 100 nodes models it
coarsely: its chords cut across the hollow, crossing fibres share the pull, and a fibre that slips keeps the height that
it had while it was pinned. Of eight layups without a crease that were CREASE for such a bridge, sections along the
fibres confirm two (bench/trust/bridges.txt). Moreover, a ply that is too short for a narrow hollow stands over it lower
than any pocket and has no excess length, so that it would pass as a bump below the tolerances.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from debulk import _core, ridge
from debulk.inspection.evaluate.starts import Settled
from debulk.inspection.find.found import FoundPocket
from debulk.inspection.ply.fibre_angles import angles_at
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.recipe import options
from debulk.results.bridge_section import BridgeSection, bridge_section_line
from debulk.verdict import Judgement, Verdict

if TYPE_CHECKING:
    from debulk.inspection.evaluate.laid_pocket import LaidPocket

__all__ = ["Weighed", "measured", "weighed", "without_bridge"]

# The upper ends of 6 of 24 ranges from scans lay below the height by an own code, by up to 0.14 mm
# (bench/trust/bridges_fresh.txt).
_SHORT_MM = 0.15
_REMEDY = "treat it as CREASE, or smooth the ply into the hollow and scan again"


@dataclass(frozen=True)
class Weighed:
    """A pocket's judgement, and the figures of its fibres' sections if they were taken into account."""

    judged: Judgement
    section: BridgeSection | None = None
    late: str = ""
    """What a deadline left no time for; empty if it cut nothing off."""


def weighed(
    judged: Judgement, laid: LaidPocket, settled: Settled, found: FoundPocket, ply: PlyOnMold, stop: _core.Stop
) -> Weighed:
    """Take the sections of a pocket's fibres into account if nothing but a bridge makes it CREASE.

    If the outline of the ply is not known, or the mold is not known under the whole pocket, the net alone decides.
    """
    limits = ply.recipe.verdict
    if limits.criterion == "paper" or judged.verdict is not Verdict.CREASE:
        return Weighed(judged)
    best, *every = (without_bridge(one, laid) for one in (settled.best, *settled.every))
    without = laid.judge(settled.solution, best, every)
    if without.verdict is Verdict.CREASE:
        return Weighed(judged)
    try:
        section = measured(found, ply, stop)
    except _core.Stopped:
        late = f"the deadline passed before the sections of its fibres were measured: {judged.reason} by its net"
        return Weighed(Judgement(Verdict.UNDECIDED, late, judged.decided_by), late="the sections of a bridge")
    if section is None:
        return Weighed(judged)
    figures = bridge_section_line(section)
    if section.range_mm[0] > limits.max_ridge_mm + limits.ridge_margin_mm:
        return Weighed(replace(judged, reason=f"{judged.reason}, and {figures}"), section)
    # A fibre may also be too short in one place and too long in another, which sections as wholes do not show.
    if section.lacks_mm > 0 and section.range_mm[1] <= limits.max_ridge_mm - _SHORT_MM:
        return Weighed(replace(without, reason=f"{without.reason}; its net bridges, but {figures}"), section)
    # An RMS may be above its limit for the bridge alone, and then the bridge is what the sections are compared with.
    of = "" if "bridge" in judged.reason else f" with a bridge of {settled.best.bridge_height_mm:.2f} mm"
    reason = f"{judged.reason}{of} by its net, but {figures}; {_REMEDY}"
    return Weighed(Judgement(Verdict.UNDECIDED, reason, judged.decided_by, _REMEDY), section)


class TooShort(NamedTuple):
    """Why a bump may remain as a bridge above the limit, in words, and whether that is more likely than not."""

    why: str
    likely: bool


def over_bump(found: FoundPocket, ply: PlyOnMold, stop: _core.Stop) -> TooShort | None:
    """Say why a bump below the tolerances may be a bridge; None if not; raises `Stopped`.

    Measured are bumps whose short fibres stand as high now as a bridge that counts. A taut fibre stays as it stands;
    for a slack one this is no bound.
    """
    recipe, runs = ply.recipe, found.excess
    least_mm = options.counts_from_mm(recipe)
    short = None if runs is None else runs[runs.low_mm < runs.uncertainty_mm]
    bound_mm = 0.0 if short is None else options.bridge_mm(float(short.gap_mm.max(initial=0.0)), recipe)
    if bound_mm < least_mm:
        return None
    section = measured(found, ply, stop)
    if section is None:
        why = f"the ply over it may bridge the hollow below, where it stands {bound_mm:.2f} mm high"
        return TooShort(why, likely=False)
    if section.range_mm[1] < least_mm:
        return None
    why = f"the ply over it is too short for the hollow below: a bridge of {bridge_section_line(section)}"
    return TooShort(why, likely=section.height_mm >= least_mm)


def measured(found: FoundPocket, ply: PlyOnMold, stop: _core.Stop) -> BridgeSection | None:
    """Measure the fibres of a pocket on the scan; None if outline or mold is not known; raises `Stopped`."""
    recipe = ply.recipe
    out = _core.ridge.bridge_section(
        found.feet._core,
        found.feet._core.feet[found.index],
        ply.reference,
        np.radians(angles_at(ply.fibre_angles_deg, found.pocket.centroid_mm)),
        ply.outline,
        options.ply(recipe),
        2 * recipe.verdict.excess_margin_mm,  # a ridge is half as high as its excess is long
        stop,
    )
    if out is None:
        return None
    least, height, most = (options.bridge_mm(gap, recipe) for gap in (out.least_gap_mm, out.gap_mm, out.most_gap_mm))
    return BridgeSection(
        height_mm=height,
        range_mm=(min(least, height), max(most, height)),  # only rounding can put them out of order
        lacks_mm=out.lacks_mm,
        lacks_error_mm=out.error_mm,
        pull_n_per_mm=out.pull_n_per_mm,
        hold_n_per_mm=out.hold_n_per_mm,
    )


def without_bridge(one: ridge.PostProcessed, laid: LaidPocket) -> ridge.PostProcessed:
    """Leave a bridge out, also of the RMS, in the same way as a bridge that is drawn in is left out."""
    rest_mm = one.gap_mm[laid.net.inside & ~one.is_bridge & ~one.is_drawn_in]
    material = laid.recipe.material
    rms_mm = float(np.sqrt(np.mean(rest_mm**2))) if rest_mm.size else material.thickness_mm / material.bulk_factor
    return replace(one, bridge_height_mm=0.0, rms_mm=rms_mm)
