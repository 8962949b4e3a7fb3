"""The ridge that a pocket's excess length makes, known from the laid net before anything is solved."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from debulk import _core, ridge, section
from debulk.inspection import straight_fibres
from debulk.inspection.found import FoundPocket
from debulk.inspection.missed import missed_share
from debulk.inspection.net_fibres import ALONG, fibres
from debulk.inspection.ply_on_mold import PlyOnMold
from debulk.net import Net
from debulk.results.report import ExcessReport

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["of_held_fibres", "of_net", "ridge_of"]

# From scan to scan the outline moves with the noise, and the net moves with it. So the excess scatters by this multiple
# of the noise of the heights, far more than the noise of its nodes explains. Root mean square over 24 pockets of the
# layups 3 and 4, four scans each; the same with noise of 0.02 and of 0.05 mm in the scan.
_SCATTER = 1.3
_INNER = 0  # kind of a movable node within the net


def of_net(laid: Net, ply: PlyOnMold, found: FoundPocket, stop: _core.Stop | None = None) -> ExcessReport | None:
    """Measure the excess of the fibres of a net that `lay_net` has laid on a pocket; raises `Stopped`.

    Returns
    -------
    ExcessReport or None
        None if the ply can slide in at its edge, as the excess of the held fibres is then no bound; and None if no
        closed net could be laid at half the spacing, as the excess is then not known well enough.
    """
    made, finer, reference, recipe = laid._core, laid._core.finer, ply.reference, ply.recipe
    if not made.held_all_round or finer.spacing <= 0:
        return None
    coarse, half = _core.ridge.held_excess(made.net, reference), _core.ridge.held_excess(finer, reference)
    lengths = _core.verdict.ExcessLengths()
    lengths.at_spacing_mm, lengths.at_half_mm = coarse.largest_mm, half.largest_mm
    lengths.half_spacing_mm = finer.spacing
    lengths.segments, lengths.noise_gain = half.segments, half.noise_gain
    if made.noise > 0:
        lengths.noise_mm = made.noise
        lengths.noise_gain = math.hypot(half.noise_gain, _SCATTER * found.feet.noise_mm / made.noise)
    rule = recipe.material.thickness_mm, recipe.material.bulk_factor, recipe.verdict.excess_margin_mm
    made_of_it = _core.verdict.ridge_by_excess(lengths, *rule)
    # Filters only reduce the excess, so what they take away raises only the upper end of the range.
    missed_mm = missed_share(found, laid, reference) * max(made_of_it.excess_mm, 0.0)
    if made_of_it.range.low <= recipe.verdict.max_ridge_mm:  # else it creases, whatever stands between the fibres
        between_mm = straight_fibres.longest(found, ply, stop=stop).excess_mm - made_of_it.excess_mm
        # The longest of hundreds of lines is the one that noise lengthens most. So what the lines add does not count up
        # to half the uncertainty of the excess, and counts fully from the whole uncertainty on; in between it grows
        # without a step.
        clear_mm = between_mm - missed_mm - made_of_it.uncertainty_mm
        missed_mm = min(missed_mm + 2 * max(clear_mm, 0.0), max(missed_mm, between_mm))
    lengths.at_spacing_mm, lengths.at_half_mm = coarse.largest_mm + missed_mm, half.largest_mm + missed_mm
    most = _core.verdict.ridge_by_excess(lengths, *rule)
    return ExcessReport(
        length_mm=made_of_it.excess_mm,
        at_spacing_mm=coarse.largest_mm,
        at_half_mm=half.largest_mm,
        noise_bias_mm=made_of_it.noise_bias_mm,
        height_mm=made_of_it.height_mm,
        range_mm=(made_of_it.range.low, most.range.high),
        elastic_mm=section.elastic_height(made_of_it.excess_mm, recipe),
        noise_mm=made_of_it.noise_mm,
        spacing_error_mm=made_of_it.spacing_error_mm,
        missed_mm=missed_mm / 2,
        uncertainty_mm=made_of_it.uncertainty_mm,
        bridge_bound_mm=max(coarse.bridge_bound_mm, half.bridge_bound_mm),
    )


def of_held_fibres(laid: Net, ply: PlyOnMold) -> float:
    """Return the largest excess, mm, of the fibres that friction holds at both ends, whatever the rest of the net does.

    Such an end lies on the mold, and the ply continues beyond it along the fibre for the length over which an edge
    slips. Near an edge a net lets the nodes of such a fibre slide nevertheless: sideways, if the fibre runs along it.
    """
    on_mold = laid.kinds != _INNER
    ways_mm, enough_mm = laid._core.hold_ways, max(ply.recipe.net.free_edge_mm, laid.spacing_mm)
    neighbours = laid.neighbours.copy()
    for direction, fibre in fibres(laid.neighbours):
        goes_on = not ways_mm or ways_mm[fibre[0]][direction] >= enough_mm
        if not (len(fibre) > 1 and on_mold[fibre[0]] and on_mold[fibre[-1]] and goes_on):
            neighbours[np.ix_(fibre, ALONG[direction])] = -1
    return float(_core.ridge.largest_fibre_excess(laid.nodes_mm, neighbours, ply.reference))


def ridge_of(excess_mm: float, recipe: Recipe) -> float:
    """Return the height, mm, of a single ridge that takes up all of an excess length."""
    material = recipe.material
    base_mm = material.thickness_mm / material.bulk_factor
    if excess_mm <= 0:
        return base_mm
    span_mm = 2 * material.thickness_mm + excess_mm  # any mold length with room for the ridge gives the same
    return max(base_mm, ridge.ridge_height(span_mm + excess_mm, span_mm, material.thickness_mm))
