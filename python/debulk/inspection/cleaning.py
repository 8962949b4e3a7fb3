"""A cloud on its way to a map of heights, by the steps that take any cloud: check, mask, mold frame, outliers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, cloud
from debulk._core import InputError

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["check_mask", "cleaned", "masked", "owned"]

Cloud = NDArray[np.float32]


def owned(points: ArrayLike, name: str) -> Cloud:
    """Copy a cloud: its owner may write into its memory while it is worked on."""
    given = cloud.as_cloud(points, name)
    return given.copy() if np.may_share_memory(given, np.asarray(points)) else given


def masked(points: ArrayLike, mask: NDArray[np.bool_] | None, name: str) -> Cloud:
    """Check a cloud, and take out what the mask hides."""
    checked = cloud.checked(points, name)
    if mask is None:
        return checked
    check_mask(mask, checked, name)
    return np.where(mask[..., None], np.float32(np.nan), checked)


def check_mask(mask: NDArray[np.bool_] | None, points: Cloud, name: str) -> None:
    """Refuse a mask of another shape than the cloud's image."""
    if mask is not None and points.shape[:2] != mask.shape:
        raise InputError(f"mask: expected the shape of the {name}'s image, {points.shape[:2]}, but got {mask.shape}")


def cleaned(points: Cloud, mold_from_scanner: NDArray[np.float64] | None, recipe: Recipe, stop: _core.Stop) -> Cloud:
    """Move a cloud into the mold's frame, and take out its outliers."""
    clean, threads = recipe.clean, recipe.run.threads
    if mold_from_scanner is not None:
        points = cloud.transform(points, mold_from_scanner, threads=threads, stop=stop)
    keep = cloud.remove_outliers(
        points, clean.neighbours, clean.std_ratio, least_ratio=clean.least_ratio, threads=threads, stop=stop
    )
    return np.where(keep[..., None], points, np.float32(np.nan))
