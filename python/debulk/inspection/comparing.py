"""Measures the debulked ply where the pockets of a report lay, and compares it with the prediction.

The RMS is the paper's, inside the outline at the cut height. A fold may stand anywhere in what stood off the mold, so
the peak, and what cells may hide of it, are sought within the foot.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, pocket, surface
from debulk._core import InputError
from debulk.comparison import Comparison, PocketComparison
from debulk.grid import Grid
from debulk.inspection import standing_ridges
from debulk.inspection.clouds import fingerprint
from debulk.inspection.evidence.sample import Sample
from debulk.inspection.hidden_ridge import STANDS_OUT, Hidden, level, read, width
from debulk.inspection.place.placing import Placing
from debulk.inspection.ply.ply_on_mold import Setup
from debulk.inspection.reference.prepared import Prepared
from debulk.inspection.reference.resolution import is_coarser
from debulk.recipe import Recipe
from debulk.report import Report
from debulk.results import codec
from debulk.results.comparison import Standing
from debulk.results.report import FORMAT, PocketReport
from debulk.results.trace import ArrayTrace, Trace
from debulk.verdict import Verdict

_TOLD_APART_MM = 0.03  # what a ply loses by debulking; less is within how well the level is known
_ROUND = 2  # cells of a map round an outline
_PEAK_NOISE = 1.2  # after that median, the largest of many values is too high by so many sigma of a single value


def compared(
    report: Report,
    heights: surface.HeightMap,
    recipe: Recipe,
    trace: Trace | None = None,
    pitch_mm: float = 0.0,
    blur_mm2: float = 0.0,
    prepared: Prepared | None = None,
) -> Comparison:
    """Compare a report with the measured heights of the debulked ply above the reference; NaN = not measured.

    The points of the scan lie `pitch_mm` apart, if that is more than a cell, and `blur_mm2` is the variance by which
    gridding blurred them. Ridges beside the pockets are sought above the `prepared` reference.
    """
    limits, hidden = recipe.verdict, Hidden(recipe, max(heights.spacing_mm, pitch_mm), blur_mm2)
    cells, threads = recipe.clean.median_cells, recipe.run.threads
    filtered = heights if cells == 1 else surface.median(heights, cells, threads=threads)
    seen = read(heights, threads)
    beside = np.ones(filtered.values.shape, dtype=bool)  # on the ply, in no pocket's outline
    if report.ply_outline_mm is not None:
        beside &= pocket.inside_outline(report.ply_outline_mm, filtered)
    for known in report.pockets:
        beside &= ~pocket.inside_outline(known.outline_mm, filtered)
    between, marked = beside & np.isfinite(filtered.values), Grid(beside, filtered.origin_mm, filtered.spacing_mm)
    pockets = []
    for known in report.pockets:
        between &= ~pocket.inside_outline(known.foot_or_outline_mm, filtered)
        ridge = known.deciding_ridge
        both_mm = np.concatenate([known.outline_mm, known.foot_or_outline_mm])
        box_mm = np.stack([both_mm.min(axis=0), both_mm.max(axis=0)])
        round_mm = _ROUND * heights.spacing_mm
        near, smoothed, free = (grid.over(box_mm, round_mm) for grid in (seen, filtered, marked))
        measured, reason, figures = _measure(known, free.values, near, smoothed, recipe, hidden)
        pockets.append(
            PocketComparison(
                id=known.id,
                outline_mm=known.outline_mm,
                predicted=known.verdict,
                measured=measured,
                reason=reason,
                predicted_rms_mm=known.rms_mm,
                predicted_rms_range_mm=known.rms_range_mm,
                predicted_ridge_mm=None if ridge is None else ridge.height_mm,
                predicted_ridge_range_mm=None if ridge is None else ridge.range_mm,
                predicted_ridges_mm=tuple(line[:, :2] for ridge in known.ridges for line in ridge.lines_mm),
                predicted_place_mm=known.ridges[0].place_spread_mm if known.ridges else None,
                **figures,
            )
        )
    # Without an outline the map extends beyond the ply, and what stands there would not be the ply.
    laid, ridges = None, tuple[Standing, ...]()
    if report.ply_outline_mm is not None and between.any():
        laid = float(np.median(filtered.values[between]))
        if prepared is not None:
            peaks = replace(seen, values=seen.values[..., 3])
            ridges = standing_ridges.standing(peaks, between, report.ply_outline_mm, prepared, recipe)
    feet_mm = [known.foot_or_outline_mm for known in report.pockets]
    pockets = [standing_ridges.near(one, foot, ridges, recipe) for one, foot in zip(pockets, feet_mm, strict=True)]
    return Comparison(
        pockets=tuple(pockets),
        max_rms_mm=limits.max_rms_mm,
        max_peak_mm=limits.max_ridge_mm,
        laid_height_mm=laid,
        height_map=Grid(filtered.values, filtered.origin_mm, filtered.spacing_mm),
        ply_outline_mm=report.ply_outline_mm,
        standing=ridges,
        warnings=(
            *(() if laid is None else _unpressed(laid, recipe)),
            *(f"{standing_ridges.words(one)}, where no pocket was" for one in ridges),
        ),
        trace=trace,
        report_trace=report.trace,
        report_verdict=report.verdict,
        report_sha256=hashlib.sha256(codec.dumps(report, FORMAT).encode()).hexdigest(),
        recipe=recipe.model_dump(),
    )


def _unpressed(laid_mm: float, recipe: Recipe) -> tuple[str, ...]:
    before, after = recipe.material.thickness_mm, recipe.material.consolidated_mm
    if laid_mm < (before + after) / 2 or before - after < _TOLD_APART_MM:
        return ()
    return (
        f"between the pockets the ply stands {laid_mm:.2f} mm above the reference, as before debulking ({before:.2f} "
        f"mm; after it {after:.2f} mm): was it debulked? What stands may be the pockets themselves",
    )


def of_another_scan(
    report: Report, scan: ArrayLike, kind: fingerprint.Hash | None, stop: _core.Stop | None = None
) -> ArrayTrace:
    """Return the fingerprint of a debulked scan, of the kind that the report's scan has, or else of the given kind.

    An `InputError` is raised if it is the scan that the report was made from: every pocket would then seem to crease.
    """
    before = report.trace.scan if report.trace else None
    known = before.fingerprint if before else None
    wanted = (before and before.kind) or kind
    made = fingerprint.of_cloud(scan, stop, "debulked_scan", wanted) if wanted else ArrayTrace(shape=np.shape(scan))
    if known is not None and made.fingerprint == known:
        raise InputError(
            "debulked_scan: expected the scan after debulking, but this is the scan that the report was made from "
            f"({known[0]} {known[1][:16]}...)"
        )
    return made


def measured(
    points: NDArray[np.float32], sample: Sample, setup: Setup, stop: _core.Stop
) -> tuple[surface.HeightMap, float, float]:
    """Return a cleaned cloud's heights, how far its points lie apart, and the variance by which gridding blurs it.

    An image is averaged over a cell, a list by planes through all points within two pitches
    (`cpp/debulk/surface/gridding.hpp`). No hole is filled in: only what was seen counts as measured.
    """
    cell_mm, datum = setup.prepared.grid_spacing_mm, setup.prepared.datum
    apart_mm = sample.widest_mm if np.isfinite(sample.widest_mm) else cell_mm
    cell_mm = apart_mm if is_coarser(apart_mm, cell_mm) else cell_mm
    threads, pitch_mm = setup.recipe.run.threads, min(sample.pitch_mm, apart_mm)
    heights = surface.height_map(points, datum, cell_mm, hole_diameter_mm=0.0, threads=threads, stop=stop)
    return heights, apart_mm, cell_mm**2 / 12 if points.ndim == 3 else max(cell_mm, 2 * pitch_mm) ** 2 / 8


def pressed(report: Report, setup: Setup, prepared: Prepared) -> Setup:
    """Return the setup of a report's ply that debulking has pressed to its consolidated thickness."""
    thin = replace(prepared, thickness_mm=setup.recipe.material.consolidated_mm)
    return replace(setup, prepared=thin, ply=replace(setup.ply, outline=report.ply_outline_mm))


