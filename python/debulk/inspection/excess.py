"""The ridge that a pocket's excess length makes, known from the laid net before anything is solved."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from debulk import _core, section
from debulk.net import Net
from debulk.results.report import ExcessReport
from debulk.surface import Reference

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["of_net"]

# From scan to scan the outline moves with the noise, and the net with it: the excess scatters by so many times the
# noise of the heights, far more than the noise of its nodes makes. Root mean square over 24 pockets of the layups 3 and
# 4, four scans each; the same with noise of 0.02 and of 0.05 mm in the scan.
_SCATTER = 1.3


def of_net(laid: Net, reference: Reference, recipe: Recipe, noise_mm: float) -> ExcessReport | None:
    """Measure the fibres of a net that `lay_net` has laid on heights with this noise.

    Returns
    -------
    ExcessReport or None
        None where the ply slides in at its edge, or no closed net could be laid at half the spacing: there the excess
        of the fibres that are held bounds nothing, or is not known well enough.
    """
    made, finer = laid._core, laid._core.finer
    if not made.held_all_round or finer.spacing <= 0:
        return None
    coarse, half = _core.ridge.held_excess(made.net, reference), _core.ridge.held_excess(finer, reference)
    lengths = _core.verdict.ExcessLengths()
    lengths.at_spacing_mm, lengths.at_half_mm = coarse.largest_mm, half.largest_mm
    lengths.half_spacing_mm = finer.spacing
    lengths.segments, lengths.noise_gain = half.segments, half.noise_gain
    if made.noise > 0:
        lengths.noise_mm = made.noise
        lengths.noise_gain = math.hypot(half.noise_gain, _SCATTER * noise_mm / made.noise)
    ridge = _core.verdict.ridge_by_excess(
        lengths, recipe.material.thickness_mm, recipe.material.bulk_factor, recipe.verdict.excess_margin_mm
    )
    return ExcessReport(
        length_mm=ridge.excess_mm,
        at_spacing_mm=coarse.largest_mm,
        at_half_mm=half.largest_mm,
        noise_bias_mm=ridge.noise_bias_mm,
        height_mm=ridge.height_mm,
        range_mm=(ridge.range.low, ridge.range.high),
        elastic_mm=section.elastic_height(ridge.excess_mm, recipe),
        noise_mm=ridge.noise_mm,
        spacing_error_mm=ridge.spacing_error_mm,
        uncertainty_mm=ridge.uncertainty_mm,
        bridge_bound_mm=max(coarse.bridge_bound_mm, half.bridge_bound_mm),
    )
