"""A pocket whose net is laid: ready to be settled under the vacuum, read for its ridges, and judged by its minima."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, cast

import numpy as np

from debulk import _core, net, pocket, ridge, sheet, solve, surface, verdict
from debulk.inspection.clouds.enough import FEW
from debulk.inspection.find.found import FoundPocket
from debulk.inspection.lines.bridges import Bridge
from debulk.inspection.lines.by_runs import surely_held, with_section
from debulk.inspection.minima.starts import Figures, spread
from debulk.inspection.ply import excess
from debulk.inspection.ply.fibre_angles import angles_at
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.inspection.running.effort import check_solves
from debulk.recipe import Recipe, options
from debulk.results.finding import Reason

Criterion = Literal["excess", "paper"]

# Statuses of a solve which mean that the pocket itself cannot be judged.
REFUSED = ("too_few_movable_nodes", "no_minimum", "not_a_surface", "too_stiff")
_SLIP_LENGTHS = 2.0  # of ply beside the edge: from farther away nothing is released
_LAY_DOWN = "lay it down there and scan again"


@dataclass(frozen=True, eq=False)
class LaidPocket:
    """One pocket with its net and its ply."""

    net: net.Net
    """Laid on the pocket's patch."""
    sheet: sheet.Sheet
    """The ply: that net with its energies."""
    reference: surface.Reference
    """The surface below."""
    measured_share: float
    """Share of the pocket's area that the scanner saw."""
    closed_rim: bool
    """Whether fixed nodes, or the ply's edge, close the pocket all round."""
    held: bool
    """Whether its rim is held, so that the fibre lines decide it; else its minima do."""
    held_excess_mm: float
    """Largest excess of a fibre that is held at both ends, at the net's spacing."""
    doubt: Reason | None
    """Why the pocket may crease although its net does not; None if nothing suggests that."""
    recipe: Recipe
    """All settings."""

    def __getstate__(self) -> dict[str, object]:
        """Leave out the compiled objects; a copy that comes from another process can still be judged."""
        return {k: v for k, v in self.__dict__.items() if k not in ("sheet", "reference")}

    def post_process(self, solution: solve.Solution) -> ridge.PostProcessed:
        """Return the ridges of a solution."""
        wanted = options.ridge(self.recipe)
        ply = options.ply(self.recipe)
        return ridge.from_core(_core.ridge.post_process(solution._core, self.net._core, self.reference, wanted, ply))

    def judge(
        self,
        solution: solve.Solution,
        counted: Sequence[Figures],
        *,
        bridge: Bridge | None = None,
        deadline_passed: bool = False,
        criterion: Criterion | None = None,
    ) -> verdict.Judgement:
        """Judge the pocket by its best solution, and by the figures of every one that counts.

        A `bridge` counts in place of those of the minima, whose figures are then those of `post_process`. If the
        deadline passed before all starts that the rule asks for were tried, they decide nothing.
        """
        if bridge is not None:
            counted = [self.without_bridge(cast(ridge.PostProcessed, one)) for one in counted]
        bridge_mm = spread([f.bridge_height_mm for f in counted]) if bridge is None else bridge.range_mm
        judged = verdict.judge(
            certified=solution.certified,
            rms_range_mm=spread([f.rms_mm for f in counted]),
            ridge_range_mm=spread([f.ridge_height_mm for f in counted]),
            bridge_range_mm=bridge_mm,
            compliant=solution.certificate.compliant,
            solve_status=solution.certificate.failure or solution.explanation,
            deadline_passed=deadline_passed,
            coverage=self.measured_share,
            closed_rim=self.closed_rim,
            refused=solution.explanation if solution.status in REFUSED else "",
            criteria=verdict.criteria_of(self.recipe, criterion),
        )
        if bridge is not None:
            judged = with_section(judged, bridge, self.recipe, compliant=solution.certificate.compliant)
        if judged.verdict is verdict.Verdict.CEASE and self.doubt:
            return verdict.Judgement(verdict.Verdict.UNDECIDED, self.doubt.text, remedy=self.doubt.remedy)
        return judged

    def without_bridge(self, one: ridge.PostProcessed) -> ridge.PostProcessed:
        """Leave the net's own bridges out, also of the RMS, as a bridge that is drawn in is left out."""
        rest_mm = one.gap_mm[self.net.inside & ~one.is_bridge & ~one.is_drawn_in]
        rms_mm = float(np.sqrt(np.mean(rest_mm**2))) if rest_mm.size else self.recipe.material.consolidated_mm
        return replace(one, bridge_height_mm=0.0, rms_mm=rms_mm)


