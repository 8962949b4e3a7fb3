"""How high the ply bridges a hollow: fibres that are too short, as strings over the mold (docs/model.md, section 5).

A ply that is too short to reach the bottom of a hollow spans it. A net of some 100 nodes shows that coarsely: its
chords cut across the hollow, crossing fibres share the pull, and a fibre that slips keeps the height that it had while
it was pinned. So the verdict takes each fibre line of the scan that is too short as a string that friction holds. A ply
too short for a narrow hollow stands over it lower than any pocket, and is judged in the same way.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from debulk import _core
from debulk.fibre import FibreRuns
from debulk.inspection.find.found import FoundPocket
from debulk.inspection.ply.excess import LEAST_ERROR_MM
from debulk.inspection.ply.fibre_angles import angles_at
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.recipe import options
from debulk.results.bridge_section import BridgeSection

# Where a fibre is surely too short, the upper end of its height by its errors lay below that of an own code in 6 of 24
# scans, by up to 0.14 mm (bench/trust/bridges_fresh.txt). The margin of the limit covers the rest.
_MISSED_MM = 0.1
_UNKNOWN = (math.nan, math.nan)


@dataclass(frozen=True)
class Bridge:
    """The bridge over one place."""

    bound_mm: float
    """No fibre bridges a larger gap, whatever its length."""
    section: BridgeSection | None
    """The fibre that bridges highest; None if the bound is enough, or if the mold is not known."""
    range_mm: tuple[float, float]
    """Lowest and highest height of the bridge, with the consolidated ply; NaN: not known."""

    def counts(self, least_mm: float) -> bool:
        """Return whether it may be this high."""
        return not self.range_mm[1] < least_mm


def bridge_over(found: FoundPocket, ply: PlyOnMold, stop: _core.Stop) -> Bridge:
    """Return the bridge over a pocket or a bump; raises `Stopped`, and InputError where the angles are not known.

    No bridge is higher than a string that is pulled taut over the mold, from any point of the foot and one spacing of a
    net round it to any other along a fibre. Nor is it higher than the ply stands now on fibres that are not surely too
    long, which is asked first. Fibres are taken as strings where both bounds leave a bridge that counts.
    """
    recipe, runs = ply.recipe, found.excess
    angles = np.radians(angles_at(ply.fibre_angles_deg, found.pocket.centroid_mm))
    bound_mm = math.inf if runs is None else float(runs.gap_mm[runs.low_mm < runs.uncertainty_mm].max(initial=0.0))
    if not options.cannot_bridge(bound_mm, recipe):
        foot = found.feet._core.feet[found.index]
        bound_mm = min(bound_mm, _core.ridge.string_bound(foot, net_spacing_mm(found, ply), angles, ply.reference))
    if options.cannot_bridge(bound_mm, recipe):
        return Bridge(bound_mm, None, (0.0, 0.0))
    section = _measured(runs, ply, stop)
    return Bridge(bound_mm, section, _UNKNOWN if section is None else section.range_mm)


def net_spacing_mm(found: FoundPocket, ply: PlyOnMold) -> float:
    """Return an upper estimate of the spacing of a pocket's net, which reaches so far beyond the foot."""
    net = ply.recipe.net
    return net.spacing_mm or 2 * float(np.sqrt(found.foot.area_mm2 / net.node_target))


def _measured(runs: FibreRuns | None, ply: PlyOnMold, stop: _core.Stop) -> BridgeSection | None:
    """Take each fibre over a pocket as a string; None if no run crosses it."""
    if runs is None:
        return None
    recipe, runs = ply.recipe, runs[runs.spans == 1]
    # Off the mold from its first run over the pocket to its last, a fibre is one string.
    first = np.flatnonzero(np.diff(runs.line, prepend=-1))
    last = np.flatnonzero(np.diff(runs.line, append=-1))
    lacks_mm = -np.add.reduceat(runs.excess_mm, first)
    error_mm = np.maximum(np.sqrt(np.add.reduceat(runs.uncertainty_mm**2, first)), LEAST_ERROR_MM)
    # What is too long on it may feed what is too short, or not, as flat ply between them may hold both.
    most_mm = np.maximum(lacks_mm, -np.minimum.reduceat(runs.excess_mm, first)) + error_mm
    fibres = np.column_stack([runs.from_mm[first], runs.to_mm[last], lacks_mm, error_mm, most_mm])
    out = _core.ridge.bridge_section(fibres, ply.reference, ply.outline, options.ply(recipe), stop)
    least, height, most = (options.bridge_mm(gap, recipe) for gap in (out.least_gap_mm, out.gap_mm, out.most_gap_mm))
    more_mm = _MISSED_MM if most > 0 and out.lacks_mm > out.error_mm else 0.0
    return BridgeSection(
        height_mm=height,
        range_mm=(min(least, height), max(most, height) + more_mm),  # only rounding can put them out of order
        lacks_mm=out.lacks_mm,
        lacks_error_mm=out.error_mm,
        pull_n_per_mm=out.pull_n_per_mm,
        hold_n_per_mm=out.hold_n_per_mm,
    )
