"""What an inspector makes of its reference cloud, once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, cloud, surface
from debulk.grid import Grid
from debulk.inspection import frame
from debulk.inspection.camera import PinholeImage, fit_camera
from debulk.inspection.cleaning import cleaned, masked, owned
from debulk.inspection.thinning import thinned

if TYPE_CHECKING:
    from debulk.recipe import Recipe

__all__ = ["Prepared", "prepare"]

Floats = NDArray[np.float64]
_LEAST_SPACING_MM = 0.5  # of the height map: a finer one shows no more of a pocket


@dataclass(frozen=True, eq=False)
class Prepared:
    """What an inspector keeps of its reference cloud.

    Attributes
    ----------
    reference, seen
        The smooth surface, and the heights that it was fitted to.
    grid_spacing_mm
        Of the height map.
    image
        Of the pinhole camera that the cloud comes from; None: it comes from none.
    sample
        (N, 3) some of the cloud's points, as `debulk.inspection.thinning.thinned` takes them: a scan that has the same
        is the reference itself. None: not kept.
    """

    reference: surface.Reference
    seen: Grid
    grid_spacing_mm: float
    image: PinholeImage | None = None
    sample: NDArray[np.float32] | None = None

    def seen_on_grid(self) -> tuple[NDArray[np.float32], Floats, float]:
        """Return `seen` as the core takes it: values, origin, spacing."""
        return np.asarray(self.seen.values, dtype=np.float32), self.seen.origin_mm, float(self.seen.spacing_mm)


def prepare(
    reference: ArrayLike,
    mold_from_scanner: Floats | None,
    camera: Floats | None,
    mask: NDArray[np.bool_] | None,
    recipe: Recipe,
) -> Prepared:
    """Clean the reference cloud, lay it on a grid, and fit the smooth surface and the camera."""
    threads = recipe.run.threads
    seen = masked(owned(reference, "reference"), mask, "reference")
    image = None
    if seen.ndim == 3:
        found = fit_camera(seen) if camera is None else camera
        image = None if found is None else PinholeImage(*seen.shape[:2], *map(float, found))
    if image is not None and mold_from_scanner is None:
        raise frame.pose_needed()
    points = cleaned(seen, mold_from_scanner, recipe, _core.Stop())
    spacing = recipe.clean.grid_spacing_mm
    pitch_mm = cloud.median_pitch(points, threads=threads)
    sample = thinned(points)
    frame.check_cloud_frame(sample[np.isfinite(sample).all(axis=1)].astype(np.float64), pitch_mm)
    if not spacing:  # of few binary digits: then grid positions are exact, in the whole map and in a part of it
        spacing = max(round(1024 * pitch_mm) / 1024, _LEAST_SPACING_MM)
    heights = surface.grid_heights(points, spacing_mm=spacing, threads=threads)
    return Prepared(surface.fit_reference(heights, threads=threads), heights, spacing, image, thinned(seen))
