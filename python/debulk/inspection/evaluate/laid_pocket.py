"""A pocket whose net is laid: ready to be settled under the vacuum, read for its ridges, and judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from debulk import _core, net, pocket, ridge, sheet, solve, surface, verdict
from debulk.inspection.evaluate.starts import Figures, spread
from debulk.inspection.find.found import FoundPocket
from debulk.inspection.ply import excess
from debulk.inspection.ply.fibre_angles import angles_at
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.inspection.running.effort import check_solves
from debulk.recipe import options
from debulk.results.finding import Reason
from debulk.results.report import ExcessReport

if TYPE_CHECKING:
    from debulk.recipe import Recipe

Criterion = Literal["excess", "paper"]

__all__ = ["REFUSED", "LaidPocket", "criteria", "lay_net", "lay_pocket"]

# Statuses of a solve which mean that the pocket itself cannot be judged.
REFUSED = ("too_few_movable_nodes", "no_minimum", "not_a_surface", "too_stiff")
_FEWEST_INSIDE = 20  # nodes inside the outline; the core lays 25 if three times the requested number of nodes allow it
_FREE = 2  # kind of a node at the ply's edge
_SLIP_LENGTHS = 2.0  # of ply beside the edge: from farther away nothing is released
_NARROW = "by so much the filters may have lowered what is narrow for such heights"
_DENSER = "give a denser scan"
_LAY_DOWN = "lay it down there and scan again"


@dataclass(frozen=True, eq=False)
class LaidPocket:
    """One pocket with its net and its ply.

    Attributes
    ----------
    net
        Laid on the pocket's patch.
    sheet
        The ply: that net with its energies.
    reference
        The surface below.
    measured_share
        Share of the pocket's area that the scanner saw.
    closed_rim
        Whether fixed nodes, or the ply's edge, close the pocket all round.
    excess
        The ridge that the fibres' excess makes; None if it cannot decide.
    held_excess_mm
        Largest excess of a fibre that is held at both ends, at the net's spacing.
    doubt
        Why the pocket may crease although its net does not; None if nothing suggests that.
    recipe
        All settings.
    """

    net: net.Net
    sheet: sheet.Sheet
    reference: surface.Reference
    measured_share: float
    closed_rim: bool
    excess: ExcessReport | None
    held_excess_mm: float
    doubt: Reason | None
    recipe: Recipe

    @property
    def by_excess(self) -> bool:
        """Whether the recipe judges this pocket by its excess."""
        return self.excess is not None and self.recipe.verdict.criterion == "excess"

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
        best: Figures,
        every: Sequence[Figures],
        *,
        deadline_passed: bool = False,
        recipe: Recipe | None = None,
        criterion: Criterion | None = None,
    ) -> verdict.Judgement:
        """Judge the pocket.

        Parameters
        ----------
        solution
            The best solution.
        best, every
            Its figures, and those of all solutions that count; if there are none, the best alone counts.
        deadline_passed
            Whether time ran out before the solution was certified, or before all starts that the rule asks for were
            tried; then the figures of the minima decide nothing.
        recipe
            A recipe with other limits than the pocket's own, for studies.
        criterion
            A criterion to use instead of the recipe's.
        """
        counted, known, limits = every or [best], self.excess, recipe or self.recipe
        judged = verdict.judge(
            inside_ply=known is not None,
            excess_range_mm=None if known is None else known.range_mm,
            no_bridge=known is not None and options.cannot_bridge(known.bridge_bound_mm, self.recipe),
            certified=solution.certified,
            rms_mm=best.rms_mm,
            ridge_height_mm=best.ridge_height_mm,
            bridge_height_mm=best.bridge_height_mm,
            rms_range_mm=spread([f.rms_mm for f in counted]),
            ridge_range_mm=spread([f.ridge_height_mm for f in counted]),
            bridge_range_mm=spread([f.bridge_height_mm for f in counted]),
            compliant=solution.certificate.compliant,
            solve_status=solution.certificate.failure or solution.explanation,
            deadline_passed=deadline_passed,
            coverage=self.measured_share,
            closed_rim=self.closed_rim,
            refused=solution.explanation if solution.status in REFUSED else "",
            criteria=criteria(limits, criterion),
        )
        if judged.verdict is verdict.Verdict.CEASE and self.doubt:
            return verdict.Judgement(verdict.Verdict.UNDECIDED, self.doubt.text, remedy=self.doubt.remedy)
        if judged.verdict is not verdict.Verdict.UNDECIDED or known is None:
            return judged
        least_mm = known.range_mm[0] + 2 * known.uncertainty_mm
        if not least_mm <= limits.verdict.max_ridge_mm < known.alone_mm:
            return judged
        return replace(judged, reason=f"{judged.reason}; {_NARROW}: {_DENSER}", remedy=_DENSER)


def lay_pocket(found: FoundPocket, ply: PlyOnMold, stop: _core.Stop | None = None) -> LaidPocket:
    """Lay the net of a pocket, and make the model of its ply.

    Raises
    ------
    InputError
        If the fibre angles are not known there, or no useful net can be laid on the surface.
    """
    laid = lay_net(found, ply, stop)
    if not laid.inside.any():
        raise _core.InputError(f"none of its {len(laid.nodes_mm)} nodes lies where the pocket stands above the cut")
    held = _core.ridge.held_excess(laid._core.net, ply.reference)
    known = _excess(found, laid, held, ply)
    return LaidPocket(
        net=laid,
        sheet=sheet.Sheet.of_net(laid, ply.reference, ply.recipe),
        reference=ply.reference,
        measured_share=found.pocket.measured_share,
        closed_rim=found.foot.closed and len(laid.open_ends) == 0,
        excess=known,
        held_excess_mm=held.largest_mm,
        doubt=Reason(found.doubt, "") if found.doubt else _doubt(found, laid, ply) if known is None else None,
        recipe=ply.recipe,
    )


def _excess(found: FoundPocket, laid: net.Net, held: _core.ridge.HeldExcess, ply: PlyOnMold) -> ExcessReport | None:
    """Return the ridge that the excess makes; None where it does not decide.

    Where the ply can slide in at its edge, the excess is an upper bound: it decides if its ridge stays below the limit.
    """
    runs, made, recipe = found.excess, laid._core, ply.recipe
    if runs is None:
        return None
    if not made.held_all_round:
        stays = excess.ridge_of(excess.upper_mm(runs), recipe) <= options.counts_from_mm(recipe)
        return excess.of_runs(runs, None, recipe) if stays else None
    bound_mm = held.bridge_bound_mm
    if made.finer.spacing > 0:
        bound_mm = max(bound_mm, _core.ridge.held_excess(made.finer, ply.reference).bridge_bound_mm)
    return excess.of_runs(runs, bound_mm, recipe)


def _doubt(found: FoundPocket, laid: net.Net, ply: PlyOnMold) -> Reason | None:
    """Say why a minimum at the ply's edge proves little; None if it proves enough."""
    times = found.foot.area_mm2 / found.pocket.area_mm2
    round_it = f"the ply stands off the mold round it, on {times:.0f} times its area; {_LAY_DOWN}"
    inside = int(np.count_nonzero(laid.inside))
    if inside < _FEWEST_INSIDE:
        what = f"only {inside} of the {len(laid.nodes_mm)} nodes of its net lie inside its outline"
        return Reason(f"{what}: {round_it}", _LAY_DOWN)
    if ply.outline is None or not (laid.kinds == _FREE).any():
        return None
    # Friction holds the ply after a slip of about 20 mm (docs/model.md, section 6), so an edge farther off releases
    # nothing.
    slip_mm = ply.recipe.net.free_edge_mm
    away_mm = float(pocket.distance_to_outline(ply.outline, found.pocket.outline_mm).min())
    if away_mm > _SLIP_LENGTHS * slip_mm:
        what = f"its net is free at an edge of the ply {away_mm:.0f} mm away, and a ply slips by some {slip_mm:g} mm"
        return Reason(f"{what}: {round_it}", _LAY_DOWN)
    # A net at the edge may let a fibre that is held at both ends bow sideways to where the ply is free. It is not known
    # whether friction allows that.
    runs, limits = found.excess, ply.recipe.verdict
    held_mm = 0.0 if runs is None else excess.upper_mm(runs[runs.held])
    if (ridge_mm := excess.ridge_of(held_mm, ply.recipe)) > options.counts_from_mm(ply.recipe):
        side = "above" if ridge_mm > limits.max_ridge_mm else f"within {limits.ridge_margin_mm:.2f} mm of"
        what = (
            f"a fibre that is held at both ends is up to {held_mm:.2f} mm longer than the mold, a ridge of "
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


def criteria(recipe: Recipe, criterion: Criterion | None = None) -> verdict.Criteria:
    """Take the limits from the recipe, and the criterion, too, unless another is given."""
    return verdict.Criteria.from_core(options.criteria(recipe, criterion))
