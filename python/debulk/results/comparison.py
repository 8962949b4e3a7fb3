"""Predicted against measured as plain data: a report held against a scan after debulking (paper, "Comparison")."""

from __future__ import annotations

from dataclasses import dataclass

from debulk.grid import Grid
from debulk.results.agreement import Agreement, agreement
from debulk.results.record import PointsXY, Record, Versioned
from debulk.verdict import Verdict

__all__ = ["ComparisonData", "PocketComparison"]

FORMAT = "debulk comparison"


@dataclass(frozen=True, eq=False, kw_only=True)
class PocketComparison(Record):
    """One pocket before and after.

    Attributes
    ----------
    id, outline_mm
        The report's: (M, 2) contour at the cut height before debulking, mold XY.
    predicted, measured
        The report's verdict, and what the second scan shows by the same limits.
    reason
        Why the measured outcome is what it is.
    predicted_rms_mm, measured_rms_mm
        Of the heights of the ply above the mold inside the original outline, noise and consolidated thickness included.
    predicted_rms_range_mm
        Lowest and highest over the solver's starts.
    predicted_ridge_range_mm
        Lowest and highest over the solver's starts.
    predicted_ridges_mm, predicted_place_mm
        (M, 2) lines of the predicted ridges, mold XY, mirrored ones too; how far off they may be on either side. Empty
        and None where the report predicts none.
    predicted_ridge_mm, measured_peak_mm
        Highest ridge of the prediction; largest height inside the outline after a median over 5 by 5 cells, which
        lowers a ridge less than about four cells wide.
    noise_mm
        Sigma of one height there, before the median filter.
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
    noise_mm: float | None = None
    measured_share: float = 1.0

    @property
    def hit(self) -> bool | None:
        """Whether the prediction was right; None where one of the two sides has not decided."""
        if not {self.predicted, self.measured} <= _DECIDED:
            return None
        return self.predicted is self.measured


_DECIDED = {Verdict.CEASE, Verdict.CREASE}


@dataclass(frozen=True, eq=False, kw_only=True)
class ComparisonData(Versioned):
    """A report held against a scan after debulking.

    Attributes
    ----------
    pockets
        In the report's order.
    max_rms_mm, max_peak_mm
        The limits, for prediction and measurement alike.
    laid_height_mm
        Median height of the ply between the pockets, which should be the consolidated thickness; None: unknown.
    height_map
        Height of the debulked ply above the reference, mm.
    ply_outline_mm
        As in the report.
    warnings
        What the reader should know before trusting the rest.
    version
        Of debulk.
    """

    pockets: tuple[PocketComparison, ...]
    max_rms_mm: float
    max_peak_mm: float
    laid_height_mm: float | None = None
    height_map: Grid | None = None
    ply_outline_mm: PointsXY | None = None
    warnings: tuple[str, ...] = ()
    version: str = ""

    @property
    def agreement(self) -> Agreement:
        """Of the verdicts, by RMS and ridge height."""
        hits = [p.hit for p in self.pockets if p.hit is not None]
        return agreement(sum(hits), len(hits))

    @property
    def rms_agreement(self) -> Agreement:
        """By the RMS alone, as the paper counts: both sides of the limit, whatever else decided the verdict."""
        pairs = [(p.predicted_rms_mm, p.measured_rms_mm) for p in self.pockets if p.measured is not Verdict.INVALID]
        sides = [(a <= self.max_rms_mm, b <= self.max_rms_mm) for a, b in pairs if a is not None and b is not None]
        return agreement(sum(a == b for a, b in sides), len(sides))

    @property
    def wrong(self) -> tuple[PocketComparison, ...]:
        """The pockets of which CEASE was predicted and CREASE measured, or the reverse, in the report's order."""
        return tuple(p for p in self.pockets if p.hit is False)

    def outcomes(self) -> dict[tuple[Verdict, Verdict], int]:
        """Count the pockets by (predicted, measured)."""
        counts: dict[tuple[Verdict, Verdict], int] = {}
        for p in self.pockets:
            counts[p.predicted, p.measured] = counts.get((p.predicted, p.measured), 0) + 1
        return counts