def check_place(report: Report, placing: Placing, sample: Sample, heights: Grid) -> None:
    """Refuse a scan that does not show the report's ply in its place, with the reason that an inspection would give."""
    feet_mm = [p.foot_or_outline_mm for p in report.pockets]
    placed = placing.gross(sample) or placing.judge_between(sample, feet_mm, heights, debulked=True)
    if placed.finding:
        raise InputError(f"debulked_scan: expected the ply of the report after debulking, but {placed.finding.reason}")


def _measure(
    known: PocketReport,
    free: NDArray[np.bool_],
    near: Grid,
    filtered: Grid,
    recipe: Recipe,
    hidden: Hidden,
) -> tuple[Verdict, str, dict[str, Any]]:
    """Return the outcome of one pocket, the reason, and its figures.

    `free` marks the ply outside all pockets' outlines: a fold of this pocket may stand there, too, within its foot.
    """
    limits = recipe.verdict
    inside = pocket.inside_outline(known.outline_mm, filtered)
    foot = inside | (free & pocket.inside_outline(known.foot_or_outline_mm, filtered))
    seen = inside & np.isfinite(filtered.values)
    share = int(np.count_nonzero(seen)) / max(1, int(np.count_nonzero(inside)))
    if share < limits.min_pocket_coverage:
        reason = f"only {100 * share:.0f} % of it was seen, limit {100 * limits.min_pocket_coverage:.0f} %"
        return Verdict.INVALID, reason, {"measured_share": share}
    rms = float(np.sqrt(np.mean(filtered.values[seen].astype(np.float64) ** 2)))
    smooth = near.values[foot & np.isfinite(near.values[..., 0]), 3]
    peak = float(smooth.max())
    noise = pocket.height_noise(replace(near, values=near.values[..., 0]))
    noise = noise if math.isfinite(noise) else 0.0
    low = peak - max(_PEAK_NOISE * noise, STANDS_OUT * level(smooth)[1])
    high = max(peak, hidden.highest_mm(near.values, foot, width(inside)))
    figures = {
        "measured_rms_mm": rms,
        "measured_peak_mm": peak,
        "measured_peak_range_mm": (low, high),
        "noise_mm": noise,
        "measured_share": share,
    }
    limit = limits.max_ridge_mm
    if rms > limits.max_rms_mm:
        return Verdict.CREASE, f"RMS {rms:.3f} mm exceeds the limit of {limits.max_rms_mm:.2f} mm", figures
    if low > limit:
        return Verdict.CREASE, f"peak {peak:.2f} mm exceeds the limit of {limit:.2f} mm", figures
    if peak > limit:
        return Verdict.UNDECIDED, f"peak {peak:.2f} mm within the noise of its limit", figures
    if high > limit:
        ridge = f"a ridge of up to {high:.2f} mm" if high < known.peak_mm else "a ridge as high as the pocket was"
        reason = (
            f"{ridge} may stand where {peak:.2f} mm was read, by points {hidden.cell_mm:.2g} mm "
            "apart, their noise and what was not seen: scan finer and without holes"
        )
        return Verdict.UNDECIDED, reason, figures
    return Verdict.CEASE, f"RMS {rms:.3f} mm and peak {peak:.2f} mm within their limits", figures
