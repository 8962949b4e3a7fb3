"""How the ply lies between its pockets, as evidence that scan, reference, pose and recipe belong together."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Level:
    """Height of the ply between the pockets above the reference; it equals the thickness if everything is in place."""

    thickness_mm: float
    """Thickness of the ply according to the recipe."""
    laid_mm: float
    uncertainty_mm: float
    """`laid_mm`, `uncertainty_mm`: median height above the reference, less what a slope adds to the thickness; and its
    standard error."""
    low_share: float
    high_share: float
    """`low_share`, `high_share`: shares of the ply between the pockets that lie too low and too high by more than the
    recipe's tolerance."""
    offset_mm: float
    tilt_deg: float
    tilt_axis_deg: float
    bow_mm: float
    """`offset_mm`, `tilt_deg`, `tilt_axis_deg`, `bow_mm`: figures of a plane fitted to the deviation from the
    thickness: its value in the middle, its slope, and the direction of the axis about which it is tilted,
    counter-clockwise from mold +x; and the range of a parabola fitted in addition."""
    blocks: int
    block_mm: float
    """`blocks`, `block_mm`: number and side length of the squares whose medians are the data."""
    judged_share: float
    """Share of the ply's area in these squares."""
    removed_offset_mm: float = 0.0
    """Offset that was subtracted from the scan's height, as recipes before 0.8 allowed; else 0."""
    loose_share: float = 0.0
    """Share of `high_share` that is a loose border of the ply, or lies round bumps below the tolerances, if the level
    was accepted in spite of it."""
