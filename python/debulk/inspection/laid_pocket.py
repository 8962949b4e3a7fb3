"""A pocket whose net is laid: ready to be settled under the vacuum, read for its ridges, and judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from debulk import _core, net, ridge, sheet, solve, surface, verdict
from debulk.inspection.fibre_angles import angles_at
from debulk.inspection.found import FoundPocket
from debulk.inspection.ply_on_mold import PlyOnMold
from debulk.inspection.starts import Figures, spread
from debulk.recipe import options

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["REFUSED", "LaidPocket", "criteria", "lay_net", "lay_pocket"]

# How a solve ends that says of the pocket itself that it cannot be judged.
REFUSED = ("too_few_movable_nodes", "no_minimum", "not_a_surface")


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
    recipe
        All settings.
    """

    net: net.Net
    sheet: sheet.Sheet
    reference: surface.Reference
    measured_share: float
    closed_rim: bool
    recipe: Recipe

    def __getstate__(self) -> dict[str, object]:
        """Leave out what is compiled: a copy from another process can still be judged."""
        return {k: v for k, v in self.__dict__.items() if k not in ("sheet", "reference")}

    def post_process(self, solution: solve.Solution) -> ridge.PostProcessed:
        """Return the ridges that a solution stands for."""
        wanted = options.ridge(self.recipe)
        return ridge.from_core(_core.ridge.post_process(solution._core, self.net._core, self.reference, wanted))

    def judge(
        self,
        solution: solve.Solution,
        best: Figures,
        every: Sequence[Figures],
        *,
        deadline_passed: bool = False,
        recipe: Recipe | None = None,
    ) -> verdict.Judgement:
        """Judge the pocket.

        Parameters
        ----------
        solution
            The best one.
        best, every
            Its figures, and those of all solutions that count; none: of the best alone.
        deadline_passed
            Whether time ran out before the solution was certified, or before all starts that the rule asks for were
            tried: then nothing is decided.
        recipe
            With other limits than the pocket's own; for studies.
        """
        counted = every or [best]
        return verdict.judge(
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
            criteria=criteria(recipe or self.recipe),
        )


def lay_pocket(found: FoundPocket, ply: PlyOnMold, stop: _core.Stop | None = None) -> LaidPocket:
    """Lay the net of a pocket, and make the ply of it.

    Raises
    ------
    InputError
        Fibre angles that are not known there, or a surface on which no net can be laid.
    """
    laid = lay_net(found, ply, stop)
    return LaidPocket(
        net=laid,
        sheet=sheet.Sheet.of_net(laid, ply.reference, ply.recipe),
        reference=ply.reference,
        measured_share=found.pocket.measured_share,
        closed_rim=found.foot.closed and len(laid.open_ends) == 0,
        recipe=ply.recipe,
    )


def lay_net(found: FoundPocket, ply: PlyOnMold, stop: _core.Stop | None = None) -> net.Net:
    """Lay the net of a pocket on its patch."""
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


def criteria(recipe: Recipe) -> verdict.Criteria:
    """Take the limits from the recipe."""
    limits = recipe.verdict
    return verdict.Criteria(
        max_rms_mm=limits.max_rms_mm,
        max_ridge_height_mm=limits.max_ridge_mm,
        min_coverage=limits.min_coverage,
        min_pocket_coverage=limits.min_pocket_coverage,
        rms_margin_mm=limits.rms_margin_mm,
        ridge_margin_mm=limits.ridge_margin_mm,
        compliance_margin_mm=limits.compliance_margin_mm,
    )
