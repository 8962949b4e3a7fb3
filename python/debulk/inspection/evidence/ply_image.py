"""What a scan shows of the ply and round it, as an image."""

from __future__ import annotations

import numpy as np

from debulk.arrays import Bools, Cloud, Floats
from debulk.inspection.clouds.thinning import window_of
from debulk.inspection.evidence.cloud_image import CloudImage, in_lines, laid_out
from debulk.inspection.evidence.outline import STRETCH_MM
from debulk.inspection.evidence.sample import over_reference
from debulk.inspection.ply.ply_on_mold import Setup


def ply_image(scan: Cloud, pitch_mm: float, setup: Setup, box_mm: Floats) -> CloudImage | None:
    """Return what a scan of a pitch shows of the ply and round it as an image, less what the mask hides.

    `box_mm` (2, 2) is the lowest and highest mold XY of the ply. Round it lies what shows how sharp its edge is. None:
    too few points of a list lie on the ply.
    """
    box_mm = box_mm + np.array([[-STRETCH_MM], [STRETCH_MM]])
    image = CloudImage(scan, scan, pitch_mm) if scan.ndim == 3 else in_lines(scan, pitch_mm)
    if image is None:
        reference, threads = setup.prepared.reference, setup.recipe.run.threads
        return laid_out(scan, setup.mold_from_scanner, reference, box_mm, pitch_mm, threads)
    window = shows(image.points, setup, box_mm)  # a scan often shows much more than the ply
    part, mask = image.points[window], setup.mask
    if mask is not None and mask.shape == scan.shape[:2]:
        part = np.where(mask[window][..., None], np.float32(np.nan), part)
    return CloudImage(part, part, pitch_mm)


def shows(image: Cloud, setup: Setup, box_mm: Floats) -> tuple[slice, slice]:
    """Return the rows and columns of a scan's image (H, W, 3) that show a box, (2, 2) lowest and highest mold XY."""

    def wanted(points: Cloud) -> Bools:
        xy = over_reference(points, setup)[0][:, :2]
        return np.asarray(((xy >= box_mm[0]) & (xy <= box_mm[1])).all(axis=1))

    return window_of(image, wanted)
