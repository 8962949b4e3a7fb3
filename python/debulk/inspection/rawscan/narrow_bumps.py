"""Bumps that the filters take for noise: narrow in every direction, or too short to be a standing wrinkle.

A foreign body under the ply, 5 to 9 mm wide at its foot, covers a few dozen points. The spike filter and the median of
the height map remove its top, and with it the bump. The raw scan is therefore searched before any filter, in rows of
pixels 2 mm apart: where a point stands out from both sides, the group of raised points around it is measured on the
neighbouring pixels (cpp/debulk/rawscan/narrow_bumps.hpp). The height map does not resolve such a bump, so no net can be
laid on it and it is not judged as a pocket. Its ridge is estimated from its height and width instead, and a bump whose
ridge could be above the limit leaves the layup undecided.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from debulk import _core
from debulk.recipe import Recipe
from debulk.results.finding import Finding
from debulk.results.report import LeftOut
from debulk.verdict import Verdict


@dataclass(frozen=True)
class Limits:
    """Of bumps that the filters take for noise; `tests/python/inspection/test_narrow_bumps.py` has such bells."""

    ridge_share: float = 0.75  # of the limit: a lower estimate is surely below it, although pixels miss top and foot
    least_pixels: float = (
        5.0  # narrowest foot searched for (mm if pixels are finer): in a narrower one too few stand up
    )
    measured_share: float = 0.78  # least measured width of a foot over that: flying points side by side reach 0.75
    steepest: float = 2.0  # greatest height over the width of the foot: a ply cannot be steeper
    longest_mm: float = 12.0  # at half the height: two of 46 good layups showed longer ones, which were not bumps


LIMITS = Limits()
_LOST_CELLS = 9.0  # bells up to so many grid cells wide at their foot vanish in the filters
_BELL_MM = 2.0  # height of the bell that serves as an example in the reports


@dataclass(frozen=True)
class NarrowBump:
    """A bump as the raw scan shows it."""

    top_mm: tuple[float, float]
    """Mold XY of its top."""
    height_mm: float
    width_mm: float
    length_mm: float
    """`height_mm`, `width_mm`, `length_mm`: height above its surroundings; width and length at half that height."""
    excess_mm: float
    ridge_mm: float
    """`excess_mm`, `ridge_mm`: excess length of a fibre across it if it is a bell, and the ridge that this excess
    makes."""


def bell_excess_mm(height_mm: float, wide_mm: float) -> float:
    """Return how much longer a fibre over a bell is than the bell's foot: a squared cosine `wide_mm` across."""
    x = np.linspace(0.0, wide_mm, 200)
    bell = height_mm * np.sin(np.pi * x / wide_mm) ** 2
    return float(np.hypot(np.diff(x), np.diff(bell)).sum()) - wide_mm


def critical(found: Sequence[Sequence[float]], pitch_mm: float, recipe: Recipe) -> tuple[NarrowBump, ...]:
    """Return the bumps whose ridge could be above the limit, highest first, from x, y, height, width and length."""
    thickness_mm, limit_mm = recipe.material.thickness_mm, recipe.verdict.max_ridge_mm
    bumps = []
    for x, y, height_mm, width_mm, length_mm in found:
        foot_mm = 2 * width_mm  # a bell is half as wide at half its height
        if foot_mm < LIMITS.measured_share * _narrowest_mm(pitch_mm) or height_mm > LIMITS.steepest * foot_mm:
            continue
        excess_mm = bell_excess_mm(height_mm, foot_mm)
        ridge_mm = min(height_mm, _core.ridge.ridge_height_of_excess(excess_mm, thickness_mm))
        if ridge_mm > LIMITS.ridge_share * limit_mm and length_mm < LIMITS.longest_mm:
            bumps.append(NarrowBump((x, y), height_mm, width_mm, length_mm, excess_mm, ridge_mm))
    return tuple(bumps)


