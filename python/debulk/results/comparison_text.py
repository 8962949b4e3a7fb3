"""The comparison as text: the console's table, and CSV."""

from __future__ import annotations

from typing import TYPE_CHECKING

from debulk.results.number import number
from debulk.results.report_csv import written
from debulk.results.report_text import columns, fold

if TYPE_CHECKING:
    from debulk.results.comparison import ComparisonData

_HEADINGS = ("#", "predicted", "RMS mm", "ridge mm", "measured", "RMS mm", "peak mm", "seen %", "", "reason")
_TEXT_COLUMNS = {1, 4, 8, 9}
_CSV = (
    "id", "predicted", "measured", "hit", "reason", "predicted_rms_mm", "measured_rms_mm", "predicted_ridge_mm",
    "measured_peak_mm", "may_stand_mm", "noise_mm", "measured_share",
)  # fmt: skip
_HIT = {True: "right", False: "WRONG", None: "–"}


def table(comparison: ComparisonData, width: int | None = None) -> str:
    """Return the outcome, a line for each pocket, the outcome counts, and the hit rate with its interval."""
    rows = [
        (
            str(p.id),
            p.predicted.name,
            number(p.predicted_rms_mm, 3),
            number(p.predicted_ridge_mm, 2),
            p.measured.name,
            number(p.measured_rms_mm, 3),
            number(p.measured_peak_mm, 2),
            number(100 * p.measured_share, 0),
            _HIT[p.hit],
            p.reason,
        )
        for p in comparison.pockets
    ]
    lines = [
        f"{predicted.name} predicted, {measured.name} measured: {count}"
        for (predicted, measured), count in sorted(comparison.outcomes().items())
    ]
    lines += [f"verdicts: {comparison.agreement}", f"by RMS alone: {comparison.rms_agreement}"]
    lines += [f"warning: {warning}" for warning in comparison.warnings]
    table = columns([_HEADINGS, *rows], _TEXT_COLUMNS, width, len(_HEADINGS) - 1) if rows else ["no pocket to compare"]
    return "\n".join([fold(comparison.headline, width), *table, *(fold(line, width) for line in lines)])


def csv_text(comparison: ComparisonData) -> str:
    """Return a line for each pocket, with units in the header."""
    return written(_CSV, ([getattr(pocket, name) for name in _CSV] for pocket in comparison.pockets))
