"""Predicted against measured: a scan after debulking, held against the report made before it (paper, "Comparison")."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import pocket, surface
from debulk._core import InputError
from debulk.grid import Grid
from debulk.report import PointsXY, Record, Report, check_report_path
from debulk.verdict import Verdict

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["Agreement", "Comparison", "PocketComparison", "agreement", "compare"]

_MOVED_MM = 0.2  # the laid ply farther than this from its consolidated thickness: scanner or mold have moved
_PEAK_CELLS = 5  # width of the median before a peak is read: short runs of flying pixels survive a smaller one
_PEAK_NOISE = 1.2  # the largest of many values after that median stands so many sigma of one value too high


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """How often the prediction was right, and how sure so few pockets make one of that.

    Attributes
    ----------
    hits, total
        Pockets predicted rightly, of those where both sides have decided. The others are not counted.
    low, high
        Exact 95 % confidence interval of the hit rate (Clopper and Pearson 1934).
    """

    hits: int
    total: int
    low: float
    high: float

    @property
    def rate(self) -> float:
        """Share of hits; NaN where nothing was counted."""
        return self.hits / self.total if self.total else math.nan

    def __str__(self) -> str:
        if not self.total:
            return "no pocket was decided on both sides"
        return (
            f"{self.hits} of {self.total} right, {100 * self.rate:.0f} % "
            f"(95 % interval {100 * self.low:.1f} to {100 * self.high:.1f} %, Clopper-Pearson)"
        )


def agreement(hits: int, total: int, confidence: float = 0.95) -> Agreement:
    """Hit rate with its exact confidence interval.

    Parameters
    ----------
    hits, total
        0 <= hits <= total.
    confidence
        Of the interval, between 0 and 1; it covers the true rate at least so often.

    Raises
    ------
    InputError
        For impossible counts.

    Examples
    --------
    >>> print(agreement(13, 14))
    13 of 14 right, 93 % (95 % interval 66.1 to 99.8 %, Clopper-Pearson)
    """
    if not 0 <= hits <= total:
        raise InputError(f"hits: expected 0 to {total}, but got {hits}")
    if not 0 < confidence < 1:
        raise InputError(f"confidence: expected a share between 0 and 1, but got {confidence!r}")
    tail = 0.5 * (1 - confidence)
    # Lowest rate at which so many hits or more, highest at which so many or fewer, are not rarer than the tail.
    low = 0.0 if hits == 0 else _rate(lambda p: _at_least(hits, total, p) < tail)
    high = 1.0 if hits == total else _rate(lambda p: 1 - _at_least(hits + 1, total, p) > tail)
    return Agreement(hits=hits, total=total, low=low, high=high)


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
class Comparison(Record):
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

    Examples
    --------
    >>> import debulk
    >>> layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
    >>> pose = layup.mold_from_scanner
    >>> inspector = debulk.Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=pose)
    >>> comparison = inspector.compare(inspector.inspect(layup.scan), layup.debulked().scan)
    >>> len(comparison.pockets), comparison.pockets[0].measured
    (14, <Verdict.CEASE: 'cease'>)
    """

    pockets: tuple[PocketComparison, ...]
    max_rms_mm: float
    max_peak_mm: float
    laid_height_mm: float | None = None
    height_map: Grid | None = None
    ply_outline_mm: PointsXY | None = None
    warnings: tuple[str, ...] = ()
    version: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.version:
            from debulk import __version__

            object.__setattr__(self, "version", __version__)

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

    def outcomes(self) -> dict[tuple[Verdict, Verdict], int]:
        """Count the pockets by (predicted, measured)."""
        counts: dict[tuple[Verdict, Verdict], int] = {}
        for p in self.pockets:
            counts[p.predicted, p.measured] = counts.get((p.predicted, p.measured), 0) + 1
        return counts

    def table(self) -> str:
        """Return a line for each pocket, the outcomes counted, and the hit rate with its interval as plain text."""
        from debulk.comparison_text import table

        return table(self)

    def __str__(self) -> str:
        return self.table()

    def __repr__(self) -> str:
        return f"Comparison({len(self.pockets)} pockets, {self.agreement})"

    def save(self, path: str | PathLike[str]) -> None:
        """Write the comparison.

        Parameters
        ----------
        path
            Ends in .json (all of it, :meth:`load` reads it back), .csv (a line for each pocket) or .html (one page that
            needs nothing else).

        Raises
        ------
        InputError
            If the ending is another, or the file cannot be written.
        """
        from debulk.files import replacing

        path = Path(path)
        check_report_path(path)
        match path.suffix.lower():
            case ".json":
                from debulk.report_json import dumps_record

                text = dumps_record(self, FORMAT)
            case ".csv":
                from debulk.comparison_text import csv_text

                text = csv_text(self)
            case _:
                from debulk.page_comparison import page

                text = page(self)
        with replacing(path) as temporary:
            temporary.write_text(text, encoding="utf-8", newline="\n")

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Comparison:
        """Read a comparison that :meth:`save` wrote as .json.

        Raises
        ------
        InputError
            If the file is not one, was cut off, or is of a newer schema.
        """
        from debulk.formats.source import open_source
        from debulk.report_json import loads_record

        path = Path(path)
        with open_source(path) as source:
            data = source.file.read()
        try:
            return loads_record(cls, data, FORMAT)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None


