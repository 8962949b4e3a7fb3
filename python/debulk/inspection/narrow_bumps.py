"""Bumps that the filters take for noise: narrow every way, or too short for a wrinkle that stands already.

A foreign body under the ply, 5 to 9 mm wide at its foot, covers a few dozen points: the spike filter and the median of
the height map take its top away, and with it the bump. So the scan is looked at before any filter, in rows of pixels
2 mm apart: where a point stands out from both sides, what hangs together with it is measured among the pixels around
it (cpp/debulk/region/narrow_bumps.hpp). The height map does not resolve it, so that nothing can be laid on it and it is
not judged as a pocket: what its ridge would be is worked out from its height and its width, and one that could be above
the limit leaves the layup undecided.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from debulk.recipe import Recipe
from debulk.results.report import LeftOut
from debulk.ridge import ridge_height
from debulk.verdict import Judgement, Verdict

__all__ = ["NarrowBump", "bell_excess_mm", "critical", "doubts", "left_out", "not_looked_for"]

_SURE = 0.75  # of the limit: a bump whose ridge comes out lower is below it, though pixels miss its top and its foot
_PIXELS = 5.0  # that a bump's foot is wide, or mm where pixels are finer: below, too few of them stand up
_MEASURED = 0.78  # of its foot, at least; flying points side by side measure up to 0.75 of the narrowest
_STEEPEST = 2.0  # times its foot's width is a bump high: what is steeper is no ply
_LOST_CELLS = 9.0  # bells as wide at their foot vanish in the filters
_BELL_MM = 2.0
_LONGEST_MM = 12.0  # at half the height: two of 46 good layups showed longer ones, which were none


@dataclass(frozen=True)
class NarrowBump:
    """A bump as the raw scan shows it.

    Attributes
    ----------
    top_mm
        Mold XY of its top.
    height_mm, width_mm, length_mm
        Above what is around it; at half its height.
    excess_mm, ridge_mm
        Of a fibre across it, if it is a bell; the ridge that remains of this.
    """

    top_mm: tuple[float, float]
    height_mm: float
    width_mm: float
    length_mm: float
    excess_mm: float
    ridge_mm: float


def bell_excess_mm(height_mm: float, wide_mm: float) -> float:
    """Return how much longer a fibre over a bell is than its foot: a squared cosine, `wide_mm` from foot to foot."""
    x = np.linspace(0.0, wide_mm, 200)
    bell = height_mm * np.sin(np.pi * x / wide_mm) ** 2
    return float(np.hypot(np.diff(x), np.diff(bell)).sum()) - wide_mm


def critical(found: Sequence[Sequence[float]], pitch_mm: float, recipe: Recipe) -> tuple[NarrowBump, ...]:
    """Return those of x, y, height, width and length whose ridge could be above the limit, highest first."""
    thickness_mm, limit_mm = recipe.material.thickness_mm, recipe.verdict.max_ridge_mm
    bumps = []
    for x, y, height_mm, width_mm, length_mm in found:
        foot_mm = 2 * width_mm  # a bell is half as wide at half its height
        if foot_mm < _MEASURED * _narrowest_mm(pitch_mm) or height_mm > _STEEPEST * foot_mm:
            continue
        excess_mm = bell_excess_mm(height_mm, foot_mm)
        span_mm = 2 * thickness_mm + excess_mm
        ridge_mm = min(height_mm, ridge_height(span_mm + excess_mm, span_mm, thickness_mm))
        if ridge_mm > _SURE * limit_mm and length_mm < _LONGEST_MM:
            bumps.append(NarrowBump((x, y), height_mm, width_mm, length_mm, excess_mm, ridge_mm))
    return tuple(bumps)


def doubts(bumps: Sequence[NarrowBump]) -> list[Judgement]:
    """Judge bumps: none is resolved, so that each leaves the layup undecided."""
    return [
        Judgement(
            Verdict.UNDECIDED,
            f"{_named(bump)}, is narrower than what the height map resolves, and its excess length could make a ridge "
            f"of {bump.ridge_mm:.2f} mm: look there, and scan again",
        )
        for bump in bumps
    ]


def left_out(bumps: Sequence[NarrowBump], pitch_mm: float) -> tuple[LeftOut, ...]:
    """Name the bumps on which nothing could be laid, and those that the search does not see.

    On a scan with pixels 1 mm apart it saw 96 to 100 of 100 bells 5 mm and more wide at their foot and 2 mm high, 80 to
    95 that were 1.5 mm high; narrower ones cover too few pixels.
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
        f"{_LONGEST_MM:g} mm and too short for a wrinkle",
        why=f"the pixels are {pitch_mm:.2g} mm apart, and what covers so few of them, or stands on no even ground, is "
        "not told from a highlight",
        bound=f"none: a fibre over a bell {narrowest_mm:.2g} mm wide and {_BELL_MM:g} mm high is "
        f"{bell_excess_mm(_BELL_MM, narrowest_mm):.2g} mm longer than the mold, and over a higher one more",
    )
    return (*entries, unseen)


def not_looked_for(spacing_mm: float) -> LeftOut:
    """Name what the filters take for noise, where the raw scan was not searched for it.

    Of bells on heights 1 mm apart the height map showed none that was up to 9 mm wide at its foot and 2 mm high, 8 mm
    and 3 mm, or 6 mm and 6 mm; all of 10 mm and more.
    """
    wide_mm = _LOST_CELLS * spacing_mm
    return LeftOut(
        what=f"bumps narrower than {wide_mm:.2g} mm at their foot",
        why=f"the heights are {spacing_mm:.2g} mm apart, and the filters take what is so narrow for noise",
        bound=f"none: a fibre over a bell so wide, {_BELL_MM:g} mm high, is {bell_excess_mm(_BELL_MM, wide_mm):.2g} mm "
        "longer than the mold, and over a higher one more",
    )


def _narrowest_mm(pitch_mm: float) -> float:
    return _PIXELS * max(1.0, pitch_mm)


def _named(bump: NarrowBump) -> str:
    x, y = bump.top_mm
    return (
        f"a bump about {2 * bump.width_mm:.0f} mm wide at its foot and {bump.height_mm:.1f} mm high at "
        f"({x:.0f}, {y:.0f}) mm"
    )
