"""What to do about a report: a checklist with one entry for each place, the worst first."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from debulk.results.deciding import worst_first
from debulk.results.half_seen import hole_kind, remedy_for
from debulk.results.rework import rework
from debulk.verdict import Verdict
from debulk.words import in_cm2, in_mm

if TYPE_CHECKING:
    from debulk.results.finding import Finding
    from debulk.results.level import Level
    from debulk.results.report import PocketReport, ReportData, UnseenHole, Wrinkle
    from debulk.rework import Move


def deciding(report: ReportData) -> list[tuple[Verdict, list[int]]]:
    """Return the numbers of the pockets that keep the layup from CEASE, by verdict, the most severe first."""
    groups = [(v, [p.id for p in report.pockets if p.verdict is v]) for v in Verdict if v is not Verdict.CEASE]
    return sorted(((v, ids) for v, ids in groups if ids), key=lambda group: -group[0].severity)


class Deed(NamedTuple):
    """One thing to do, at one place."""

    do: str
    """A request, such as "smooth the ply"."""
    at: str = ""
    """The pocket, hole or wrinkle; empty if it concerns the whole scan."""
    place_mm: tuple[float, float] | None = None
    """Its place, mold XY; None without one."""
    amount: str = ""
    """By how much, and in which directions; empty if that is not known."""
    ways_deg: tuple[float, ...] = ()
    """Directions in which the ply is to be moved out over an edge, 0 to 360 degrees from the mold's +x."""
    pocket: int | None = None
    verdict: Verdict | None = None
    """`pocket`, `verdict`: number and verdict of the pocket; None if it is not about one."""
    check: str = ""
    """Name of the check whose finding asks for it; empty if none does."""

    def __str__(self) -> str:
        place = "" if self.place_mm is None else f" at {in_mm(self.place_mm)}"
        return f"{self.do}{f' ({self.at}{place})' if self.at else ''}{f': {self.amount}' if self.amount else ''}"


def advice(report: ReportData) -> list[Deed]:
    """Say what to do, in the order in which to do it: one entry for each place, the worst first."""
    if report.verdict is Verdict.CEASE:
        return [Deed("draw the vacuum")]
    deeds = []
    if report.verdict is Verdict.INVALID and report.level is not None and is_off(report.level, report.recipe):
        asked = [one.asks for one in report.findings if one.check == "level"] or [_LEVEL]
        return [Deed(asked[0]), Deed("then scan again: no pocket counts before the level is right")]
    pockets = [pocket for pocket in worst_first(report.pockets) if pocket.verdict is not Verdict.CEASE]
    late = {one.pocket for one in report.findings if one.check == "deadline"}
    hidden = [hole for hole in report.unseen if hole.at_best is not None]
    others = _WITH_PLACES | {"holes"} if hidden else _WITH_PLACES
    found = [one for one in report.findings if one.check not in others and one.pocket is None]
    deeds += [_of_finding(one) for one in found if one.at_best is not None or one.remedy]
    planned = rework(report)
    moves = {p.id: () if planned is None else planned.of(p.id) for p in pockets}
    deeds += [_of_pocket(pocket, moves[pocket.id], report) for pocket in pockets if pocket.id not in late]
    deeds += [Deed("smooth it", wrinkle_line(wrinkle)) for wrinkle in report.wrinkles]
    if late:
        deeds.append(Deed("give the inspection more time, and inspect the same scan again: the deadline passed"))
    for hole in hidden:
        deeds.append(Deed(remedy_for(hole.of), hole_line(hole)))
    if not deeds:
        deeds.append(Deed("scan again"))
    if any(deed.do.startswith(_BY_HAND) for deed in deeds):
        deeds.append(Deed("scan again before the vacuum is drawn"))
    return list(dict.fromkeys(deeds))


_WITH_PLACES = {"pockets", "wrinkles", "deadline"}  # these findings have entries of their own
_LEVEL = "check the pose, the thickness in the recipe and the reference"  # in a report of before the findings
_BY_HAND = ("smooth", "lay", "treat", "look")


_ASKED = {Verdict.CREASE: "smooth the ply", Verdict.UNDECIDED: "smooth the ply, or treat it as CREASE"}
_INTO = "smooth the ply into the hollow below it"  # of a bridge: the ply is too short there


def _of_finding(finding: Finding) -> Deed:
    what = finding.check.replace("_", " ")
    return Deed(finding.asks, what, finding.place_mm, verdict=finding.at_best, check=finding.check)


def _of_pocket(pocket: PocketReport, moves: tuple[Move, ...], report: ReportData) -> Deed:
    ridge, limit_mm = pocket.deciding_ridge, report.limit_mm
    bridges = ridge is not None and ridge.is_bridge
    by_verdict = _INTO if bridges and pocket.verdict is Verdict.CREASE else _ASKED.get(pocket.verdict, "scan again")
    asked = pocket.remedy or by_verdict
    amount = ""
    towards: tuple[float, ...] = ()
    exceeds = ridge is not None and limit_mm is not None and ridge.most_mm > limit_mm
    if ridge is not None and limit_mm is not None and (exceeds or pocket.verdict is Verdict.CREASE):
        longest = _one_each_way(moves)
        moved = " and ".join(move.short for move in longest)
        amount = moved or f"{'bridge' if bridges else 'ridge'} up to {ridge.most_mm:.2f} mm, limit {limit_mm:.2f} mm"
        towards = tuple(move.towards_deg for move in longest if move.towards_deg is not None)
    return Deed(asked, f"pocket {pocket.id}", pocket.centroid_mm, amount, towards, pocket.id, pocket.verdict)


def _one_each_way(moves: tuple[Move, ...]) -> list[Move]:
    """Return the longest move of each direction: one line of a list is for a hand, the plan has the bands apart."""
    longest: dict[float | None, Move] = {}
    for move in moves:
        way = None if move.towards_deg is None else round(move.towards_deg) % 360
        if way not in longest or move.length_mm > longest[way].length_mm:
            longest[way] = move
    return list(longest.values())


def is_off(level: Level, recipe: Mapping[str, Any]) -> bool:
    """Tell whether the ply between the pockets is farther from its thickness than the recipe allows."""
    from debulk.recipe.options import LEVEL_SHARE

    allowed = recipe.get("level", {})
    tol_mm, share = allowed.get("tol_mm"), allowed.get("largest_share")
    if tol_mm is None or share is None:
        return False
    wrong = level.low_share + level.high_share - level.loose_share
    most_mm = min(tol_mm, LEVEL_SHARE * level.thickness_mm)
    return bool(abs(level.laid_mm - level.thickness_mm) > most_mm or wrong > share)


def level_line(level: Level) -> str:
    """Describe how the ply lies between its pockets."""
    return (
        f"the ply between the pockets stands {abs(level.laid_mm):.3f} ± {level.uncertainty_mm:.3f} mm "
        f"{'above' if level.laid_mm >= 0 else 'below'} the reference, "
        f"its thickness is {level.thickness_mm:g} mm; tilt {level.tilt_deg:.3f}°, bow {level.bow_mm:.2f} mm"
    )


def wrinkle_line(wrinkle: Wrinkle) -> str:
    """Describe a standing wrinkle by its place and length."""
    return f"the wrinkle of {wrinkle.length_mm:.0f} mm from {in_mm(wrinkle.start_mm, wrinkle.end_mm)}"


def hole_line(hole: UnseenHole) -> str:
    """Describe a hole by its place and area."""
    return f"{hole_kind(hole.of, 'a hole in the scan')} of {in_cm2(hole.area_mm2, digits=3)} at {in_mm(hole.centre_mm)}"