FORMAT = "debulk comparison"


def compare(
    report: Report,
    debulked_scan: ArrayLike,
    reference: ArrayLike,
    recipe: Recipe | None = None,
    mold_from_scanner: ArrayLike | None = None,
    mask: ArrayLike | None = None,
) -> Comparison:
    """Hold a report against a scan of the same ply after debulking.

    Parameters
    ----------
    report
        Of the inspection before; from memory or `Report.load`.
    debulked_scan, reference
        (H, W, 3) organised or (N, 3) clouds, mm, NaN = nothing seen: the ply after debulking, and what lies below it.
    recipe
        None: the report's own.
    mold_from_scanner
        (4, 4), x_mold = T x_scanner, of both clouds; None: they are in the mold's frame already. The outlines of the
        report are in the mold's frame: the mold must not have moved in it.
    mask
        (H, W) bool, True where the image of either cloud shows a clamp or a tool.

    Returns
    -------
    Comparison
        Measured RMS and peak inside the original outlines, outcomes, and the hit rate with its confidence interval.

    Raises
    ------
    InputError
        Names what was wrong, what was expected and what came.

    Examples
    --------
    >>> import debulk
    >>> layup = debulk.scenes.layup(seed=0, pixels=(640, 480))
    >>> pose = layup.mold_from_scanner
    >>> report = debulk.inspect(layup.scan, layup.reference, ply_outline=layup.ply_outline, mold_from_scanner=pose)
    >>> comparison = compare(report, layup.debulked().scan, layup.reference, mold_from_scanner=pose)
    >>> comparison.pockets[0].measured_rms_mm < 0.3
    True
    """
    from debulk.inspector import Inspector

    _checked(report)
    if recipe is None and report.recipe:
        from debulk.recipe import Recipe

        recipe = Recipe(**report.recipe)
    return Inspector(recipe, reference, mold_from_scanner=mold_from_scanner, mask=mask).compare(report, debulked_scan)


def compared(report: Report, heights: surface.HeightMap, recipe: Recipe) -> Comparison:
    """Compare a report with the measured heights of the debulked ply above the reference; NaN = not measured."""
    _checked(report)
    limits, material = recipe.verdict, recipe.material
    cells, threads = recipe.clean.median_cells, recipe.run.threads
    filtered = heights if cells == 1 else surface.median(heights, cells, threads=threads)
    peaks = surface.median(heights, _PEAK_CELLS, threads=threads)
    between = np.isfinite(filtered.values)
    if report.ply_outline_mm is not None:
        between &= inside_outline(report.ply_outline_mm, filtered)
    pockets = []
    for known in report.pockets:
        inside = inside_outline(known.outline_mm, filtered)
        foot = known.foot_outline_mm if known.foot_outline_mm is not None else known.outline_mm
        between &= ~(inside | inside_outline(foot, filtered))
        measured, reason, figures = _measure(inside, heights, filtered, peaks, recipe)
        pockets.append(
            PocketComparison(
                id=known.id,
                outline_mm=known.outline_mm,
                predicted=known.verdict,
                measured=measured,
                reason=reason,
                predicted_rms_mm=known.rms_mm,
                predicted_rms_range_mm=known.rms_range_mm,
                predicted_ridge_mm=known.ridge_height_mm,
                predicted_ridge_range_mm=known.ridge_range_mm,
                **figures,
            )
        )
    # Without an outline the map reaches past the ply, and the median tells nothing of it.
    laid = None
    if report.ply_outline_mm is not None and between.any():
        laid = float(np.median(filtered.values[between]))
    consolidated = material.thickness_mm / material.bulk_factor
    warnings = []
    if laid is not None and abs(laid - consolidated) > _MOVED_MM:
        warnings.append(
            f"between the pockets the ply stands {laid:.2f} mm above the reference, not its consolidated "
            f"{consolidated:.2f} mm: the mold or the scanner moved, or this is another ply"
        )
    return Comparison(
        pockets=tuple(pockets),
        max_rms_mm=limits.max_rms_mm,
        max_peak_mm=limits.max_ridge_mm,
        laid_height_mm=laid,
        height_map=Grid(filtered.values, filtered.origin_mm, filtered.spacing_mm),
        ply_outline_mm=report.ply_outline_mm,
        warnings=tuple(warnings),
    )