def findings(bumps: Sequence[NarrowBump], limit_mm: float) -> list[Finding]:
    """Judge bumps: the height map resolves none of them, so that each leaves the layup undecided."""
    return [
        Finding(
            "narrow_bumps",
            Verdict.UNDECIDED,
            f"{_named(bump)}, is narrower than what the height map resolves, and its excess length could make a ridge "
            f"of {bump.ridge_mm:.2f} mm{_why_it_counts(bump.ridge_mm, limit_mm)}: look there, and scan again",
            bump.ridge_mm,
            limit_mm,
            "mm",
            bump.top_mm,
        )
        for bump in bumps
    ]


def _why_it_counts(ridge_mm: float, limit_mm: float) -> str:
    """Say why a ridge below the limit counts; empty for one above it."""
    if ridge_mm >= limit_mm:
        return ""
    return (
        f" by the pixels on it, which miss its top and foot; from {LIMITS.ridge_share:g} of the limit of "
        f"{limit_mm:.2f} mm on it may be above it"
    )


def left_out(bumps: Sequence[NarrowBump], pitch_mm: float) -> tuple[LeftOut, ...]:
    """Name the bumps on which no net could be laid, and the kind of bumps that the search does not see.

    On a scan with pixels 1 mm apart the search saw 96 to 100 of 100 bells that were 5 mm or more wide at their foot and
    2 mm high, and 80 to 95 of those that were 1.5 mm high. Narrower bells cover too few pixels.
    """
    narrowest_mm = _narrowest_mm(pitch_mm)
    entries = [
        LeftOut(
            what=_named(bump),
            why="it is narrower than what the height map resolves: nothing can be laid on it",
            bound=f"a fibre over a bell of this size is {bump.excess_mm:.2g} mm longer than the mold, which makes a "
            f"ridge of {bump.ridge_mm:.2f} mm",
        )
        for bump in bumps
    ]
    unseen = LeftOut(
        what=f"bumps narrower than {narrowest_mm:.2g} mm at their foot, and narrow ones beside a hole, or longer than "
        f"{LIMITS.longest_mm:g} mm and too short for a wrinkle",
        why=f"the pixels are {pitch_mm:.2g} mm apart, and what covers so few of them, or stands on no even ground, "
        "cannot be distinguished from a highlight",
        bound=f"none: a fibre over a bell {narrowest_mm:.2g} mm wide and {_BELL_MM:g} mm high is "
        f"{bell_excess_mm(_BELL_MM, narrowest_mm):.2g} mm longer than the mold, and over a higher one more",
    )
    return (*entries, unseen)


def not_looked_for(spacing_mm: float) -> LeftOut:
    """Name the bumps that the filters take for noise, for a raw scan that was not searched for them.

    With heights 1 mm apart, the height map showed none of the bells that were up to 9 mm wide at their foot and 2 mm
    high, 8 mm wide and 3 mm high, or 6 mm wide and 6 mm high. It showed all that were 10 mm wide or more.
    """
    wide_mm = _LOST_CELLS * spacing_mm
    return LeftOut(
        what=f"bumps narrower than {wide_mm:.2g} mm at their foot",
        why=f"the heights are {spacing_mm:.2g} mm apart, and the filters take what is so narrow for noise",
        bound=f"none: a fibre over a bell so wide, {_BELL_MM:g} mm high, is {bell_excess_mm(_BELL_MM, wide_mm):.2g} mm "
        "longer than the mold, and over a higher one more",
    )


def _narrowest_mm(pitch_mm: float) -> float:
    return LIMITS.least_pixels * max(1.0, pitch_mm)


def _named(bump: NarrowBump) -> str:
    x, y = bump.top_mm
    return (
        f"a bump about {2 * bump.width_mm:.0f} mm wide at its foot and {bump.height_mm:.1f} mm high at "
        f"({x:.0f}, {y:.0f}) mm"
    )
