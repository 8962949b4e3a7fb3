"""A pocket that the excess of its fibre lines decides, before any net is laid on it."""

from __future__ import annotations

import numpy as np

from debulk import _core, pocket, verdict
from debulk.inspection.evaluate.laid_pocket import criteria
from debulk.inspection.find.found import FoundPocket
from debulk.inspection.ply import excess
from debulk.inspection.ply.fibre_angles import angles_at
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.recipe import options
from debulk.results.report import ExcessReport
from debulk.verdict import Judgement, Verdict

__all__ = ["judged"]


def judged(found: FoundPocket, ply: PlyOnMold) -> tuple[ExcessReport, Judgement] | None:
    """Judge a pocket inside the ply by the runs that cross its foot.

    Its bound on bridges holds for any net on it and is larger than the net's own: no string over the mold from any
    point below the net to any other along a fibre stands higher, however short the ply is.

    Returns
    -------
    tuple of ExcessReport and Judgement, or None
        None where a net is needed: near the ply's edge, where the excess or the bound does not decide, and wherever
        something else raises a doubt.
    """
    recipe, runs = ply.recipe, found.excess
    if recipe.verdict.criterion != "excess" or runs is None or found.promoted or found.doubt or found.foot.parted:
        return None
    around_mm = _spacing_mm(found, ply)
    if not _inside(found, ply, around_mm):
        return None
    try:
        angles = np.radians(angles_at(ply.fibre_angles_deg, found.pocket.centroid_mm))
    except _core.InputError:  # they are not known there, which the net's refusal says
        return None
    foot = found.feet._core.feet[found.index]
    bound_mm = _core.ridge.string_bound(foot, around_mm, angles, ply.reference)
    known = excess.of_runs(runs, bound_mm, recipe)
    decided = verdict.judge(
        certified=False,
        solve_status="not solved yet",
        coverage=found.pocket.measured_share,
        closed_rim=found.foot.closed,
        inside_ply=True,
        excess_range_mm=known.range_mm,
        no_bridge=options.cannot_bridge(bound_mm, recipe),
        criteria=criteria(recipe),
    )
    if decided.decided_by != "excess" or decided.verdict not in (Verdict.CEASE, Verdict.CREASE):
        return None
    return known, decided


def _spacing_mm(found: FoundPocket, ply: PlyOnMold) -> float:
    """Return an upper estimate of the spacing of the pocket's net, which reaches so far beyond the foot."""
    net = ply.recipe.net
    return net.spacing_mm or 2 * float(np.sqrt(found.foot.area_mm2 / net.node_target))


def _inside(found: FoundPocket, ply: PlyOnMold, around_mm: float) -> bool:
    """Return whether no node of a net on the pocket can be free, because the ply's edge is farther away."""
    if found.pocket.touches_ply_edge or found.foot.touches_ply_edge:
        return False
    if ply.outline is None:
        return True
    least_mm, rim = ply.recipe.net.free_edge_mm + around_mm, found.foot.outline_mm
    low, high = rim.min(axis=0), rim.max(axis=0)
    from_middle_mm = float(pocket.distance_to_outline(ply.outline, 0.5 * (low + high)[None])[0])
    if from_middle_mm > least_mm + 0.5 * float(np.hypot(*(high - low))):
        return True
    return bool(pocket.distance_to_outline(ply.outline, rim).min() > least_mm)
