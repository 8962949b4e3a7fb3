"""What to do about a report: one line for each action, from its verdicts, places, holes and level."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from debulk.results.area import in_cm2
from debulk.verdict import Verdict

if TYPE_CHECKING:
    from debulk.results.level import Level
    from debulk.results.report import PocketReport, ReportData, UnseenHole, Wrinkle

__all__ = ["advice", "deciding", "hole_line", "is_off", "level_line", "level_off", "wrinkle_line"]

_MOST = 12  # largest number of places named in one line


def deciding(report: ReportData) -> list[tuple[Verdict, list[int]]]:
    """Return the numbers of the pockets that keep the layup from CEASE, by verdict, the most severe first."""
    groups = [(v, [p.id for p in report.pockets if p.verdict is v]) for v in Verdict if v is not Verdict.CEASE]
    return sorted(((v, ids) for v, ids in groups if ids), key=lambda group: -group[0].severity)


def advice(report: ReportData) -> list[str]:
    """Say what to do, in the order in which to do it."""
    if level_off(report):
        return [
            "check the pose, the thickness in the recipe and the reference, then scan again: no pocket counts before "
            "the level is right"
        ]
    lines = []
    creasing, undecided, unjudged = (
        [p for p in report.pockets if p.verdict is v] for v in (Verdict.CREASE, Verdict.UNDECIDED, Verdict.INVALID)
    )
    late = {one.pocket for one in report.findings if one.check == "deadline"}
    undecided = [p for p in undecided if p.id not in late]
    if creasing:
        lines.append(f"smooth the ply at {_places(creasing)}, then scan again")
    lines += [f"smooth {wrinkle_line(wrinkle)}, then scan again" for wrinkle in report.wrinkles]
    if undecided:
        lines.append(f"not decided at {_places(undecided)}: smooth there too, or do what its reason says")
    if late:
        lines.append("give the inspection more time, and inspect the same scan again: the deadline passed")
    if unjudged:
        lines.append(f"not judged at {_places(unjudged)}: do what its reason says, then scan again")
    for hole in report.unseen:
        if hole.at_best is not None:
            remedy = "complete the reference" if hole.of == "reference" else "scan again"
            lines.append(f"{remedy} because of {hole_line(hole)}")
    if report.verdict is Verdict.CEASE:
        return lines or ["change nothing"]
    # A coverage that is too low, or a bump that was cut off, appears only in the layup's reason.
    covered = [p.verdict for p in report.pockets] + [hole.at_best for hole in report.unseen if hole.at_best]
    said = report.wrinkles or late
    if not lines or (report.verdict not in covered and not said):
        lines.insert(0, "mend what the reason above names, then scan again")
    return lines


def level_off(report: ReportData) -> bool:
    """Tell whether the level rules out any verdict for the report."""
    return report.verdict is Verdict.INVALID and report.level is not None and is_off(report.level, report.recipe)


def is_off(level: Level, recipe: Mapping[str, Any]) -> bool:
    """Tell whether the ply between the pockets is farther from its thickness than the recipe allows."""
    allowed = recipe.get("level", {})
    tol_mm, share = allowed.get("tol_mm"), allowed.get("largest_share")
    if tol_mm is None or share is None:
        return False
    wrong = level.low_share + level.high_share - level.loose_share
    return bool(abs(level.laid_mm - level.thickness_mm) > tol_mm or wrong > share)


def level_line(level: Level) -> str:
    """Describe how the ply lies between its pockets."""
    return (
        f"the ply between the pockets stands {level.laid_mm:.3f} ± {level.uncertainty_mm:.3f} mm above the reference, "
        f"its thickness is {level.thickness_mm:g} mm; tilt {level.tilt_deg:.3f}°, bow {level.bow_mm:.2f} mm"
    )


def wrinkle_line(wrinkle: Wrinkle) -> str:
    """Describe a standing wrinkle by its place and length."""
    (a, b), (c, d) = wrinkle.start_mm, wrinkle.end_mm
    return f"the wrinkle of {wrinkle.length_mm:.0f} mm from ({a:.0f}, {b:.0f}) to ({c:.0f}, {d:.0f}) mm"


def hole_line(hole: UnseenHole) -> str:
    """Describe a hole by its place and area."""
    what = {"reference": "a gap in the reference", "mask": "a masked area"}.get(hole.of, "a hole in the scan")
    return f"{what} of {in_cm2(hole.area_mm2, digits=3)} at ({hole.centre_mm[0]:.0f}, {hole.centre_mm[1]:.0f}) mm"


def _places(pockets: Sequence[PocketReport]) -> str:
    named = [f"{p.id} ({p.centroid_mm[0]:.0f}, {p.centroid_mm[1]:.0f})" for p in pockets if p.centroid_mm]
    rest = len(pockets) - len(named[:_MOST])
    more = f" and {rest} more" if rest and named else ""
    return f"pocket{'' if len(pockets) == 1 else 's'} {', '.join(named[:_MOST])}{more} mm" if named else "its pockets"
