"""Bumps that the filters take for noise: narrow every way, or too short for a wrinkle that stands already.

A foreign body under the ply, 5 to 9 mm wide at its foot, covers a few dozen points: the spike filter and the median of
the height map take its top away, and with it the bump. So the scan is looked at before any filter, in rows of pixels
2 mm apart: where a point stands out from both sides, what hangs together with it is measured among the pixels around it
(cpp/debulk/region/narrow_bumps.hpp). The height map does not resolve it, so that nothing can be laid on it and it is not
judged as a pocket: what its ridge would be is worked out from its height and its width, and one that could be above the
limit leaves the layup undecided.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from debulk import _core
from debulk.recipe import Recipe
from debulk.results.report import LeftOut
from debulk.ridge import ridge_height
from debulk.verdict import Judgement, Verdict

__all__ = ["NarrowBump", "bell_excess_mm", "critical", "doubts", "left_out", "not_searched"]

_SURE = 0.75  # of the limit: a bump whose ridge comes out lower is below it, though pixels miss its top and its foot
_BELL_MM = 2.0


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


def critical(found: Sequence[Sequence[float]], recipe: Recipe) -> tuple[NarrowBump, ...]:
    """Return those bumps whose ridge could be above the limit, highest first, from their x, y, height, width, length."""
    thickness_mm, limit_mm = recipe.material.thickness_mm, recipe.verdict.max_ridge_mm
    bumps = []
    for x, y, height_mm, width_mm, length_mm in found:
        excess_mm = bell_excess_mm(height_mm, 2 * width_mm)  # a bell is half as wide at half its height
        span_mm = 2 * thickness_mm + excess_mm
        ridge_mm = min(height_mm, ridge_height(span_mm + excess_mm, span_mm, thickness_mm))
        if ridge_mm > _SURE * limit_mm:
            bumps.append(NarrowBump((x, y), height_mm, width_mm, length_mm, excess_mm, ridge_mm))
    return tuple(bumps)


def named(bump: NarrowBump) -> str:
    """Name a bump by its size and place."""
    x, y = bump.top_mm
    return (
        f"a bump {bump.height_mm:.1f} mm high and {bump.width_mm:.1f} mm wide at half its height, at ({x:.0f}, {y:.0f}) mm"
    )


def doubts(bumps: Sequence[NarrowBump]) -> list[Judgement]:
    """Judge bumps: none is resolved, so that each leaves the layup undecided."""
    return [
        Judgement(
            Verdict.UNDECIDED,
            f"{named(bump)}, is narrower than what the height map resolves, and its excess length could make a ridge of "
            f"{bump.ridge_mm:.2f} mm: look there, and scan again",
        )
        for bump in bumps
    ]


def left_out(bumps: Sequence[NarrowBump], pitch_mm: float) -> tuple[LeftOut, ...]:
    return ()