def _measure(
    inside: NDArray[np.bool_],
    heights: surface.HeightMap,
    filtered: surface.HeightMap,
    peaks: surface.HeightMap,
    recipe: Recipe,
) -> tuple[Verdict, str, dict[str, float]]:
    """Outcome of one pocket, why, and its figures."""
    limits = recipe.verdict
    seen = inside & np.isfinite(filtered.values)
    share = int(np.count_nonzero(seen)) / max(1, int(np.count_nonzero(inside)))
    if share < limits.min_pocket_coverage:
        reason = f"only {100 * share:.0f} % of it was seen, limit {100 * limits.min_pocket_coverage:.0f} %"
        return Verdict.INVALID, reason, {"measured_share": share}
    rms = float(np.sqrt(np.mean(filtered.values[seen].astype(np.float64) ** 2)))
    peak = float(peaks.values[seen].max())
    noise = _noise(inside, heights)
    figures = {"measured_rms_mm": rms, "measured_peak_mm": peak, "noise_mm": noise, "measured_share": share}
    if rms > limits.max_rms_mm:
        return Verdict.CREASE, f"RMS {rms:.3f} mm above the limit of {limits.max_rms_mm:.2f} mm", figures
    if peak > limits.max_ridge_mm + _PEAK_NOISE * noise:
        return Verdict.CREASE, f"peak {peak:.2f} mm above the limit of {limits.max_ridge_mm:.2f} mm", figures
    if peak > limits.max_ridge_mm:
        return Verdict.UNDECIDED, f"peak {peak:.2f} mm within the noise of its limit", figures
    return Verdict.CEASE, f"RMS {rms:.3f} mm and peak {peak:.2f} mm within their limits", figures


def _noise(inside: NDArray[np.bool_], heights: surface.HeightMap) -> float:
    rows, columns = (np.flatnonzero(inside.any(axis=k)) for k in (1, 0))
    window = (slice(rows[0], rows[-1] + 1), slice(columns[0], columns[-1] + 1))
    noise = pocket.height_noise(Grid(heights.values[window], heights.origin_mm, heights.spacing_mm))
    return noise if math.isfinite(noise) else 0.0


def inside_outline(outline_mm: NDArray[np.float64], grid: Grid) -> NDArray[np.bool_]:
    """Return (ny, nx) whether the grid's points lie inside the outline, row by row by even-odd crossings."""
    ny, nx = grid.values.shape[:2]
    inside = np.zeros((ny, nx), dtype=np.bool_)
    if len(outline_mm) < 3:
        return inside
    a = (outline_mm - grid.origin_mm) / grid.spacing_mm  # in cells
    b = np.roll(a, -1, axis=0)
    first, last = math.ceil(max(0.0, a[:, 1].min())), math.floor(min(ny - 1.0, a[:, 1].max()))
    columns = np.arange(nx)
    for row in range(first, last + 1):
        crossed = (a[:, 1] <= row) != (b[:, 1] <= row)
        start, end = a[crossed], b[crossed]
        at = start[:, 0] + (row - start[:, 1]) * (end[:, 0] - start[:, 0]) / (end[:, 1] - start[:, 1])
        inside[row] = np.searchsorted(np.sort(at), columns) % 2 == 1
    return inside


def _checked(report: Report) -> None:
    if not isinstance(report, Report):
        raise InputError(f"report: expected a debulk.Report, but got a {type(report).__name__}")


def _at_least(hits: int, total: int, rate: float) -> float:
    """Probability of so many hits or more."""
    return math.fsum(math.comb(total, k) * rate**k * (1 - rate) ** (total - k) for k in range(hits, total + 1))


def _rate(below: Callable[[float], bool]) -> float:
    """Where a condition that holds for low rates ends."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if below(middle) else (low, middle)
    return 0.5 * (low + high)
