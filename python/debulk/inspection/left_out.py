"""The entries "left out" of a report: what a verdict does not take into account, why, and a bound on its effect."""

from __future__ import annotations

from collections.abc import Sequence

from debulk.inspection.find.found import Found
from debulk.inspection.holes import unseen
from debulk.results.report import LeftOut, PocketReport
from debulk.words import pocket_names


def of_chain() -> LeftOut:
    """Name that nothing is known of the chain that measured the scan, because none was given."""
    return LeftOut(
        what="the chain that measures: scanner, its software's filters, and the export",
        why="it is not qualified, or its qualification was not given (debulk qualify, --chain)",
        bound="none: what it takes off narrow bumps without a trace in its noise or at the ply's edge is not known",
    )


def of_late(cut: Sequence[tuple[int, str]]) -> tuple[LeftOut, ...]:
    """Name what the deadline cut off, from pairs of a pocket's number and what it is missing; one entry per kind."""
    entries = []
    for what in dict.fromkeys(lack for _, lack in cut):
        whose = pocket_names(number for number, lack in cut if lack == what)
        why, bound = "the deadline passed", "none: what becomes of it is not known"
        entries.append(LeftOut(what=f"{what} of {whose}", why=why, bound=bound))
    return tuple(entries)


def of_unsolved(pockets: Sequence[PocketReport]) -> tuple[LeftOut, ...]:
    """Name the pockets without net and minimum, because their excess length decides."""
    numbers = [pocket.id for pocket in pockets if pocket.unsolved]
    entry = LeftOut(
        what=f"net, minimum, picture and the paper's figures of {pocket_names(numbers)}",
        why='solve.when is "needed", and the excess length decides',
        bound="no minimum changes the excess length; in a pocket that ceases no fibre is, as a whole, so short that it "
        "could bridge up to the limit",
    )
    return (entry,) if numbers else ()


def of_stages(stage: str) -> LeftOut:
    """Name what is left out if the deadline passed during this stage, before any pocket was known."""
    what = f"the rest of the inspection from the stage {stage} on: pockets, coverage and verdict"
    return LeftOut(what=what, why="the deadline passed", bound="none: nothing is known of the ply")


def of_scan(found: Found, outline_known: bool) -> tuple[LeftOut, ...]:
    """Name what an unknown outline of the ply leaves out, and what the search of the scan did not examine."""
    edges = LeftOut(
        what="free edges and friction",
        why="the ply's outline is not known",
        bound="a pocket at the ply's edge is judged as if held there, but no fibre beside which bare mold shows makes "
        "it CREASE; friction holds a bridge up to the reference's edge: both come out higher, not lower",
    )
    return (*(() if outline_known else (edges,)), *unseen.left_out(found), *found.left_out)
