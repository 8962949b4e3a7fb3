"""The comparison of predictions with measurements as plain data: a report and a later scan (paper, "Comparison")."""

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
        Ridge by which the report judged the pocket; and the largest height inside the outline after a median over 5
        by 5 cells, which lowers a ridge less than about four cells wide.
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
    noise_mm: float | None = None
    measured_share: float = 1.0

    @property
    def hit(self) -> bool | None:
        """Whether the prediction was right; None if prediction or measurement has not decided."""
        if not {self.predicted, self.measured} <= _DECIDED:
            return None
        return self.predicted is self.measured


_DECIDED = {Verdict.CEASE, Verdict.CREASE}


@dataclass(frozen=True, eq=False, kw_only=True)
class ComparisonData(Versioned):
    """A report compared with a scan after debulking.

    Attributes
    ----------
    pockets
        The compared pockets, in the report's order.
    max_rms_mm, max_peak_mm
        Limits of the RMS and of the ridge height (or the measured peak), for prediction and measurement alike.
    laid_height_mm
        Median height of the debulked ply above the reference between the pockets, which should be the consolidated
        thickness. None: unknown.
    height_map
        Height of the debulked ply above the reference, mm, on a grid in mold XY, after the median filter. None: not
        kept.
    ply_outline_mm
        (M, 2) outline of the ply, mold XY, as in the report. None: unknown.
    warnings
        What the reader should know before trusting the rest.
    version
        Version of debulk that compared.
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

    def outcomes(self) -> dict[tuple[Verdict, Verdict], int]:
        """Count the pockets by (predicted, measured)."""
        counts: dict[tuple[Verdict, Verdict], int] = {}
        for p in self.pockets:
            counts[p.predicted, p.measured] = counts.get((p.predicted, p.measured), 0) + 1
        return counts
