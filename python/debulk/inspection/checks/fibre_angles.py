"""Whether the fibres run as they were meant to, and whether it is known how they run wherever that decides."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from debulk.arrays import Bools
from debulk.fibre import FibreRuns
from debulk.grid import Grid
from debulk.inspection.evidence.pieces import grown, pieces_of
from debulk.inspection.ply import excess
from debulk.inspection.ply.fibre_runs import ScanRuns
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.results.finding import Finding
from debulk.verdict import Verdict
from debulk.words import Place, in_cm2, in_mm, xy_of

_TURN_BACK = "lay the ply anew, or give the nominal directions of this ply"
_COVER = "give angles that cover the whole ply, or nominal ones (nominal_angles_deg) that fill the gaps"


def findings(runs: ScanRuns | None, ply: PlyOnMold) -> Iterator[Finding]:
    """INVALID for a ply that was laid turned, and for a fibre that may be too long where it is not known how it runs.

    Gaps in which no fibre can be too long are only mentioned.
    """
    limits, off = ply.recipe.verdict, ply.turned
    if off is not None and off.median_deg > limits.max_turn_deg:
        way = "counter-clockwise" if off.signed_deg > 0 else "clockwise"
        reason = (
            f"the fibres run {off.median_deg:.1f} degrees {way} from nominal, the median of {off.places} places, above "
            f"the limit of {limits.max_turn_deg:g} degrees: {_TURN_BACK}"
        )
        measured = (off.median_deg, limits.max_turn_deg, "degrees")
        yield Finding("fibre_angles", Verdict.INVALID, reason, *measured, remedy=_TURN_BACK)
    gaps = ply.gaps
    if gaps is None:
        return
    if runs is not None:
        yield from _too_long(runs.runs, gaps, ply)
    if ply.outline is None:  # where nobody knows what is ply
        return
    if unknown := marked_area(gaps.values, gaps, ply.recipe.segmentation.area_tol_mm2):
        area_mm2, place = unknown
        reason = (
            f"the fibre directions are not known on {in_cm2(area_mm2)} of the ply, where the sensor saw none or the "
            f"drape does not reach; the largest such part lies round {in_mm(place)}: {_COVER}"
        )
        yield Finding("fibre_angles", None, reason, area_mm2, None, "mm2", place, remedy=_COVER)


def _too_long(runs: FibreRuns, gaps: Grid, ply: PlyOnMold) -> Iterator[Finding]:
    """Yield INVALID for the longest fibre over a gap, if it may make a ridge above the limit."""
    longest_mm = 2 * excess.most_mm(runs)  # two lines at right angles show half of an excess, however fibres run
    near = replace(gaps, values=grown(gaps.values))
    for n, ridge_mm in excess.above_limit(longest_mm, ply.recipe):
        if not _over(runs, n, near):
            continue
        reason = (
            f"it is not known how the fibres run near {in_mm(runs.top_mm[n])}, where one may be up to "
            f"{longest_mm[n]:.2f} mm longer than the mold, a ridge of {ridge_mm:.2f} mm: {_COVER}"
        )
        top = xy_of(runs.top_mm[n])
        limit_mm = ply.recipe.verdict.max_ridge_mm
        yield Finding("fibre_angles", Verdict.INVALID, reason, ridge_mm, limit_mm, "mm", top, remedy=_COVER)
        return


def _over(runs: FibreRuns, n: int, flags: Grid) -> bool:
    """Return whether a run comes over a flag."""
    corners = np.stack([runs.from_mm[n], runs.top_mm[n], runs.to_mm[n]])
    count = 2 + int(np.linalg.norm(np.diff(corners, axis=0), axis=1).max() / flags.spacing_mm)
    share = np.linspace(0, 1, count)[:, None, None]
    line = (1 - share) * corners[:-1] + share * corners[1:]
    return bool(flags.at(line, beyond=0.0).any())


def locked(ply: PlyOnMold) -> list[Finding]:
    """Mention where the ply shears beyond its locking angle."""
    shear, limit = ply.shear, ply.recipe.material.locking_deg
    if shear is None:
        return []
    beyond = marked_area(np.nan_to_num(shear.values) > limit, shear, ply.recipe.segmentation.area_tol_mm2)
    if beyond is None:
        return []
    (area_mm2, place), most = beyond, float(np.nanmax(shear.values))
    reason = (
        f"the ply shears by up to {most:.0f} degrees, beyond its locking angle of {limit:g} degrees on "
        f"{in_cm2(area_mm2)}; the largest such part lies round {in_mm(place)}: it buckles there, and its "
        "fibres may run otherwise than a drape says"
    )
    return [Finding("locked", None, reason, most, limit, "degrees", place)]


def marked_area(marked: Bools, grid: Grid, least_mm2: float) -> tuple[float, Place] | None:
    """Return the area of the marked points of a grid and a place in their largest part; None: no part is so large."""
    cell_mm2 = float(grid.spacing_mm) ** 2
    parts = pieces_of(marked, 8)
    numbers = parts.of_size(least_mm2 / cell_mm2)
    if not numbers:
        return None
    rows, columns = np.nonzero(parts.labels == max(numbers, key=lambda number: parts.sizes[number]))
    middle = int(np.argmin((rows - rows.mean()) ** 2 + (columns - columns.mean()) ** 2))
    place = grid.origin_mm + grid.spacing_mm * np.array([columns[middle], rows[middle]])
    return float(parts.sizes[numbers].sum()) * cell_mm2, xy_of(place)
