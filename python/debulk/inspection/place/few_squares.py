"""The reason why too few squares of the ply are known to determine its level from them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from debulk.inspection.clouds.thinning import pitch_of
from debulk.inspection.evidence.ply_zones import PlyZones
from debulk.inspection.evidence.sample import Sample
from debulk.results.finding import Reason

_SEEN = 0.8  # of the ply: if more was seen, squares are missing for another reason than an incomplete scan
_ROUND_MM = 50  # margin that a cropped scan should keep round the ply


def few_squares_reason(
    zones: PlyZones, sample: Sample, on: NDArray[np.bool_], *, least: int, share: float, outlined: bool
) -> Reason:
    """Say why there are fewer than the `least` squares of the ply that are needed, and what to do.

    `on` are the points of the sample well inside the ply, `share` is that of the ply in the known squares.
    """
    known = np.isfinite(sample.height_mm)
    each_mm2 = pitch_of(sample.points_mm[known, :2], 1) ** 2  # inf if hardly any point is known
    if not outlined or not on.any() or not _SEEN * zones.inner_mm2 <= np.count_nonzero(on) * each_mm2 < np.inf:
        what = f"between the pockets only {100 * share:.1f} % of it was seen by scan and reference"
        remedy = (
            "check that the outline, the scan and the reference are of the same part, in mm, with their pose: z is to "
            "point up, away from the mold"
        )
    elif zones.squares < least:
        what = (
            f"the ply is too small, only {zones.squares} squares of {zones.side_mm:g} mm lie {zones.inset_mm:g} mm "
            f"inside its outline, and {least} are needed"
        )
        remedy = "check that the outline is in mm"
    elif len(zones.blocks(sample, on, on).height_mm) < least:
        what = (
            f"the ply is a small part of the scan, only {np.count_nonzero(on)} of the {len(on)} points that are looked "
            "at for it lie well inside the outline"
        )
        remedy = f"crop scan and reference to the ply and {_ROUND_MM} mm round it"
    else:
        what = f"pockets with their feet leave only {100 * share:.1f} % of the ply between them"
        remedy = "lay it down and scan again"
    return Reason(f"the level of the ply cannot be determined: {what}; {remedy}", remedy)
