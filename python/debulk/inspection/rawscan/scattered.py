"""Pockets that would crease if their points could be believed, but whose points scatter about the ply.

In a highlight or on a dark spot a scanner returns points above and below the surface alike. What is left of them when
the outliers are out looks like a bump. No ply lies under the mold, so that the points there tell such a spot from one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from debulk import pocket
from debulk.arrays import Floats
from debulk.inspection.ply import polyline
from debulk.inspection.rawscan import narrow
from debulk.inspection.rawscan.narrow import Standing
from debulk.results.half_seen import or_undecided
from debulk.results.report import PocketReport
from debulk.verdict import Verdict


@dataclass(frozen=True)
class Limits:
    """Of samples under the mold; `tests/python/inspection/test_scattered.py` has such spots, and bumps beside them."""

    least_share: float = 0.03  # of its foot: of spots of which half was unseen it was 0.037 to 0.12, of bumps 0.006


LIMITS = Limits()


def told(reports: Sequence[PocketReport], standing: Standing) -> tuple[PocketReport, ...]:
    """Return the pockets, those that are CREASE by points which scatter as not judged."""
    return tuple(_told(one, standing) if one.verdict is Verdict.CREASE else one for one in reports)


def _told(one: PocketReport, standing: Standing) -> PocketReport:
    within = _under_the_mold(one.foot_or_outline_mm, standing)
    if within == 0:
        return one
    reason = (
        f"not judged: its points scatter, {within} of those read every {standing.sample_mm:.2g} mm lie under the mold, "
        f"where no ply can be (a highlight, a dark spot?); taken as they are: {one.reason}"
    )
    remedy = "scan again, with another exposure or from another side"
    verdict = or_undecided(Verdict.INVALID, one.promoted)
    return replace(one, verdict=verdict, reason=reason, remedy=remedy, decided_by="", excess=None)


def _under_the_mold(foot_mm: Floats, standing: Standing) -> int:
    """Return how many samples in a foot or round it lie under the mold, if they are so many that points scatter."""
    # Of a spot the filters may leave a part that holds none. Of 0.1 to 0.3 cm² left of five spots 7 to 19 mm wide the
    # share within 3 mm of it was 0.029 to 0.17.
    round_mm = narrow.LIMITS.near_samples * standing.sample_mm
    low, high = foot_mm.min(axis=0) - round_mm, foot_mm.max(axis=0) + round_mm
    sunk_mm = standing.sunk_mm[((standing.sunk_mm >= low) & (standing.sunk_mm <= high)).all(axis=1)]
    from_foot_mm = np.where(pocket.inside(foot_mm, sunk_mm), 0.0, pocket.distance_to_outline(foot_mm, sunk_mm))
    round_it_mm = polyline.perimeter_mm(foot_mm)
    for reach_mm in (0.0, round_mm):
        within = int(np.count_nonzero(from_foot_mm <= reach_mm))
        area_mm2 = pocket.polygon_area(foot_mm) + reach_mm * (round_it_mm + np.pi * reach_mm)  # Steiner's formula
        if within >= narrow.LIMITS.fewest and within * standing.sample_mm**2 >= LIMITS.least_share * area_mm2:
            return within
    return 0
