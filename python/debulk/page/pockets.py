"""The order in which a page names pockets, and the ridge by which each is judged."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

from debulk.results.report_text import number

if TYPE_CHECKING:
    from debulk.results.report import PocketReport

__all__ = ["DecidingRidge", "deciding_ridge", "says", "worst_first"]


class DecidingRidge(NamedTuple):
    """Height of the ridge, its upper bound, and its range in words (empty if that is a single figure)."""

    height_mm: float
    most_mm: float
    spread: str


def deciding_ridge(pocket: PocketReport) -> DecidingRidge | None:
    """Return the ridge of the criterion that decided, or of the one that is known; None if neither is known.

    If the bridge of the net is higher than that ridge can be, it is returned instead. Its range then reaches from the
    lowest height by the sections of its fibres, if they were made, to the higher of both heights.
    """
    height, span = pocket.ridge_height_mm, pocket.ridge_range_mm
    if pocket.excess is not None and (pocket.decided_by == "excess" or height is None):
        height, span = pocket.excess.height_mm, pocket.excess.range_mm
    if height is None:
        return None
    span = span or (height, height)
    if (bridge_mm := pocket.bridge_height_mm or 0.0) > span[1]:
        section = pocket.bridge_section
        height, low_mm = (bridge_mm, bridge_mm) if section is None else (section.height_mm, section.range_mm[0])
        span = low_mm, max(bridge_mm, height)
    low, high = (number(value, 2) for value in span)
    return DecidingRidge(height, span[1], "" if low == high else f"({low} to {high})")


def worst_first(pockets: Iterable[PocketReport]) -> list[PocketReport]:
    """Sort pockets by verdict, the most severe first, and those with the same verdict by ridge, the highest first."""

    def place(pocket: PocketReport) -> tuple[int, float, int]:
        ridge = deciding_ridge(pocket)
        return -pocket.verdict.severity, -(ridge.height_mm if ridge else 0.0), pocket.id

    return sorted(pockets, key=place)


def says(pocket: PocketReport) -> str:
    """Describe a pocket for the text beside the cursor on the map."""
    ridge = deciding_ridge(pocket)
    known = "" if ridge is None else f", ridge {number(ridge.height_mm, 2)} mm"
    return f"pocket {pocket.id}: {pocket.verdict.name}{known}"
