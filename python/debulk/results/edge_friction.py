"""A pocket at the ply's edge, judged for the least and the most friction of the ply round its net."""

from __future__ import annotations

from dataclasses import dataclass

from debulk.results.number import span
from debulk.verdict import Verdict


@dataclass(frozen=True, kw_only=True)
class EdgeEnd:
    """The outcome of a pocket at the ply's edge at one end of the range of friction."""

    verdict: Verdict
    reason: str
    """`verdict`, `reason`: verdict and reason from the minima of this end alone."""
    ridge_range_mm: tuple[float, float] | None = None
    rms_range_mm: tuple[float, float] | None = None
    """`ridge_range_mm`, `rms_range_mm`: lowest and highest value over its starts; None without a certified one."""


@dataclass(frozen=True, kw_only=True)
class EdgeFriction:
    """The outcomes at both ends of that range (docs/model.md, section 3)."""

    slipping: EdgeEnd
    """Least friction: each free node of the rim grips only over the shortest way to the ply's edge. Net, minimum and
    single figures of the report are those of this end."""
    held: EdgeEnd
    """Most friction: the rim is held wherever the ply continues beyond it."""
    held_nodes: int
    """Number of free nodes that are held in that case."""


def edge_friction_line(both: EdgeFriction) -> str:
    """Describe the outcome at each end."""
    nodes = f"{both.held_nodes} free node{'s' * (both.held_nodes != 1)} of its rim"
    slipping, held = _ridge(both.slipping), _ridge(both.held)
    return f"lies at the ply's edge: with {nodes} slipping {slipping}, with them held {held}"


def _ridge(end: EdgeEnd) -> str:
    if end.ridge_range_mm is None:
        return f"{end.verdict.name}, no certified minimum"
    return f"{end.verdict.name}, ridge {span(end.ridge_range_mm)} mm"
