"""What an inspector makes of its reference cloud, once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, cloud, surface
from debulk._core import InputError
from debulk.grid import Grid
from debulk.inspection import fingerprint, frame, resolution
from debulk.inspection.camera import PinholeImage, fit_camera
from debulk.inspection.cleaning import cleaned, masked, owned
from debulk.inspection.cliffs import without_cliffs
from debulk.inspection.effort import check_map
from debulk.inspection.thinning import pitch_of, thinned
from debulk.results.trace import ArrayTrace

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
    cloud
        Shape and fingerprint of the cloud; None: not kept.
    """

    reference: surface.Reference
    seen: Grid
    grid_spacing_mm: float
    image: PinholeImage | None = None
    sample: NDArray[np.float32] | None = None
    cloud: ArrayTrace | None = None

    def seen_on_grid(self) -> tuple[NDArray[np.float32], Floats, float]:
        """Return `seen` as the core takes it: values, origin, spacing."""
        return np.asarray(self.seen.values, dtype=np.float32), self.seen.origin_mm, float(self.seen.spacing_mm)


def prepare(
    reference: ArrayLike,
    mold_from_scanner: Floats | None,
    camera: Floats | None,
    mask: NDArray[np.bool_] | None,
    ply_outline: Floats | None,
    recipe: Recipe,
    stop: _core.Stop,
) -> Prepared:
    """Clean the reference cloud, lay it on a grid, and fit the smooth surface and the camera."""
    threads = recipe.run.threads
    own = owned(reference, "reference", stop)
    seen = masked(own, mask, "reference")
    image = None
    if seen.ndim == 3:
        found = fit_camera(seen) if camera is None else camera
        image = None if found is None else PinholeImage(*seen.shape[:2], *map(float, found))
    if image is not None and mold_from_scanner is None:
        raise frame.pose_needed()
    points = cleaned(seen, mold_from_scanner, recipe, stop)
    spacing = recipe.clean.grid_spacing_mm
    sample, each = thinned(points)
    in_mold = sample[np.isfinite(sample).all(axis=1)].astype(np.float64)
    if not len(in_mold):
        raise InputError("reference: expected a cloud, but of 30 000 places in it none holds a point")
    frame.check_cloud_frame(in_mold, pitch_of(in_mold[:, :2], each))
    resolution.check_reference(in_mold[:, :2], each, recipe)
    pitch_mm = cloud.median_pitch(points, threads=threads, stop=stop)
    if not spacing:  # of few binary digits: then grid positions are exact, in the whole map and in a part of it
        spacing = max(round(1024 * pitch_mm) / 1024, _LEAST_SPACING_MM)
    _, low, high = _core.cloud.bounds(points, threads)
    check_map(np.array(low[:2]), np.array(high[:2]), spacing, recipe)
    heights = without_cliffs(surface.grid_heights(points, spacing_mm=spacing, threads=threads, stop=stop), ply_outline)
    fitted = surface.fit_reference(heights, threads=threads, stop=stop)
    return Prepared(fitted, heights, spacing, image, thinned(seen).points, fingerprint.of_cloud(own))
