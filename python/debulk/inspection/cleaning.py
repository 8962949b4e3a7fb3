"""A cloud on its way to a map of heights, by the steps that take any cloud: check, mask, mold frame, outliers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, cloud
from debulk._core import InputError

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["cleaned", "masked"]

Cloud = NDArray[np.float32]


def masked(points: ArrayLike, mask: NDArray[np.bool_] | None, name: str) -> Cloud:
    """Check a cloud, and take out what the mask hides."""
    checked = cloud.checked(points, name)
    if mask is None:
        return checked
    if checked.shape[:2] != mask.shape:
        raise InputError(f"mask: expected the shape of the {name}'s image, {checked.shape[:2]}, but got {mask.shape}")
    return np.where(mask[..., None], np.float32(np.nan), checked)


def cleaned(points: Cloud, mold_from_scanner: NDArray[np.float64] | None, recipe: Recipe, stop: _core.Stop) -> Cloud:
    """Move a cloud into the mold's frame, and take out its outliers."""
    clean, threads = recipe.clean, recipe.run.threads
    if mold_from_scanner is not None:
        points = cloud.transform(points, mold_from_scanner, threads=threads)
    keep = cloud.remove_outliers(
        points, clean.neighbours, clean.std_ratio, least_ratio=clean.least_ratio, threads=threads, stop=stop
    )
    return np.where(keep[..., None], points, np.float32(np.nan))
