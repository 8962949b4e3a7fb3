"""Names the likely mistake if the level cannot be that of the ply, and what to do about it."""

from __future__ import annotations

import numpy as np

from debulk.inspection.clouds.enough import SEEN
from debulk.inspection.clouds.thinning import pitch_of
from debulk.inspection.evidence import medians
from debulk.inspection.evidence.ply_zones import INSET_MM, PlyZones
from debulk.inspection.evidence.sample import Sample
from debulk.inspection.place.level import LIMITS, Deviation
from debulk.inspection.place.level_step import Step, best_step
from debulk.recipe import Recipe, options
from debulk.results.finding import Reason
from debulk.results.level import Level
from debulk.words import in_mm

_ROUND_MM = 50  # margin that a cropped scan should keep round the ply
_FRAME_MM = 100.0  # farther neither mold nor scanner moves between two scans


def same_reason(share: float) -> str:
    """Say that scan and reference are the same cloud."""
    return (
        f"scan and reference are the same: {100 * share:.0f} % of their points agree bit for bit; give the scan of the "
        "draped ply and the reference from before it was draped, with all the digits that the scanner gave"
    )


def stale_reason(share: float, place_mm: tuple[float, float]) -> str:
    """Say that a scan holds points of the reference."""
    return (
        f"{100 * share:.0f} % of the points on the ply round {in_mm(place_mm)} are the "
        "reference's, bit for bit: they show the mold from before the ply was laid; have the scanner's software clear "
        "its buffer, and fill nothing in from an earlier scan"
    )


def few_squares_reason(zones: PlyZones, sample: Sample, *, share: float, outlined: bool) -> Reason:
    """Say why there are fewer squares of the ply than are needed, and what to do.

    `share` is that of the ply in the known squares.
    """
    on, known, least = sample.on_ply, np.isfinite(sample.height_mm), LIMITS.least_squares
    each_mm2 = pitch_of(sample.points_mm[known, :2], 1) ** 2  # inf if hardly any point is known
    if not outlined or not on.any() or not SEEN * zones.inner_mm2 <= np.count_nonzero(on) * each_mm2 < np.inf:
        what = f"between the pockets only {100 * share:.1f} % of it was seen by scan and reference"
        remedy = (
            "check that the outline, the scan and the reference are of the same part, in mm, with their pose: z is to "
            "point up, away from the mold"
        )
    elif zones.squares < least:
        what = (
            f"the ply is too small, only {zones.squares} squares of {zones.side_mm:g} mm lie {INSET_MM:g} mm "
            f"inside its outline, and {least} are needed"
        )
        remedy = "check that the outline is in mm"
    elif len(zones.blocks(sample, on).height_mm) < least:
        what = (
            f"the ply is a small part of the scan, only {np.count_nonzero(on)} of the {len(on)} points that are looked "
            "at for it lie well inside the outline"
        )
        remedy = f"crop scan and reference to the ply and {_ROUND_MM} mm round it"
    else:
        what = f"pockets with their feet leave only {100 * share:.1f} % of the ply between them"
        remedy = "lay it down and scan again"
    return Reason(f"the level of the ply cannot be determined: {what}; {remedy}", remedy)


def level_reason(
    level: Level, found: Deviation, recipe: Recipe, pockets_share: float = 0.0, loose_share: float = 0.0
) -> Reason | None:
    """Say why a level cannot be that of the ply, and what to do; None if it can.

    Pockets that were not left out may cover `pockets_share` of the ply, and `loose_share` of what is between them may
    stand up, because it is a loose border or low bumps.
    """
    tol, share = options.level_tol_mm(recipe), recipe.level.largest_share
    if level.uncertainty_mm > 0.5 * tol:
        if _lifted(level, found, recipe):
            what, remedy = _uneven(level, found, recipe)
            return _asking(f"the ply stands off the mold so widely that its level is not known: {what}", ": ", remedy)
        what = (
            "the level of the ply cannot be determined: its median height between the pockets is uncertain by "
            f"{level.uncertainty_mm:.2g} mm, and its tolerance is {tol:.2g} mm"
        )
        return _asking(what, "; ", "scan again, with less noise, and check whether the reference is of this mold")
    median, wrong = level.laid_mm - level.thickness_mm, level.low_share + level.high_share
    if abs(median) <= tol and wrong - loose_share <= share:
        return None
    bare = level.laid_mm <= tol and abs(level.laid_mm) < 0.5 * level.thickness_mm
    if bare and sum(found.left(tol, 0)) <= share:
        return Reason(
            f"no ply is seen: the scan stands {_off_reference(level)} everywhere, a ply by its thickness of "
            f"{level.thickness_mm:g} mm; the mold is empty, the reference was taken "
            f"with the ply on it, or the scan lies {level.thickness_mm - level.laid_mm:.2f} mm too low",
            "look whether the ply is on the mold, and give the reference from before it was draped",
        )
    enough = max(share, LIMITS.explained_share * wrong)
    # A fit of negligible size explains nothing, even if little is left after subtracting it.
    sizes_mm = np.array([abs(median), np.ptp(found.fits_mm[1]), level.bow_mm])
    counts = sizes_mm > tol * np.array([0.5, 1.0, 0.5])
    left = [found.left(tol, k) for k in range(3)]
    small = [low + max(0.0, high - pockets_share) <= enough for low, high in left]
    order = next((k for k in range(3) if counts[k] and small[k]), None)
    step = best_step(found)
    if abs(median) > _FRAME_MM and order != 0:
        what = f"the scan lies {abs(median):.0f} mm too {'high' if median > 0 else 'low'}: it is in another frame"
        remedy = "give scan and reference both as the scanner saw them, with its pose, or both in the mold's frame"
    elif step is not None and step.height_mm > tol and np.mean(np.abs(step.rest_mm) > tol) <= enough:
        what, remedy = _step(step, level, tol)
    else:
        what, remedy = _uneven(level, found, recipe) if order is None else _motion(level, found, order, tol)
        if order == 2 and _lifted(level, found, recipe):
            top = int(np.argmax(found.residual_mm - medians.SURE * found.squares.error_mm))
            high = f"{found.residual_mm[top]:.2f} mm at {in_mm(found.squares.xy_mm[top])}"
            what = f"{what}, or the ply stands off the mold widely, by {high}"
            remedy = f"look there first: lay the ply down and scan again; if it does lie on the mold, {remedy}"
    where = f"between the pockets the ply stands {_off_reference(level)}, its thickness is {level.thickness_mm:g} mm"
    return _asking(f"{what} ({where})", ": ", remedy)


