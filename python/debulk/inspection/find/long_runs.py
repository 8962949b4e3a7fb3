"""The fibre lines that a report keeps: those on which a ridge near the limit or above it may stand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

import numpy as np

from debulk.fibre import FibreRuns
from debulk.inspection.find.found import FoundPocket
from debulk.inspection.ply import excess
from debulk.inspection.ply.fibre_runs import ScanRuns
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.recipe import options
from debulk.results.runs import ExcessRuns
from debulk.ridge import excess_of_ridge


def long_runs(scanned: ScanRuns | None, pockets: Sequence[FoundPocket], ply: PlyOnMold) -> ExcessRuns | None:
    """Return all runs of the lines on which the excess of one may make a ridge that does not surely count as none."""
    if scanned is None:
        return None
    runs = scanned.runs
    pocket = np.zeros(len(runs), dtype=np.int32)
    for one in reversed(pockets):
        pocket[one.crossing] = one.number
    recipe = ply.recipe
    counts_mm = excess_of_ridge(options.counts_from_mm(recipe), recipe.material.thickness_mm)
    long = excess.most_mm(runs) > counts_mm
    key = runs.family + 2 * runs.line.astype(np.int64)
    kept = np.isin(key, key[long])
    columns = {entry.name: getattr(runs, entry.name)[kept] for entry in fields(FibreRuns)}
    return ExcessRuns(**columns, pocket=pocket[kept], apart_mm=scanned.largest.spacing_mm)
