"""How well pockets repeat from scan to scan: area, peak, excess and ridge as a gauge study, and their verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError
from debulk.chain.anova import crossed
from debulk.chain.kappa import fleiss
from debulk.chain.study import Agreement, Study
from debulk.report import Report
from debulk.results.report import PocketReport

_NEAR_MM, _NEAR_SHARE = 8.0, 0.25  # a pocket's centre moves by no more, or by no more than this of its area's root
_LEAST_PARTS = 2


class Repeated(NamedTuple):
    """The gauge studies of area, peak, excess and ridge, and the agreement of verdicts."""

    studies: tuple[Study, ...]
    agreement: Agreement | None


def studies(reports: Sequence[Report], sessions: Sequence[str] | None, limit_mm: float) -> Repeated:
    """Analyse the pockets of several scans of one layup, of which `sessions` names the session; None: all are of one.

    The limit of a ridge is the width of the tolerance of ridges, which begins at 0.
    """
    rows, sometimes = _matched(reports)
    if len(rows) < _LEAST_PARTS:
        return Repeated((), None)
    order = _order(len(reports), sessions)
    found = []
    for name, unit, tolerance in (
        ("area", "mm²", None),
        ("peak", "mm", None),
        ("excess length", "mm", None),
        ("ridge", "mm", limit_mm),
    ):
        values = np.array([[_value(one, name) for one in row] for row in rows], dtype=np.float64)
        values = values[np.isfinite(values).all(axis=1)]
        if len(values) >= _LEAST_PARTS:
            found.append(crossed(values[:, order], name, unit, tolerance))
    verdicts = [[one.verdict.value for one in row] for row in rows]
    agreement = Agreement(
        pockets=len(rows),
        scans=len(reports),
        same=sum(len(set(one)) == 1 for one in verdicts),
        kappa=fleiss(verdicts),
        sometimes=sometimes,
    )
    return Repeated(tuple(found), agreement)


def _order(count: int, sessions: Sequence[str] | None) -> NDArray[np.int64]:
    """Return the numbers of the scans as (sessions, trials)."""
    if sessions is None:
        return np.arange(count)[None]
    if len(sessions) != count:
        raise InputError(f"sessions: expected one for each of the {count} scans, but got {len(sessions)}")
    groups = [[k for k, one in enumerate(sessions) if one == name] for name in dict.fromkeys(sessions)]
    trials = min(len(group) for group in groups)
    if trials < 2:
        raise InputError("sessions: expected at least two scans in each session")
    return np.array([group[:trials] for group in groups])


def _matched(reports: Sequence[Report]) -> tuple[list[list[PocketReport]], int]:
    """Return the pockets that are in every report, each with its reports, and how many are in some only."""
    rows: list[list[PocketReport]] = []
    sometimes = 0
    for pocket in reports[0].pockets:
        others = [_same(pocket, report) for report in reports[1:]]
        full = [one for one in others if one is not None]
        if len(full) == len(others):
            rows.append([pocket, *full])
        else:
            sometimes += 1
    new = sum(
        all(_same(one, report) is None for report in reports[:k])
        for k, later in enumerate(reports)
        if k
        for one in later.pockets
    )
    return rows, sometimes + new


def _same(pocket: PocketReport, report: Report) -> PocketReport | None:
    if pocket.centroid_mm is None:
        return None
    reach = max(_NEAR_MM, _NEAR_SHARE * float(np.sqrt(pocket.area_mm2)))
    near = [
        (float(np.hypot(one.centroid_mm[0] - pocket.centroid_mm[0], one.centroid_mm[1] - pocket.centroid_mm[1])), one)
        for one in report.pockets
        if one.centroid_mm is not None
    ]
    far, nearest = min(near, key=lambda pair: pair[0], default=(np.inf, None))
    return nearest if far <= reach else None


def _value(pocket: PocketReport, name: str) -> float:
    if name == "area":
        return pocket.area_mm2
    if name == "peak":
        return pocket.peak_mm
    if name == "excess length":
        return float("nan") if pocket.excess is None else pocket.excess.length_mm
    if pocket.excess is not None:  # what the chain measures; which model decides may change from scan to scan
        return pocket.excess.height_mm
    ridge = pocket.deciding_ridge
    return float("nan") if ridge is None else ridge.height_mm
