"""What each check looks at, its limit, and what to do about its findings, in the order in which they speak.

The inspection runs these checks (`debulk.inspection.checks.listed`); the page, docs/checks.md and `debulk checks` show
these texts.
"""

from __future__ import annotations

from typing import NamedTuple

from debulk.verdict import Verdict

INVALID, CREASE, UNDECIDED, CEASE = (Verdict.INVALID, Verdict.CREASE, Verdict.UNDECIDED, Verdict.CEASE)


class CheckText(NamedTuple):
    """One thing that can make the verdict of a layup worse, or that a reader of the report must know.

    Attributes
    ----------
    name
        Name of its findings; ``docs/checks.md`` has a section of this name.
    title, sees, limit, remedy
        What is wrong, in a few words; what is looked at; the limit, and where it is set; what to do about a finding
        that does not know better itself.
    at_best
        Verdicts that its findings allow at best; None: they are only mentioned.
    """

    name: str
    title: str
    sees: str
    limit: str
    remedy: str
    at_best: tuple[Verdict | None, ...]


CHECK_TEXTS = (
    CheckText(
        "chain",
        "The scan does not come from the qualified chain",
        "the scan's signature against that of the chain of scanner, filters and export, if one is given",
        "the range that the chain's own scans showed",
        "use the scanner, the settings and the export that were qualified, or qualify the chain anew",
        (INVALID, UNDECIDED),
    ),
    CheckText(
        "same_scan",
        "Scan and reference are the same cloud",
        "whether points of the scan and of the reference agree bit for bit",
        "half of the points on the ply; 95 % of all points where the outline is not given",
        "give the scan of the draped ply and the reference from before it was draped, with all digits",
        (INVALID,),
    ),
    CheckText(
        "unit",
        "The scan is in another unit",
        "the extent of the scan against that of the reference",
        "within 15 % of the factor between millimetres and micrometres, centimetres, inches, decimetres or metres",
        "multiply the points by the factor that the reason names, or give the unit (`--unit`)",
        (INVALID,),
    ),
    CheckText(
        "two_layers",
        "The cloud holds two layers",
        "in windows 40 mm apart in a list of points, 9 mm in an image: whether neighbours lie at two heights, mixed as "
        "in two scans",
        "a quarter of the thickness, in a fifth of the windows; in an image 0.75 of it, in four windows side by side",
        "give one scan alone; clear the buffer before the next one",
        (INVALID,),
    ),
    CheckText(
        "point_spacing",
        "The scan is too coarse",
        "the spacing of the points on the ply",
        "four points across a pocket of `segmentation.area_tol_mm2`",
        "give the full cloud, or raise the smallest pocket's area in the recipe",
        (INVALID,),
    ),
    CheckText(
        "steep_mold",
        "The mold is too steep below the ply",
        "where the outline is given: the angle of the mold's normal to z, and to the rays of its organised scan",
        "65 degrees from z, 70 from a ray, on more than 2 cm² of the mold in one piece",
        "mask a frame or clamp that stands beside the ply there, turn the mold's frame or the scanner so that both "
        "look at it more squarely, or inspect that side by itself",
        (INVALID,),
    ),
    CheckText(
        "mold_edge",
        "The mold's edge does not tell where the ply ends",
        "without an outline: squares of 40 mm below a cliff of the reference, in which the scan stands up",
        "half a thickness above the reference",
        "give the ply's outline",
        (INVALID,),
    ),
    CheckText(
        "level",
        "The ply does not lie one thickness above the reference",
        "squares of the ply between the pockets: their median height, their share too high or too low, and the rigid "
        "motion, bend or step that explains it",
        "`level.tol_mm`, at most 0.35 thicknesses, for the median; `level.largest_share` of the squares",
        "check pose, thickness and reference; whether scanner or mold moved; whether scan and reference are swapped; "
        "whether backing paper was left on; lay down a ply that stands loose",
        (INVALID,),
    ),
    CheckText(
        "ply_edge",
        "The ply's edge is not where the outline is",
        "stretches of 40 mm along the outline: the step of one thickness across it, ply outside it, long fibres there",
        "`level.largest_edge_share` of the stretches, or three neighbouring ones far off",
        "check that the outline is this ply's, not mirrored, and in the mold's frame",
        (INVALID,),
    ),
    CheckText(
        "reference_humps",
        "The reference may hold a pocket of the ply before",
        "round humps of the reference on smooth surroundings, under the ply, and the air that the ply shows on them",
        "`verdict.max_ridge_mm`, for the ridge of the longest fibre over it",
        "give the scan that was taken after the ply before was debulked (`debulk.Stack`); on a bead or boss of the "
        "mold itself, smooth the ply down onto it: where it shows no air the hump is only mentioned",
        (None, UNDECIDED),
    ),
    CheckText(
        "coverage",
        "Too little of the ply was seen",
        "the share of the ply that scan and reference show, small holes filled in; below half of the limit no pockets "
        "are looked for, and the reason says what is likely to be wrong",
        "`verdict.min_coverage`",
        "scan again from where all of the ply is seen, or with another exposure; complete the reference; check that "
        "both are of the same part, in one unit and frame, rows and columns in order",
        (INVALID,),
    ),
    CheckText(
        "outline",
        "The outline is not given",
        "whether the inspector knows where the ply ends",
        "none",
        "give it (`ply_outline`, `--outline`): without it nothing at the ply's edge is told from what lies beside it",
        (None,),
    ),
    CheckText(
        "fibre_angles",
        "The fibres run otherwise than said, or it is not known how",
        "the median angle between measured and nominal fibres, where both are given; fibres over gaps of the angles",
        "`verdict.max_turn_deg`; `verdict.max_ridge_mm`, for twice the excess that lines over a gap show",
        "lay the ply anew, or give angles that cover the whole ply",
        (INVALID, None),
    ),
    CheckText(
        "locked",
        "The ply shears beyond its locking angle",
        "the shear of the ply, where its angles come from a drape or a sensor",
        "`material.locking_deg`, on more than the area of the smallest pocket",
        "start the drape elsewhere, or cut the ply; look at the place for wrinkles",
        (None,),
    ),
    CheckText(
        "pockets",
        "The worst pocket",
        "the verdict of every pocket, and of every other place that was judged as one",
        "`verdict.max_ridge_mm` and the margins; `verdict.min_pocket_coverage`",
        "smooth the ply along the fibres that are too long, towards the nearest edge, and scan again; "
        "if it is UNDECIDED, the page undecided.html of the documentation explains its reason",
        (INVALID, CREASE, UNDECIDED, CEASE),
    ),
    CheckText(
        "deadline",
        "Time ran out",
        "which pockets or searches were cut off; before any pocket is known, all of the inspection is",
        "`deadline_s`",
        "give more time or more threads, and inspect the same scan again",
        (UNDECIDED, None),
    ),
    CheckText(
        "holes",
        "A hole may hide something",
        "every part of the ply that was not seen: the ridge of what the fibres show there and of the steepest bell "
        "that it can hide; and bumps that end in it",
        "`verdict.max_ridge_mm`",
        "scan again with less glare, with another exposure or from another side; bring what is out of view into it",
        (INVALID, UNDECIDED),
    ),
    CheckText(
        "shared_fibres",
        "A fibre is too long where no pocket is",
        "the runs of the fibre lines that cross no pocket and are held at both ends",
        "`verdict.max_ridge_mm`",
        "smooth the ply along the line that the reason names, and scan again",
        (UNDECIDED,),
    ),
    CheckText(
        "false_acceptance",
        "A ridge may exceed the limit all the same",
        "the probability that any ridge exceeds the limit, by all that is not known of scan, ply and limit",
        "`verdict.max_risk`, where all pockets are CEASE",
        "rework the pocket that the reason names, or scan with less noise",
        (UNDECIDED,),
    ),
    CheckText(
        "plateaus",
        "A flat place with a sharp edge",
        "places that lie off their level by more than half a thickness, flat, and go up or down within a few cells",
        "0.55 thicknesses, and the area of the smallest pocket",
        "missing ply (INVALID): lay it anew, or give the outline that it has with its cut-outs, or the outer one, and "
        "a mask over its windows; double ply, or something on or below it (UNDECIDED): look at it, put it right, and "
        "scan again",
        (INVALID, UNDECIDED),
    ),
    CheckText(
        "wrinkles",
        "A wrinkle stands already",
        "long places of the raw scan that stand out of its morphological opening, and that the height map has lost",
        "`verdict.max_ridge_mm`, for the ridge of its excess",
        "smooth it out, and scan again; no vacuum closes it",
        (CREASE, UNDECIDED),
    ),
    CheckText(
        "narrow_bumps",
        "A bump is narrower than the height map resolves",
        "short places of the same kind, on the mold or on top of a pocket",
        "`verdict.max_ridge_mm`, for the excess of a bell of its size with what pixels miss, and of what lies below it",
        "look there for something below the ply, and scan again",
        (UNDECIDED,),
    ),
    CheckText(
        "raw_scan",
        "The raw scan could not be searched",
        "in how many places the raw scan stands out sharply",
        "the number that the search can follow",
        "scan again: the scan is spoiled",
        (INVALID,),
    ),
    CheckText(
        "filled",
        "A patch was made by software, not measured",
        "parts of 7 by 7 pixels, 8 mm at least, whose points are likelier to have been made of their neighbours than "
        "measured: they carry no noise, repeat depths of their neighbours, or scatter many times as much; where depths "
        "are rounded, parts of 13 by 13 pixels, 16 mm at least, that show no more than the rounding, or lie between "
        "its steps",
        "`verdict.max_ridge_mm` for what the fibres show there and a place so wide can hide",
        "switch the scanner's hole filling, clipping and removal of outliers off, or give the raw cloud",
        (UNDECIDED,),
    ),
    CheckText(
        "smoothed",
        "The scan was smoothed",
        "whether neighbouring points share their noise, how wide the step at the ply's edge is, and, where neither is "
        "known, whether anything in the scan is sharp",
        "`clean.fine_mm`, or a pixel if that is wider",
        "switch the smoothing off, give the raw cloud, or allow for it (`clean.fine_mm`); set the scanner's focus",
        (UNDECIDED,),
    ),
    CheckText(
        "audit",
        "A net contradicts the fibre lines",
        "for a share of the pockets that pass, whether a certified minimum of a net bridges above the limit",
        "`verdict.max_ridge_mm`; `run.audit` is the share of pockets that are audited",
        "look at the picture of that pocket, and please report it with the scan",
        (UNDECIDED,),
    ),
    CheckText(
        "approval",
        "The recipe was not approved",
        "the hash of the recipe, without its section `run`, against a file of approved ones, if one is given",
        "the recipes in that file",
        "use an approved recipe, or have this one approved (`debulk approve`)",
        (UNDECIDED,),
    ),
)
"""Every check, in order."""

_BY_NAME = {text.name: text for text in CHECK_TEXTS}


def text_of(check: str) -> CheckText | None:
    """Return the text of a check; None for a name that this version does not know."""
    return _BY_NAME.get(check)
