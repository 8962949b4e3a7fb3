"""Fibres that cross several places off the mold: the excess of all of them may gather in one fold (docs/verdicts.md).

Whether the excess of one place is drawn into the fold of another depends on the history of the vacuum. So if only all
places of a run together exceed the limit, the verdict is UNDECIDED.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from debulk.inspection.find.found import FoundPocket, runs_over
from debulk.inspection.lines.places import MARGIN_MM
from debulk.inspection.ply import excess
from debulk.inspection.ply.fibre_runs import ScanRuns, draw_length
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.results.finding import Finding
from debulk.results.number import HIGHEST_MM
from debulk.results.report import PocketReport
from debulk.verdict import Verdict
from debulk.words import in_mm, xy_of


def named(reports: Sequence[PocketReport], pockets: Sequence[FoundPocket], ply: PlyOnMold) -> tuple[PocketReport, ...]:
    """Name what shares a fibre with a pocket that is UNDECIDED only because one fold may draw all of it together."""
    limit_mm = ply.recipe.verdict.max_ridge_mm
    out = []
    for p, one in zip(reports, pockets, strict=True):
        known, runs = p.excess, one.excess
        together = known is not None and known.alone_mm <= limit_mm < known.range_mm[1]
        if p.verdict is not Verdict.UNDECIDED or known is None or runs is None or not together:
            out.append(p)
            continue
        worst = int(one.crossing[np.argmax(excess.most_mm(runs))])
        same = [f"pocket {other.number}" for other in pockets if other is not one and worst in other.crossing]
        same += _bumps_on(worst, one, pockets)
        with_them = "".join(f" and {name}" for name in same)
        length_mm = float(runs.high_mm.max())
        out.append(replace(p, reason=_reason(f"it{with_them}", length_mm, known.range_mm[1], ply), decided_by=""))
    return tuple(out)


def _bumps_on(worst: int, found: FoundPocket, pockets: Sequence[FoundPocket]) -> Iterator[str]:
    """Name the parts of a run that cross no pocket."""
    assert found.runs is not None
    runs = found.runs.runs
    parts = excess.alone(runs) & (runs.family == runs.family[worst]) & (runs.line == runs.line[worst])
    parts[runs_over(pockets)] = False
    ends_mm = np.linalg.norm(runs.top_mm - runs.from_mm[worst], axis=1) + np.linalg.norm(
        runs.top_mm - runs.to_mm[worst], axis=1
    )
    for place in runs.top_mm[parts & (ends_mm < 1.01 * runs.length_mm[worst])]:
        yield f"the bump at {in_mm(place)}"


def findings(runs: ScanRuns | None, pockets: Sequence[FoundPocket], ply: PlyOnMold) -> list[Finding]:
    """Judge the runs over no judged pocket that no end frees: UNDECIDED for each place whose ridge may be too high."""
    if runs is None or ply.recipe.verdict.criterion != "excess":
        return []
    every, limit_mm = runs.runs, ply.recipe.verdict.max_ridge_mm
    left = np.setdiff1d(np.flatnonzero(excess.bound(every)), runs_over(pockets))
    judged: list[Finding] = []
    named_mm = np.zeros((0, 2))
    for k, ridge_mm in excess.above_limit(excess.most_mm(every)[left], ply.recipe):
        n = left[k]
        if (np.linalg.norm(named_mm - every.top_mm[n], axis=1) < MARGIN_MM).any():
            continue  # only the worse of two runs so near is named
        named_mm = np.vstack([named_mm, every.top_mm[n]])
        where = f"the ply from {in_mm(every.from_mm[n], every.to_mm[n])}, where no pocket is,"
        reason = _reason(where, float(every.high_mm[n]), ridge_mm, ply)
        top = xy_of(every.top_mm[n])
        judged.append(Finding("shared_fibres", Verdict.UNDECIDED, reason, ridge_mm, limit_mm, "mm", top))
    return judged


def _reason(over: str, length_mm: float, ridge_mm: float, ply: PlyOnMold) -> str:
    limit_mm, draw_mm = ply.recipe.verdict.max_ridge_mm, draw_length(ply.recipe)
    longer = f"a fibre over {over} is up to {length_mm:.2f} mm longer than the mold: a ridge of up to {ridge_mm:.2f} mm"
    if ridge_mm > HIGHEST_MM:
        longer = f"nothing bounds how much longer than the mold a fibre over {over} is: a ridge of any height"
    return (
        f"{longer}, above the limit of {limit_mm:.2f} mm, if one fold draws it all together; only more than "
        f"{draw_mm:.3g} mm of flat ply in between would hold it apart by friction"
    )
