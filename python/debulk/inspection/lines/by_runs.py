"""A pocket that its fibre lines decide, without any net: by their excess, and by the bridges of those too short."""

from __future__ import annotations

from dataclasses import dataclass, replace

from debulk import _core, pocket, verdict
from debulk.fibre import FibreRuns
from debulk.inspection.find.found import FoundPocket
from debulk.inspection.lines.bridges import Bridge, bridge_over, net_spacing_mm
from debulk.inspection.ply import excess
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.recipe import Recipe, options
from debulk.results.bridge_section import bridge_section_line
from debulk.results.report import ExcessReport
from debulk.verdict import Judgement, Verdict, criteria_of

_DENSER = "give a denser scan"
_OUTLINE = "give the ply's outline"
_SMOOTH_IN = "treat it as CREASE, or smooth the ply into the hollow and scan again"


@dataclass(frozen=True)
class ByRuns:
    """A judgement by the fibre lines, with the figures that it follows from."""

    excess: ExcessReport
    bridge: Bridge
    judged: Judgement


def surely_held(found: FoundPocket, ply: PlyOnMold) -> bool:
    """Return whether a pocket's rim counts as held before a net shows where it is.

    It does if it is so far inside the ply that no node of a net on it could be free, and anywhere if the ridge keeps
    the limit even if all of the rim is held.
    """
    runs, recipe = found.excess, ply.recipe
    if runs is None:
        return False
    return _inside(found, ply) or excess.ridge_of(excess.upper_mm(runs), recipe) <= options.counts_from_mm(recipe)


def by_runs(found: FoundPocket, ply: PlyOnMold, stop: _core.Stop) -> ByRuns:
    """Judge a pocket whose rim is held by the runs that cross its foot; raises as `bridge_over` does."""
    runs, recipe = found.excess, ply.recipe
    assert runs is not None
    bridge = bridge_over(found, ply, stop)
    known = excess.of_runs(runs, bridge.bound_mm, recipe)
    judged = verdict.judge(
        certified=False,
        coverage=found.pocket.measured_share,
        closed_rim=found.foot.closed,
        inside_ply=True,
        excess_range_mm=known.range_mm,
        bridge_range_mm=bridge.range_mm,
        criteria=criteria_of(recipe),
    )
    alone = verdict.judge(
        certified=False, inside_ply=True, excess_range_mm=known.range_mm, criteria=criteria_of(recipe, "excess")
    )
    known = replace(known, verdict=alone.verdict)
    judged = with_section(judged, bridge, recipe)
    if judged.verdict is Verdict.UNDECIDED and ply.outline is None and _ends_above(runs, recipe):
        why = "beside it the scan shows the bare mold, and where the ply ends there its fibres are free"
        judged = replace(judged, reason=f"{judged.reason}; {why}: {_OUTLINE}", remedy=_OUTLINE)
    else:
        judged = _denser(judged, known, recipe)
    return ByRuns(known, bridge, judged)


def with_section(judged: Judgement, bridge: Bridge, recipe: Recipe, *, compliant: bool = False) -> Judgement:
    """Say how a fibre stands that is too short, where its bridge makes a pocket worse than CEASE."""
    if bridge.section is None or not judged.decided_by or judged.verdict is Verdict.CEASE:
        return judged
    alone = verdict.judge(
        certified=False,
        inside_ply=True,
        excess_range_mm=(0.0, 0.0),
        bridge_range_mm=bridge.range_mm,
        compliant=compliant,
        criteria=criteria_of(recipe, "excess"),
    )
    if alone.verdict is not judged.verdict:
        return judged
    reason = f"{judged.reason}; {bridge_section_line(bridge.section)}"
    return replace(judged, reason=reason, remedy=_SMOOTH_IN if judged.verdict is Verdict.UNDECIDED else judged.remedy)


def _ends_above(runs: FibreRuns, recipe: Recipe) -> bool:
    """Return whether nothing is sure of a run above the limit, as `ScanRuns.ending_at_bare` leaves it."""
    longer = runs.excess_mm > excess.of_ridge(recipe.verdict.max_ridge_mm, recipe)
    return bool((longer & (runs.low_mm <= runs.uncertainty_mm)).any())


def _denser(judged: Judgement, known: ExcessReport, recipe: Recipe) -> Judgement:
    """Ask for a denser scan where only what the filters may have taken makes a pocket UNDECIDED."""
    least_mm, limit_mm = known.range_mm[0] + 2 * known.uncertainty_mm, recipe.verdict.max_ridge_mm
    if judged.verdict is not Verdict.UNDECIDED or not least_mm <= limit_mm < known.alone_mm:
        return judged
    why = f"by so much the filters may have lowered what is narrow for such heights: {_DENSER}"
    return replace(judged, reason=f"{judged.reason}; {why}", remedy=_DENSER)


def _inside(found: FoundPocket, ply: PlyOnMold) -> bool:
    """Return whether no node of a net on the pocket can be free, because the ply's edge is farther away."""
    if found.pocket.touches_ply_edge or found.foot.touches_ply_edge:
        return False
    if ply.outline is None:
        return True
    least_mm, rim = ply.recipe.net.free_edge_mm + net_spacing_mm(found, ply), found.foot.outline_mm
    low, high = rim.min(axis=0), rim.max(axis=0)
    from_middle_mm = float(pocket.distance_to_outline(ply.outline, 0.5 * (low + high)[None])[0])
    if from_middle_mm > least_mm + 0.5 * float((high - low) @ (high - low)) ** 0.5:
        return True
    return bool(pocket.distance_to_outline(ply.outline, rim).min() > least_mm)
