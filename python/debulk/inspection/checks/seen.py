"""What an inspection has seen when its checks are asked: the results of all instruments, each made once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np

from debulk.fibre import FibreRuns
from debulk.forking import kept
from debulk.inspection.evaluate.evaluated import Evaluation
from debulk.inspection.find.found import Found, FoundPocket
from debulk.inspection.place.placing import Placed
from debulk.inspection.ply import excess
from debulk.inspection.ply.humps import Hump
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.inspection.rawscan.filled import Filled
from debulk.inspection.rawscan.lost_places import Lost
from debulk.inspection.rawscan.narrow import Standing
from debulk.recipe import options
from debulk.results.approval import Approval
from debulk.results.chain import ChainReport
from debulk.results.finding import Finding
from debulk.results.report import LeftOut, PocketReport
from debulk.results.runs import ExcessRuns
from debulk.risk import Risk, risk


@dataclass(frozen=True)
class Judged:
    """The pockets of a scan, and the places judged as pockets: all sequences are in the same order."""

    pockets: Sequence[FoundPocket]
    evaluations: Sequence[Evaluation]
    """`pockets`, `evaluations`: each pocket, and what became of it: first the pockets found, then the places judged
    as pockets."""
    reports: tuple[PocketReport, ...]
    """The reports of the evaluations, in which pockets that exceed the limit only together name each other."""
    late: bool = False
    """Whether a deadline cut off the search for places that no pocket covers."""


class Recognised(NamedTuple):
    """What a scan's comparison with its chain adds to the report: its figures, and what follows from them."""

    report: ChainReport
    findings: tuple[Finding, ...] = ()
    left_out: tuple[LeftOut, ...] = ()


@dataclass(frozen=True)
class Seen:
    """What the checks look at, once all pockets are judged."""

    ply: PlyOnMold
    """The ply and the recipe."""
    placed: Placed
    """Whether scan and reference belong together."""
    found: Found
    """The pockets, how much of the ply is known, and the runs of the fibres."""
    plateaus: Sequence[Finding]
    """Findings on flat places with a sharp edge."""
    judged: Judged
    """The pockets with their verdicts."""
    standing: Standing
    lost: tuple[Lost, ...]
    """`standing`, `lost`: what stands narrowly in the raw scan, and those of these places that the height map has lost
    and that could crease."""
    filled: Filled
    """What was filled in, clipped or smoothed in the raw scan."""
    recognised: Recognised | None = None
    """How the scan compares with the chain that was qualified; None: no chain was given."""
    humps: tuple[Hump, ...] = ()
    """Humps of the reference that look like pockets of the ply before."""
    approved: tuple[Approval, ...] | None = None
    """The recipes that the cell's owner approved; None: no approval is asked for."""

    @kept
    def runs(self) -> ExcessRuns | None:
        """All runs of the fibre lines on which a ridge near the limit or above it may stand; a report keeps them."""
        scanned, recipe = self.found.runs, self.ply.recipe
        if scanned is None:
            return None
        runs = scanned.runs
        pocket = np.zeros(len(runs), dtype=np.int32)
        for one in reversed(self.judged.pockets):
            pocket[one.crossing] = one.number
        counts_mm = excess.of_ridge(options.counts_from_mm(recipe), recipe)
        key = runs.family + 2 * runs.line.astype(np.int64)
        long = np.isin(key, key[excess.most_mm(runs) > counts_mm])
        columns = {entry.name: getattr(runs, entry.name)[long] for entry in fields(FibreRuns)}
        return ExcessRuns(**columns, pocket=pocket[long], apart_mm=scanned.largest.spacing_mm)

    @kept
    def risks(self) -> Risk:
        """The probability that a ridge exceeds the limit, of each pocket and of the layup."""
        return risk(self.judged.reports, self.runs, self.ply.recipe)
