"""The rework of a report: how much length has to leave which place, and where it can."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from debulk._core import InputError
from debulk.rework import Handling, Rework, plan
from debulk.verdict import Verdict

if TYPE_CHECKING:
    from debulk.results.report import ReportData


def rework(report: ReportData, handling: Handling | None = None) -> Rework | None:
    """Plan it for all pockets that crease, or whose fibres may be too long.

    None without fibre lines in the report, or with a recipe that is none of this version's.
    """
    from debulk.recipe import Recipe

    if report.runs is None:
        return None
    try:
        recipe = Recipe(**report.recipe)
    except InputError:
        return None
    limit_mm = report.recipe.get("verdict", {}).get("max_ridge_mm", np.inf)
    failing = tuple(
        p.id
        for p in report.pockets
        if p.verdict is Verdict.CREASE
        or (p.verdict is Verdict.UNDECIDED and p.excess is not None and p.excess.range_mm[1] > limit_mm)
    )
    runs = report.runs
    return plan(runs, runs.pocket, failing, recipe, report.ply_outline_mm, apart_mm=runs.apart_mm, handling=handling)


def lines_of(planned: Rework | None) -> dict[int, list[str]]:
    """Return the sentences about each pocket, by its number; each begins with the order of its move."""
    lines: dict[int, list[str]] = {}
    for k, move in enumerate(planned.moves if planned else (), 1):
        for number in move.pockets:
            lines.setdefault(number, []).append(f"{k}. {move.line(planned.handling.hold_n)}" if planned else "")
    return lines
