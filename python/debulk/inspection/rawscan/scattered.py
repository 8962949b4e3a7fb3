"""Pockets that would crease if their points could be believed, but whose points scatter about the ply.

In a highlight or on a dark spot a scanner returns points above and below the surface alike. What is left of them when
the outliers are out looks like a bump. No ply lies under the mold, so that the points there tell such a spot from one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from debulk import pocket
from debulk.inspection.rawscan.narrow import Standing
from debulk.results.half_seen import or_undecided
from debulk.results.report import PocketReport
from debulk.verdict import Verdict


@dataclass(frozen=True)
class Limits:
    """Of samples under the mold; `tests/python/inspection/test_scattered.py` has such spots, and bumps beside them."""

    least_share: float = 0.03  # of its foot: of spots of which half was unseen it was 0.037 to 0.12, of bumps 0.006
    fewest: int = 4  # samples: fewer are flying pixels


LIMITS = Limits()


def told(reports: Sequence[PocketReport], standing: Standing) -> tuple[PocketReport, ...]:
    """Return the pockets, those that are CREASE by points which scatter as not judged."""
    return tuple(_told(one, standing) if one.verdict is Verdict.CREASE else one for one in reports)


def _told(one: PocketReport, standing: Standing) -> PocketReport:
    foot_mm = one.foot_or_outline_mm
    within = np.count_nonzero(pocket.inside(foot_mm, standing.sunk_mm))
    if within < LIMITS.fewest or within * standing.sample_mm**2 < LIMITS.least_share * pocket.polygon_area(foot_mm):
        return one
    reason = (
        f"not judged: its points scatter, {within} of those read every {standing.sample_mm:.2g} mm lie under the mold, "
        f"where no ply can be (a highlight, a dark spot?); taken as they are: {one.reason}"
    )
    remedy = "scan again, with another exposure or from another side"
    verdict = or_undecided(Verdict.INVALID, one.promoted)
    return replace(one, verdict=verdict, reason=reason, remedy=remedy, decided_by="", excess=None)
