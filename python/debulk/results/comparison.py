"""The comparison of predictions with measurements as plain data: a report and a later scan (paper, "Comparison")."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from debulk.grid import Grid
from debulk.results.agreement import Agreement, agreement
from debulk.results.record import PointsXY, Record, Versioned
from debulk.results.trace import Trace
from debulk.verdict import Verdict
from debulk.words import in_mm

FORMAT = "debulk comparison"


@dataclass(frozen=True, eq=False, kw_only=True)
class PocketComparison(Record):
    """One pocket before and after debulking.

    Attributes
    ----------
    id, outline_mm
        Those of the report: the outline is the (M, 2) contour at the cut height before debulking, mold XY.
    predicted, measured
        The report's verdict, and the outcome that the second scan shows by the same limits.
    reason
        Why the measured outcome is as it is.
    predicted_rms_mm, measured_rms_mm
        RMS of the heights of the ply above the mold inside the original outline, including noise and consolidated
        thickness.
    predicted_rms_range_mm
        Lowest and highest value over the solver's starts.
    predicted_ridge_range_mm
        Range of the predicted ridge.
    predicted_ridges_mm, predicted_place_mm
        (M, 2) lines of the predicted ridges, mold XY, including mirrored ones; and how far they may be off on either
        side. Empty and None if the report predicts no ridge.
    predicted_ridge_mm, measured_peak_mm
        Ridge by which the report judged the pocket; and the largest height within the foot after a median over 5 by 5
        cells, which lowers a ridge of a few cells' width. A ridge in another pocket's outline is that pocket's.
    measured_peak_range_mm
        What surely stands there, the measured peak less its noise, and what may: the measured peak, or the highest
        ridge that the foot's cells hide by their width, their noise and what was not seen. The outcome is CEASE only
        if both ends keep the limit, and CREASE if both exceed it, or the RMS its own. None: it was not looked at
        (before 0.15.0), or nothing was seen.
    noise_mm
        Standard deviation of a single height there, before the median filter.
    measured_share
        Share of the outline's area that the second scan saw.
    """

    id: int
    outline_mm: PointsXY
    predicted: Verdict
    measured: Verdict
    reason: str
    predicted_rms_mm: float | None = None
    predicted_rms_range_mm: tuple[float, float] | None = None
    measured_rms_mm: float | None = None
    predicted_ridge_mm: float | None = None
    predicted_ridge_range_mm: tuple[float, float] | None = None
    predicted_ridges_mm: tuple[PointsXY, ...] = ()
    predicted_place_mm: float | None = None
    measured_peak_mm: float | None = None
    measured_peak_range_mm: tuple[float, float] | None = None
    noise_mm: float | None = None
    measured_share: float = 1.0

    @property
    def may_stand_mm(self) -> float | None:
        """The upper end of the measured peak's range; the peak itself where that was not looked at."""
        return self.measured_peak_range_mm[1] if self.measured_peak_range_mm else self.measured_peak_mm

    @property
    def hit(self) -> bool | None:
        """Whether the prediction was right; None if prediction or measurement has not decided."""
        if not {self.predicted, self.measured} <= _DECIDED:
            return None
        return self.predicted is self.measured


@dataclass(frozen=True, kw_only=True)
class Standing(Record):
    """A ridge that stands on the debulked ply where the report has no pocket."""

    place_mm: tuple[float, float]
    """Mold XY of its highest place."""
    height_mm: float
    """Height above the surface below, after a median over 5 by 5 cells."""
    length_mm: float
    """How far it reaches above the limit."""


_DECIDED = {Verdict.CEASE, Verdict.CREASE}


