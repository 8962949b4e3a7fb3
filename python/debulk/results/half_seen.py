"""A pocket that borders on what was not seen, judged with it filled in and with the ply on the mold there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from debulk.verdict import Verdict

__all__ = ["MOST_OF_RIM", "HalfSeen", "HoleBeside", "Way", "at_best", "half_seen_line", "hole_names"]

MOST_OF_RIM = 0.25
"""Share of a pocket's perimeter above which it is not judged at all: too much of its shape would be invented."""


@dataclass(frozen=True, kw_only=True)
class HoleBeside:
    """A part of the ply that was not seen and borders on a pocket.

    Attributes
    ----------
    centre_mm
        Middle of its area, mold XY.
    area_mm2
        XY area.
    of
        What is missing there: ``"scan"``, ``"mask"`` or ``"reference"``.
    """

    centre_mm: tuple[float, float]
    area_mm2: float
    of: str

    def __str__(self) -> str:
        what = {"mask": "a masked area", "reference": "a gap in the reference"}.get(self.of, "a hole")
        return f"{what} of {self.area_mm2 / 100:.2g} cm² at ({self.centre_mm[0]:.0f}, {self.centre_mm[1]:.0f}) mm"


@dataclass(frozen=True, kw_only=True)
class Way:
    """What becomes of a pocket if the ply lies in one way where it was not seen.

    Attributes
    ----------
    holes
        The way: ``"filled in"``, as the standing surface round them goes on; ``"on the mold"``; ``"spanned"``, by no
        more ply than it takes.
    verdict, reason
        Of the whole pocket.
    ridge_range_mm
        Least and most of the ridge, by the criterion that decides; None where none was found out.
    """

    holes: str
    verdict: Verdict
    reason: str
    ridge_range_mm: tuple[float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class HalfSeen:
    """How a pocket was judged that borders on what was not seen.

    Attributes
    ----------
    holes
        That border on it, largest first.
    rim_share
        Share of its perimeter in them, with the pocket filled in; of what was seen of it where it was not.
    ways
        What becomes of it, one for each way in which the ply was laid there; empty: it was not judged.
    """

    holes: tuple[HoleBeside, ...]
    rim_share: float
    ways: tuple[Way, ...] = ()


def at_best(half: HalfSeen, area_tol_mm2: float) -> Verdict:
    """Return the best that can be said of such a pocket.

    What all ways agree on, but CEASE only beside holes that are together no larger than the tolerance on area;
    UNDECIDED where they do not agree, INVALID where one cannot be judged, or too much of the perimeter was not seen.
    """
    verdicts = {way.verdict for way in half.ways}
    if Verdict.INVALID in verdicts or not verdicts or half.rim_share > MOST_OF_RIM:
        return Verdict.INVALID
    if len(verdicts) > 1 or (verdicts == {Verdict.CEASE} and sum(one.area_mm2 for one in half.holes) > area_tol_mm2):
        return Verdict.UNDECIDED
    return verdicts.pop()


def hole_names(holes: Sequence[HoleBeside]) -> str:
    """Name the largest of the holes, and how many more there are."""
    more = f" and {len(holes) - 1} more" if len(holes) > 1 else ""
    return f"{holes[0]}{more}"


def half_seen_line(seen: HalfSeen) -> str:
    """Say what borders on a pocket, and what becomes of it in each way."""
    line = f"borders on {hole_names(seen.holes)}, with {100 * seen.rim_share:.0f} % of its perimeter in it"
    told = []
    for way in seen.ways:
        ridge = ""
        if way.ridge_range_mm is not None:
            low, high = (f"{height:.2f}" for height in way.ridge_range_mm)
            ridge = f", ridge {low if low == high else f'{low} to {high}'} mm"
        told.append(f"{way.holes}: {way.verdict.name}{ridge}")
    return "; ".join([line, *told])
