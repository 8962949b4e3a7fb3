"""Spots whose points scatter about the ply, and the pockets in them: nobody knows how the ply lies there.

In a highlight or on a dark spot a scanner returns points above and below the surface alike. What is left of them when
the outliers are out looks like a bump, or like less of one than there is. No ply lies under the mold, so that the
points there tell such a spot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from debulk import pocket
from debulk.arrays import Floats
from debulk.inspection.evidence.pieces import pieces_of
from debulk.inspection.ply import polyline
from debulk.inspection.rawscan import narrow
from debulk.inspection.rawscan.narrow import Standing
from debulk.results.finding import Finding
from debulk.results.half_seen import or_undecided
from debulk.results.report import PocketReport
from debulk.verdict import Verdict
from debulk.words import in_mm, xy_of


@dataclass(frozen=True)
class Limits:
    """Of samples under the mold; `tests/python/inspection/test_scattered.py` has such spots, and bumps beside them."""

    least_share: float = 0.03  # of its foot: of spots of which half was unseen it was 0.037 to 0.12, of bumps 0.006
    # Round its foot: of a spot the filters may leave a part that holds none. Of 0.1 to 0.3 cm² left of five spots 7 to
    # 19 mm wide the share within it was 0.029 to 0.17.
    round_mm: float = 3.0
    # Of a square as wide as a hole in which a ridge could hide, where no pocket was found: of 0.5 % of pixels that fly
    # under the mold at random hardly any square has so many.
    spot_share: float = 0.08
    spot_mm: float = 12.0
    wide_mm: float = 1.2  # deviation across, at least: of lines at kinks of the mold it was 0, of seven spots 1.6 to 3


LIMITS = Limits()
_UNDER = "lie under the mold, where no ply can be (a highlight, a dark spot?)"
_AGAIN = "scan again, with another exposure or from another side"


def told(reports: Sequence[PocketReport], standing: Standing) -> tuple[PocketReport, ...]:
    """Return the pockets, those of them that scattered points decided as not judged."""
    decided = (Verdict.CEASE, Verdict.CREASE)
    return tuple(_told(one, standing) if one.verdict in decided else one for one in reports)


def findings(reports: Sequence[PocketReport], standing: Standing) -> list[Finding]:
    """Judge the spots beside the pockets, the largest first."""
    if not len(standing.sunk_mm):
        return []
    cell_mm = LIMITS.round_mm
    first_mm = standing.sunk_mm.min(axis=0) - LIMITS.spot_mm
    column, row = np.rint((standing.sunk_mm - first_mm) / cell_mm).astype(np.int64).T
    wide = round(LIMITS.spot_mm / cell_mm)
    number = np.zeros((row.max() + wide + 1, column.max() + wide + 1), dtype=np.float32)
    np.add.at(number, (row, column), 1)
    within = cv2.boxFilter(number, -1, (wide, wide), normalize=False, borderType=cv2.BORDER_CONSTANT)
    least = max(narrow.LIMITS.fewest, LIMITS.spot_share * (LIMITS.spot_mm / standing.sample_mm) ** 2)
    spots = []
    for (rows, columns), own in pieces_of(within >= least, 8).each(1, 0):
        y, x = np.argwhere(own).mean(axis=0)
        at_mm = first_mm + cell_mm * np.array([columns.start + x, rows.start + y])
        spots.append((int(within[rows, columns][own].max()), at_mm))
    return [
        _of_spot(count, at_mm, standing)
        for count, at_mm in sorted(spots, key=lambda spot: -spot[0])
        if _is_wide(standing.sunk_mm, at_mm)
        and not any(pocket.inside(one.foot_or_outline_mm, at_mm[None])[0] for one in reports)
    ]


def _is_wide(sunk_mm: Floats, at_mm: Floats) -> bool:
    """Return whether what lies under the mold round a place is a spot, not a line: a smooth mold misses a kink."""
    off = sunk_mm[(np.abs(sunk_mm - at_mm) <= 0.5 * LIMITS.spot_mm).all(axis=1)]
    x, y = (off - off.mean(axis=0)).T
    xx, yy, xy = (float(np.mean(product)) for product in (x * x, y * y, x * y))
    across_mm2 = 0.5 * (xx + yy - np.hypot(xx - yy, 2 * xy))  # variance along the shorter principal axis
    return bool(across_mm2 >= LIMITS.wide_mm**2)


def _of_spot(count: int, at_mm: Floats, standing: Standing) -> Finding:
    reason = (
        f"a spot at {in_mm(at_mm)} whose points scatter: of those read every {standing.sample_mm:.2g} mm, {count} "
        f"within {LIMITS.spot_mm:g} mm {_UNDER}: nobody knows how the ply lies there; {_AGAIN}"
    )
    return Finding("holes", Verdict.UNDECIDED, reason, place_mm=xy_of(at_mm), remedy=_AGAIN)


def _told(one: PocketReport, standing: Standing) -> PocketReport:
    within = _under_the_mold(one.foot_or_outline_mm, standing)
    if within == 0:
        return one
    reason = (
        f"not judged: its points scatter, {within} of those read every {standing.sample_mm:.2g} mm {_UNDER}; "
        f"taken as they are: {one.reason}"
    )
    verdict = or_undecided(Verdict.INVALID, one.promoted)
    return replace(one, verdict=verdict, reason=reason, remedy=_AGAIN, decided_by="", excess=None)


def _under_the_mold(foot_mm: Floats, standing: Standing) -> int:
    """Return how many samples in a foot or round it lie under the mold, if they are so many that points scatter."""
    low, high = foot_mm.min(axis=0) - LIMITS.round_mm, foot_mm.max(axis=0) + LIMITS.round_mm
    sunk_mm = standing.sunk_mm[((standing.sunk_mm >= low) & (standing.sunk_mm <= high)).all(axis=1)]
    from_foot_mm = np.where(pocket.inside(foot_mm, sunk_mm), 0.0, pocket.distance_to_outline(foot_mm, sunk_mm))
    round_it_mm = polyline.perimeter_mm(foot_mm)
    for reach_mm in (0.0, LIMITS.round_mm):
        within = int(np.count_nonzero(from_foot_mm <= reach_mm))
        area_mm2 = pocket.polygon_area(foot_mm) + reach_mm * (round_it_mm + np.pi * reach_mm)  # Steiner's formula
        if within >= narrow.LIMITS.fewest and within * standing.sample_mm**2 >= LIMITS.least_share * area_mm2:
            return within
    return 0
