"""Names the mistake behind a level that is not the ply's, and what to do."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from debulk.inspection.level import Deviation
from debulk.results.level import Level

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["level_reason", "same_reason", "swapped_reason"]

_EXPLAINED = 0.25  # a fit that leaves this much of what was wrong is what is wrong


def same_reason(share: float) -> str:
    """Say that scan and reference are one cloud."""
    return (
        f"scan and reference are the same: {100 * share:.0f} % of their points agree bit for bit; "
        "give the scan of the draped ply, and the reference from before it was draped"
    )


def swapped_reason(hanging_mm2: float, cut_height_mm: float) -> str:
    """Say that what should stand up hangs down."""
    return (
        f"scan and reference look swapped: {hanging_mm2 / 100:.0f} cm² of the scan hang more than {cut_height_mm:g} mm "
        "below the reference; give them the other way round, or check the pose: z is to point up, away from the mold"
    )


def level_reason(level: Level, found: Deviation, standing_mm2: float, recipe: Recipe) -> str:
    """Say why a level cannot be the ply's; empty if it can.

    Parameters
    ----------
    level, found
        Of the ply between its pockets.
    standing_mm2
        Area of the scan above the cut height.
    recipe
        The sections level, material and segmentation.
    """
    wanted = recipe.level
    tol, share = wanted.tol_mm, wanted.largest_share
    median = level.laid_mm - level.thickness_mm
    if level.uncertainty_mm > 0.5 * tol:
        return (
            f"the level of the ply cannot be told: its median height between the pockets is uncertain by "
            f"{level.uncertainty_mm:.2f} mm, and its tolerance is {tol:g} mm; scan again, with less noise"
        )
    if abs(median) <= tol and level.low_share + level.high_share <= share:
        return ""
    laid = (
        f"between the pockets the ply stands {level.laid_mm:.2f} mm above the reference, its thickness is "
        f"{level.thickness_mm:g} mm"
    )
    bare = abs(level.laid_mm) <= tol and level.laid_mm < 0.5 * level.thickness_mm
    even = sum(found.shares(tol, 0)) <= share
    if bare and even and standing_mm2 < recipe.segmentation.area_tol_mm2:
        return (
            f"no ply is seen: the scan stands {level.laid_mm:.2f} mm above the reference everywhere, the ply's thickness "
            f"is {level.thickness_mm:g} mm; the mold is empty, or the reference was taken with this ply on it"
        )
    wrong = level.low_share + level.high_share
    enough = max(share, _EXPLAINED * wrong)
    order = next((k for k in range(3) if sum(found.shares(tol, k)) <= enough), 3)
    where = "high" if level.offset_mm > 0 else "low"
    if order == 0:
        return (
            f"the scan lies {abs(median):.2f} mm too {where} everywhere ({laid}): check the pose, the thickness in the "
            "recipe, and whether the reference is of this layup"
        )
    if order == 1:
        ends = float(np.ptp(found.fits_mm[1]))
        beside = f" and {abs(level.offset_mm):.2f} mm too {where}" if abs(level.offset_mm) > tol else ""
        return (
            f"the scan is tilted by {level.tilt_deg:.2g} degrees about an axis at {level.tilt_axis_deg:.0f} degrees from "
            f"x, {ends:.2f} mm from end to end{beside} ({laid}): check whether scanner or mold moved since the reference "
            "was taken"
        )
    if order == 2:
        return (
            f"the scan is bent by {level.bow_mm:.2f} mm over the ply ({laid}): check the scanner's calibration and "
            "temperature, how the mold is held, and whether the reference is of this mold"
        )
    worst = int(np.argmax(np.abs(found.residual_mm)))
    x, y = found.xy_mm[worst]
    return (
        f"{100 * level.low_share:.0f} % of the ply between the pockets lies more than {tol:g} mm too low and "
        f"{100 * level.high_share:.0f} % too high, worst by {found.residual_mm[worst]:+.2f} mm at ({x:.0f}, {y:.0f}) mm "
        f"({laid}): check whether the reference is of this mold and of the plies below, and whether scanner or mold moved"
    )
