"""What the service keeps and tells of an inspection: the verdict, and where to do what."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk import rings
from debulk.inspection.inspector import Inspector
from debulk.report import Report
from debulk.results.advice import Deed, advice
from debulk.results.approval import recipe_hash
from debulk.results.looks import VERDICT_SIGNS
from debulk.results.trace import now_utc
from debulk.verdict import Verdict

_Ring = tuple[tuple[float, float], ...]
_MOST_CORNERS = 120  # of an outline that is only a picture


@dataclass(frozen=True, eq=False)
class Job:
    """A scan that was accepted."""

    id: str
    """Differs from that of every other job, also of other runs of the service."""
    inspector: Inspector
    inspector_name: str
    """`inspector`, `inspector_name`: the inspector of the moment in which the scan was accepted."""
    scan: Path
    sent: bool
    """`scan`, `sent`: the file; whether it was sent, and so belongs to the service."""
    angles: Path | None
    """File of the fibre directions that a sensor measured on this ply; None: there is none."""
    deadline_s: float | None
    """Seconds from `began_s`; None: no deadline."""
    part: str
    ply: str
    """`part`, `ply`: kept in the report."""
    began_s: float = field(default_factory=time.monotonic)
    received_utc: str = field(default_factory=now_utc)
    """`began_s`, `received_utc`: when it was accepted, by a clock that never jumps, and as the time of day."""

    @property
    def seconds(self) -> float:
        """Seconds since then."""
        return time.monotonic() - self.began_s


@dataclass(frozen=True)
class Place:
    """An entry of the checklist: what to do, at what, where in the mold frame, by how much, and in which directions.

    `pocket` and `verdict` are the pocket's; None and empty if it is not about one.
    """

    do: str
    at: str
    place_mm: tuple[float, float] | None
    amount: str
    ways_deg: tuple[float, ...]
    pocket: int | None
    verdict: str

    @classmethod
    def of(cls, deed: Deed) -> Place:
        """Return the same in plain words and numbers."""
        verdict = deed.verdict.name if deed.verdict else ""
        return cls(deed.do, deed.at, deed.place_mm, deed.amount, deed.ways_deg, deed.pocket, verdict)

    def __str__(self) -> str:
        return str(Deed(self.do, self.at, self.place_mm, self.amount))


@dataclass(frozen=True)
class Result:
    """The outcome of a job; `refused` if its scan could not be read or inspected, which is INVALID.

    `record` is its number in the history; `recipe` the hash of the recipe; `seconds` run from accepting to this.
    """

    id: str
    verdict: str
    sign: str
    reason: str
    part: str
    ply: str
    inspector: str
    scan: str
    received_utc: str
    finished_utc: str
    seconds: float
    refused: bool = False
    do: tuple[Place, ...] = ()
    outline_mm: _Ring = ()
    cut_outs_mm: tuple[_Ring, ...] = ()
    warnings: tuple[str, ...] = ()
    record: int | None = None
    recipe: str = ""
    passed: bool = False


def result_of(job: Job, report: Report, record: int | None) -> Result:
    """Return what is kept of a report."""
    outside, *cut_outs = _rings(report.ply_outline_mm) or ((),)
    return _of_job(
        job,
        report.verdict,
        report.reason,
        do=tuple(map(Place.of, advice(report))),
        outline_mm=outside,
        cut_outs_mm=tuple(cut_outs),
        warnings=report.warnings,
        record=record,
        recipe=recipe_hash(report.recipe),
        passed=report.passed,
    )


def refused(job: Job, reason: str) -> Result:
    """Return the outcome of a scan that could not be inspected: never better than INVALID."""
    return _of_job(
        job,
        Verdict.INVALID,
        reason,
        refused=True,
        do=(Place("scan again, or look at the service's log", "", None, "", (), None, ""),),
        recipe=recipe_hash(job.inspector.recipe.model_dump()),
    )


def _of_job(job: Job, verdict: Verdict, reason: str, **more: Any) -> Result:
    return Result(
        job.id,
        verdict.name,
        VERDICT_SIGNS[verdict],
        reason,
        job.part,
        job.ply,
        job.inspector_name,
        job.scan.name,
        job.received_utc,
        now_utc(),
        job.seconds,
        **more,
    )


def _rings(outline_mm: NDArray[np.float64] | None) -> tuple[_Ring, ...]:
    """Return the rings of an outline for a small picture, with as many corners as it can show."""
    split = [] if outline_mm is None else rings.split(outline_mm)
    return tuple(tuple((x, y) for x, y in ring[:: math.ceil(len(ring) / _MOST_CORNERS)].tolist()) for ring in split)