def _asking(what: str, joint: str, remedy: str) -> Reason:
    return Reason(f"{what}{joint}{remedy}", remedy)


def _off_reference(level: Level) -> str:
    return f"{abs(level.laid_mm):.2f} mm {'below' if level.laid_mm < 0 else 'above'} the reference"


def _lifted(level: Level, found: Deviation, recipe: Recipe) -> bool:
    """Return whether the ply lies on the mold somewhere and is too low nowhere, as where air lifts it widely."""
    share = recipe.level.largest_share
    laid = np.quantile(np.abs(found.residual_mm), share) <= options.level_tol_mm(recipe)
    return bool(laid and level.low_share <= share < level.high_share)


def _motion(level: Level, found: Deviation, order: int, tol_mm: float) -> tuple[str, str]:
    """Name the rigid motion or the bend that explains the deviation, and a remedy."""
    offset = level.laid_mm - level.thickness_mm
    lies = f"lies {abs(offset):.2f} mm too {'high' if offset > 0 else 'low'}"
    if order == 0:
        checks = "check the pose, the thickness in the recipe, and whether the reference is of this layup"
        if abs(level.laid_mm + level.thickness_mm) <= tol_mm:
            return f"the scan {lies} everywhere, or scan and reference are swapped", f"swap them, or {checks}"
        return f"the scan {lies} everywhere", checks
    also = f" and {lies}" if abs(offset) > tol_mm else ""
    if order == 1:
        ends = float(np.ptp(found.fits_mm[1]))
        return (
            f"the scan is tilted by {level.tilt_deg:.2g} degrees about an axis at {level.tilt_axis_deg:.0f} degrees "
            f"from x, {ends:.2f} mm from end to end{also}",
            "check whether scanner or mold moved since the reference was taken",
        )
    return (
        f"the scan is bent by {level.bow_mm:.2f} mm over the ply{also}",
        "check the scanner's calibration and temperature, how the mold is held, and whether the reference is of it",
    )


def _step(step: Step, level: Level, tol_mm: float) -> tuple[str, str]:
    """Name a step, and a remedy. Where it goes down from a ply that lies right to the mold, no ply lies beyond it."""
    line = f"line through {in_mm(step.at_mm)} at {step.line_deg:.0f} degrees from x"
    if max(abs(step.low_mm + level.thickness_mm), abs(step.low_mm + step.height_mm)) <= tol_mm:
        return (
            f"the mold is bare on {100 * (1 - step.share):.0f} % of where the ply should be, beyond a {line}",
            "check that the outline is this ply's, not shifted or mirrored, and in the mold's frame, and that the "
            "reference shows nothing of the ply",
        )
    return (
        f"{100 * step.share:.0f} % of the ply lies {step.height_mm:.2f} mm higher than the rest, by a step along a "
        f"{line}",
        "look whether backing paper was left on there, or whether another ply lies below; if neither, check whether "
        "scanner or mold moved",
    )


def _uneven(level: Level, found: Deviation, recipe: Recipe) -> tuple[str, str]:
    """Name a deviation that no simple motion explains, and a remedy."""
    tol_mm = options.level_tol_mm(recipe)
    worst = int(np.argmax(np.abs(found.residual_mm) - medians.SURE * found.squares.error_mm))
    what = (
        f"{100 * level.low_share:.0f} % of the ply between the pockets lies more than {tol_mm:.2g} mm too "
        f"low and {100 * level.high_share:.0f} % too high, worst by {found.residual_mm[worst]:+.2f} mm at "
        f"{in_mm(found.squares.xy_mm[worst])}"
    )
    raised = level.low_share <= recipe.level.largest_share
    if raised and abs(level.laid_mm - level.thickness_mm) <= tol_mm:
        return what, "a ply that stands off the mold so widely cannot be judged; lay it down and scan again"
    return what, "check whether the reference is of this mold and of the plies below, and whether scanner or mold moved"
