"""What an inspection has seen when its checks are asked: the results of all instruments, each made once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from debulk.inspection.bumps.tolerances import Bump
from debulk.inspection.evaluate.evaluated import Evaluation
from debulk.inspection.find.found import Found, FoundPocket
from debulk.inspection.place.placing import Placed
from debulk.inspection.ply.humps import Hump
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.inspection.rawscan.filled import Filled
from debulk.inspection.rawscan.wrinkles import Standing
from debulk.results.approval import Approval
from debulk.results.chain import ChainReport
from debulk.results.finding import Finding
from debulk.results.report import LeftOut, PocketReport

__all__ = ["Judged", "Recognised", "Seen"]


@dataclass(frozen=True)
class Judged:
    """The pockets of a scan, and the bumps judged as pockets: all sequences are in the same order.

    Attributes
    ----------
    pockets, evaluations
        Each pocket, and what became of it: first the pockets found, then the bumps judged as pockets.
    reports
        The reports of the evaluations, in which pockets that exceed the limit only together name each other.
    bumps
        All bumps below the tolerances.
    """

    pockets: Sequence[FoundPocket]
    evaluations: Sequence[Evaluation]
    reports: tuple[PocketReport, ...]
    bumps: Sequence[Bump]


class Recognised(NamedTuple):
    """What a scan's comparison with its chain adds to the report: its figures, and what follows from them."""

    report: ChainReport
    findings: tuple[Finding, ...] = ()
    left_out: tuple[LeftOut, ...] = ()


@dataclass(frozen=True)
class Seen:
    """What the checks look at, once all pockets are judged.

    Attributes
    ----------
    ply
        The ply and the recipe.
    placed
        Whether scan and reference belong together.
    found
        The pockets, how much of the ply is known, and the runs of the fibres.
    plateaus
        Findings on flat places with a sharp edge.
    judged
        The pockets with their verdicts.
    riders
        Findings on narrow bumps on top of pockets and bumps, which are looked for only where all pockets cease.
    standing, filled
        What the raw scan shows.
    recognised
        How the scan compares with the chain that was qualified; None: no chain was given.
    humps
        Humps of the reference that look like pockets of the ply before.
    approved
        The recipes that the cell's owner approved; None: no approval is asked for.
    """

    ply: PlyOnMold
    placed: Placed
    found: Found
    plateaus: Sequence[Finding]
    judged: Judged
    riders: Sequence[Finding]
    standing: Standing
    filled: Filled
    recognised: Recognised | None = None
    humps: tuple[Hump, ...] = ()
    approved: tuple[Approval, ...] | None = None
