"""A pocket at the ply's edge with the friction of the ply round its net at either end of what it may be."""

from __future__ import annotations

from dataclasses import dataclass

from debulk.verdict import Verdict

__all__ = ["EdgeEnd", "EdgeFriction", "edge_friction_line"]


@dataclass(frozen=True, kw_only=True)
class EdgeEnd:
    """What becomes of a pocket at the ply's edge at one end of the friction's range.

    Attributes
    ----------
    verdict, reason
        By these minima alone.
    ridge_range_mm, rms_range_mm
        Least and most over their starts; None without a certified one.
    """

    verdict: Verdict
    reason: str
    ridge_range_mm: tuple[float, float] | None = None
    rms_range_mm: tuple[float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class EdgeFriction:
    """Both ends of that range (docs/model.md, section 3).

    Attributes
    ----------
    slipping
        Each free node of the rim grips over the nearest way to the ply's edge: the least. Net, minimum and single
        figures of the report are of this end.
    held
        The rim is held wherever the ply goes on past it: the most.
    held_nodes
        How many free nodes that are.
    """

    slipping: EdgeEnd
    held: EdgeEnd
    held_nodes: int


def edge_friction_line(both: EdgeFriction) -> str:
    """Say what each end comes to."""
    nodes = f"{both.held_nodes} free node{'s' * (both.held_nodes != 1)} of its rim"
    slipping, held = _ridge(both.slipping), _ridge(both.held)
    return f"lies at the ply's edge: with {nodes} slipping {slipping}, with them held {held}"


def _ridge(end: EdgeEnd) -> str:
    if end.ridge_range_mm is None:
        return f"{end.verdict.name}, no certified minimum"
    low, high = (f"{height:.2f}" for height in end.ridge_range_mm)
    return f"{end.verdict.name}, ridge {low if low == high else f'{low} to {high}'} mm"