def lay_pocket(found: FoundPocket, ply: PlyOnMold, stop: _core.Stop | None = None) -> LaidPocket:
    """Lay the net of a pocket, and make the model of its ply.

    An `InputError` is raised if the fibre angles are not known there, or no useful net can be laid on the surface.
    """
    laid = lay_net(found, ply, stop)
    if not laid.inside.any():
        raise _core.InputError(f"none of its {len(laid.nodes_mm)} nodes lies where the pocket stands above the cut")
    held = surely_held(found, ply) or (laid._core.held_all_round and found.excess is not None)
    return LaidPocket(
        net=laid,
        sheet=sheet.Sheet.of_net(laid, ply.reference, ply.recipe),
        reference=ply.reference,
        measured_share=found.pocket.measured_share,
        closed_rim=found.foot.closed and len(laid.open_ends) == 0,
        held=held,
        held_excess_mm=_core.ridge.held_excess(laid._core.net, ply.reference).largest_mm,
        doubt=None if held else _doubt(found, laid, ply),
        recipe=ply.recipe,
    )


def _doubt(found: FoundPocket, laid: net.Net, ply: PlyOnMold) -> Reason | None:
    """Say why a minimum at the ply's edge proves little; None if it proves enough."""
    times = found.foot.area_mm2 / found.pocket.area_mm2
    round_it = f"the ply stands off the mold round it, on {times:.0f} times its area; {_LAY_DOWN}"
    inside = int(np.count_nonzero(laid.inside))
    if inside < FEW:  # the core lays 25 if three times the requested number of nodes allow it
        what = f"only {inside} of the {len(laid.nodes_mm)} nodes of its net lie inside its outline"
        return Reason(f"{what}: {round_it}", _LAY_DOWN)
    if ply.outline is None or not (laid.kinds == net.FREE).any():
        return None
    # Friction holds the ply after a slip of about 20 mm (docs/model.md, section 6), so an edge farther off releases
    # nothing.
    slip_mm = ply.recipe.net.free_edge_mm
    away_mm = float(pocket.distance_to_outline(ply.outline, found.pocket.outline_mm).min())
    if away_mm > _SLIP_LENGTHS * slip_mm:
        what = f"its net is free at an edge of the ply {away_mm:.0f} mm away, and a ply slips by some {slip_mm:g} mm"
        return Reason(f"{what}: {round_it}", _LAY_DOWN)
    # A net at the edge may let a fibre that no end frees bow sideways to where the ply is free. It is not known whether
    # friction allows that.
    runs, limits = found.excess, ply.recipe.verdict
    if runs is None:
        return None
    held_mm = excess.upper_mm(runs[excess.bound(runs)])
    if (ridge_mm := excess.ridge_of(held_mm, ply.recipe)) > options.counts_from_mm(ply.recipe):
        side = "above" if ridge_mm > limits.max_ridge_mm else f"within {limits.ridge_margin_mm:.2f} mm of"
        holds = "is" if held_mm == excess.upper_mm(runs[runs.held]) else "may be"
        what = (
            f"a fibre that {holds} held at both ends is up to {held_mm:.2f} mm longer than the mold, a ridge of "
            f"{ridge_mm:.2f} mm {side} the limit of {limits.max_ridge_mm:.2f} mm unless it moves sideways to the ply's "
            "edge"
        )
        return Reason(what, "")
    return None


def lay_net(found: FoundPocket, ply: PlyOnMold, stop: _core.Stop | None = None) -> net.Net:
    """Lay the net of a pocket on its patch."""
    check_solves(ply.recipe, found.foot.area_mm2)
    return net.from_core(
        _core.net.lay_pocket(
            found.segmentation._core,
            found.feet._core,
            found.pocket.id,
            ply.reference,
            np.radians(angles_at(ply.fibre_angles_deg, found.pocket.centroid_mm)),
            ply.outline,
            options.lay_pocket(ply.recipe),
            stop or _core.Stop(),
        )
    )