@dataclass(frozen=True, eq=False, kw_only=True)
class ComparisonData(Versioned):
    """A report compared with a scan after debulking."""

    pockets: tuple[PocketComparison, ...]
    """The compared pockets, in the report's order."""
    max_rms_mm: float
    max_peak_mm: float
    """`max_rms_mm`, `max_peak_mm`: limits of the RMS and of the ridge height (or the measured peak), for prediction and
    measurement alike."""
    laid_height_mm: float | None = None
    """Median height of the debulked ply above the reference between the pockets, which should be the consolidated
    thickness. None: unknown."""
    height_map: Grid | None = None
    """Height of the debulked ply above the reference, mm, on a grid in mold XY, after the median filter. None: not
    kept."""
    ply_outline_mm: PointsXY | None = None
    """(M, 2) outline of the ply, mold XY, as in the report. None: unknown."""
    trace: Trace | None = None
    """Time, fingerprints and everything else that entered the comparison. None: it was not recorded."""
    report_trace: Trace | None = None
    report_verdict: Verdict | None = None
    report_sha256: str | None = None
    """`report_trace`, `report_verdict`, `report_sha256`: identity of the report: its own trace and verdict, and the
    SHA-256 of its JSON as `debulk.Report.save` writes it. None: not known."""
    recipe: dict[str, Any] = field(default_factory=dict)
    """Settings of the comparison, section by section."""
    source: dict[str, str] = field(default_factory=dict)
    """Names of files, and the like."""
    standing: tuple[Standing, ...] = ()
    """Ridges above the limit beside all pockets, highest first. Before 0.17.0 and without an outline of the ply they
    are not looked for."""
    warnings: tuple[str, ...] = ()
    """What the reader should know before trusting the rest."""
    version: str = ""
    """Version of debulk that compared."""

    @property
    def agreement(self) -> Agreement:
        """Agreement of the verdicts, by RMS and ridge height."""
        hits = [p.hit for p in self.pockets if p.hit is not None]
        return agreement(sum(hits), len(hits))

    @property
    def rms_agreement(self) -> Agreement:
        """Agreement by the RMS alone, as the paper counts it: on which side of the limit it is, whatever decided."""
        pairs = [(p.predicted_rms_mm, p.measured_rms_mm) for p in self.pockets if p.measured is not Verdict.INVALID]
        sides = [(a <= self.max_rms_mm, b <= self.max_rms_mm) for a, b in pairs if a is not None and b is not None]
        return agreement(sum(a == b for a, b in sides), len(sides))

    @property
    def wrong(self) -> tuple[PocketComparison, ...]:
        """The pockets with CEASE predicted and CREASE measured, or the reverse, in the report's order."""
        return tuple(p for p in self.pockets if p.hit is False)

    @property
    def false_cease(self) -> tuple[PocketComparison, ...]:
        """The pockets that crease although CEASE was predicted: the errors that must not occur."""
        return tuple(p for p in self.wrong if p.predicted is Verdict.CEASE)

    @property
    def not_passed(self) -> tuple[str, ...]:
        """What did not pass, in words: the pockets that are not measured to have ceased, and ridges beside them."""
        pockets = [f"pocket {one.id} {one.measured.name}" for one in self.pockets if one.measured is not Verdict.CEASE]
        return *pockets, *(f"a ridge of {one.height_mm:.2f} mm at {in_mm(one.place_mm)}" for one in self.standing)

    @property
    def headline(self) -> str:
        """The outcome in one line; a missed crease leads it."""
        rest = tuple(p for p in self.wrong if p.predicted is not Verdict.CEASE)
        told = [
            f"{len(group)} FALSE {name}: pocket{'s' * (len(group) > 1)} {', '.join(str(p.id) for p in group)}"
            for name, group in (("CEASE", self.false_cease), ("CREASE", rest))
            if group
        ]
        if self.standing:
            told.append(f"{len(self.standing)} ridge{'s' * (len(self.standing) > 1)} beside the pockets")
        if told or not self.agreement.total:
            return "; ".join(told) or str(self.agreement)
        return "no outcome was wrong"

    def outcomes(self) -> dict[tuple[Verdict, Verdict], int]:
        """Count the pockets by (predicted, measured)."""
        counts: dict[tuple[Verdict, Verdict], int] = {}
        for p in self.pockets:
            counts[p.predicted, p.measured] = counts.get((p.predicted, p.measured), 0) + 1
        return counts
