"""Whether clouds are dense enough for the smallest pocket that the recipe asks for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from debulk._core import InputError
from debulk.arrays import Floats
from debulk.grid import Grid
from debulk.inspection.clouds.enough import FEW
from debulk.recipe import Recipe


@dataclass(frozen=True)
class Limits:
    """Of the points' spacing; `tests/python/inspection/test_resolution.py` thins clouds."""

    across: float = 4.0  # points across the smallest pocket, 16 in it: with fewer, its area is known to a third at best


LIMITS = Limits()
_COARSER = 1.3  # spacings of the height map: points farther apart than this do not give it all that it could show
_NEIGHBOURED = 0.5  # of an image's points: in a right image nearly all get a height, in shuffled lines a sixth at most


def is_coarser(pitch_mm: float, spacing_mm: float) -> bool:
    """Return whether points lie so far apart that a map of this spacing does not show more than they do."""
    return _COARSER * spacing_mm < pitch_mm < np.inf


def check_reference(pitch_mm: float, count: int, recipe: Recipe) -> None:
    """Refuse a reference too coarse for the smallest pocket, by its widest pitch."""
    reason = coarse_reason(pitch_mm, count, recipe)
    if reason:
        raise InputError(f"reference: {reason}")


def check_neighbours(xy_mm: Floats, heights: Grid) -> None:
    """Refuse an image whose neighbouring pixels are empty or lie apart: few of its (N, 2) points get a height then."""
    share = np.isfinite(heights.at(xy_mm)).sum() / max(len(xy_mm), 1)  # a narrow one is refused elsewhere, for that
    if min(heights.values.shape) >= FEW and share < _NEIGHBOURED:
        raise InputError(
            "reference: expected an image whose neighbouring pixels lie beside each other, but only "
            f"{100 * share:.2g} % of its points have such neighbours; is every other pixel missing, "
            "are lines out of order?"
        )


def coarse_reason(pitch_mm: float, count: int, recipe: Recipe) -> str:
    """Return why a cloud of this pitch is too coarse; empty if it is not, or if the area tolerance is 0.

    If there are too few points (`count`), the pitch is not known, and is infinite.
    """
    wanted = recipe.segmentation.area_tol_mm2
    most = np.sqrt(wanted) / LIMITS.across
    if not wanted or pitch_mm <= most:
        return ""
    came = (
        f"some {pitch_mm:.2g} mm apart, in one direction at least" if np.isfinite(pitch_mm) else f"only {count} of them"
    )
    return (
        f"expected points at most {most:.2g} mm apart, {LIMITS.across:g} across a pocket of {wanted / 100:g} cm² "
        f"(segmentation.area_tol_mm2), but got {came}; give the full cloud, an image with its rows and columns in order"
    )
