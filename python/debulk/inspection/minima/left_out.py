"""What the evaluation of a pocket leaves out: energy terms that its net does not need, and starts."""

from __future__ import annotations

from debulk import sheet
from debulk.inspection.minima.starts import Settled
from debulk.results.report import LeftOut

_TERMS = {
    "friction": LeftOut(
        what="friction of pockets inside the ply",
        why="their nets have no free edge",
        bound="none: friction acts on free boundary nodes only",
    ),
    "gravity": LeftOut(what="gravity", why="the recipe's density or gravity is zero", bound="below 1e-4 of the vacuum"),
}


def of_pocket(ply: sheet.Sheet, settled: Settled) -> tuple[LeftOut, ...]:
    """Name the energy terms that the model of a pocket's ply omits, and the starts that a deadline cut off."""
    entries = [_TERMS[name] for name in ply.left_out if name in _TERMS]
    if settled.cut:
        entries.append(
            LeftOut(
                what="some seeded starts",
                why="the deadline passed",
                bound="the ranges of RMS and ridge height come from fewer minima than the recipe asks for",
            )
        )
    return tuple(entries)
