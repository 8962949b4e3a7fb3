"""A pocket beside an area that was not seen, judged once with it filled in and once with the ply on the mold there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from debulk.results.number import span
from debulk.verdict import Verdict
from debulk.words import in_cm2, in_mm

MOLD_UNKNOWN = {
    "reference": "complete the reference",
    "view": "let the scanner see all of the ply, and the mold below it",
}
"""What hides the mold, too, in a hole, and what to do about it; as in `HoleBeside.of`."""
MOST_OF_RIM = 0.25
"""Share of a pocket's perimeter above which it is not judged at all, as too much of its shape would be invented."""


def remedy_for(of: str) -> str:
    """Return what to do about a hole, by what hides the ply there."""
    return MOLD_UNKNOWN.get(of, "scan again")


def hole_kind(of: str, in_scan: str) -> str:
    """Name a hole by what hides the ply there."""
    named = {"mask": "a masked area", "reference": "a gap in the reference", "view": "a part of the ply out of view,"}
    return named.get(of, in_scan)


@dataclass(frozen=True, kw_only=True)
class HoleBeside:
    """An unseen part of the ply that borders on a pocket."""

    centre_mm: tuple[float, float]
    """Middle of its area, mold XY."""
    area_mm2: float
    """Area in XY."""
    of: str
    """What is missing there, as in `debulk.results.report.UnseenHole`."""

    def __str__(self) -> str:
        return f"{hole_kind(self.of, 'a hole')} of {in_cm2(self.area_mm2)} at {in_mm(self.centre_mm)}"


@dataclass(frozen=True, kw_only=True)
class Way:
    """The outcome of a pocket if the ply lies in one assumed way where it was not seen."""

    holes: str
    """How the holes are treated: ``"filled in"`` (the raised surface round them continues), ``"on the mold"``, or
    ``"spanned"`` (by no more ply than that takes)."""
    verdict: Verdict
    reason: str
    """`verdict`, `reason`: verdict and reason of the whole pocket."""
    ridge_range_mm: tuple[float, float] | None = None
    """Lowest and highest ridge by the criterion that decides; None if none was determined."""


@dataclass(frozen=True, kw_only=True)
class HalfSeen:
    """How a pocket was judged that borders on an area that was not seen."""

    holes: tuple[HoleBeside, ...]
    """Holes that border on the pocket, largest first."""
    rim_share: float
    """Share of its perimeter in the holes, with the pocket filled in, or of its seen part if it was not filled in."""
    ways: tuple[Way, ...] = ()
    """One outcome for each way in which the ply was assumed to lie there; empty if the pocket was not judged."""


def at_best(half: HalfSeen, area_tol_mm2: float) -> Verdict:
    """Return the best verdict that such a pocket can have.

    It is the verdict on which all ways agree, but CEASE only beside holes that are together no larger than the
    tolerance on area. It is UNDECIDED if the ways disagree, and INVALID if one cannot be judged or too much of the
    perimeter was not seen.
    """
    verdicts = {way.verdict for way in half.ways}
    if Verdict.INVALID in verdicts or not verdicts or half.rim_share > MOST_OF_RIM:
        return Verdict.INVALID
    if len(verdicts) > 1 or (verdicts == {Verdict.CEASE} and sum(one.area_mm2 for one in half.holes) > area_tol_mm2):
        return Verdict.UNDECIDED
    return verdicts.pop()


def or_undecided(verdict: Verdict, promoted: str) -> Verdict:
    """Return a pocket's verdict; a bump below the tolerances that cannot be judged may crease, and may be nothing."""
    return Verdict.UNDECIDED if promoted and verdict is Verdict.INVALID else verdict


def hole_names(holes: Sequence[HoleBeside]) -> str:
    """Name the largest of the holes, and how many more there are."""
    more = f" and {len(holes) - 1} more" if len(holes) > 1 else ""
    return f"{holes[0]}{more}"


def half_seen_line(seen: HalfSeen) -> str:
    """Describe what borders on a pocket, and its outcome in each way."""
    line = f"borders on {hole_names(seen.holes)}, with {100 * seen.rim_share:.0f} % of its perimeter in it"
    for way in seen.ways:
        ridge = "" if way.ridge_range_mm is None else f", ridge {span(way.ridge_range_mm)} mm"
        line += f"; {way.holes}: {way.verdict.name}{ridge}"
    return line
