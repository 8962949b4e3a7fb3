"""The holes that the mask causes: under a clamp that the user has masked, a better scan would show no pocket either."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from debulk.inspection.clouds.products import product

if TYPE_CHECKING:
    from debulk.inspection.find.found import Found
    from debulk.inspection.reference.prepared import Prepared

__all__ = ["masked_holes"]

_STEP_MM = 2.0
_LEAST_SHARE = 0.7  # of a hole's area; pixels at a tool's edge are often missing in addition to the masked ones


def masked_holes(
    found: Found, mask: NDArray[np.bool_], prepared: Prepared, mold_from_scanner: NDArray[np.float64] | None
) -> tuple[bool, ...]:
    """Return for each hole whether the mask hides most of it; False without a camera, which relates mask and mold.

    Parameters
    ----------
    found
        The result of the search, with the holes.
    mask
        (H, W): True where a pixel is not used.
    prepared
        The reference, and the camera's image.
    mold_from_scanner
        (4, 4); None if both frames are the same.
    """
    image = prepared.image
    if image is None or mask.shape != image.shape:
        return (False,) * len(found.unseen.holes)
    pose = np.eye(4) if mold_from_scanner is None else np.asarray(mold_from_scanner)
    low, high = (
        prepared.reference.origin_mm,
        prepared.reference.origin_mm
        + prepared.reference.spacing_mm * (np.array(prepared.reference.heights_mm.shape[::-1]) - 1),
    )
    out = []
    for hole in found.unseen.holes:
        begin, end = np.maximum(hole.box[0], low), np.minimum(hole.box[1], high)
        if (begin >= end).any():
            out.append(False)
            continue
        x, y = np.meshgrid(*(np.arange(b + 0.5 * _STEP_MM, e, _STEP_MM) for b, e in zip(begin, end, strict=True)))
        xy = np.column_stack([x.ravel(), y.ravel()])
        points = product(np.column_stack([xy, prepared.reference.height(xy)]) - pose[:3, 3], pose[:3, :3])
        column = np.rint(image.f * points[:, 0] / points[:, 2] + image.cx)
        row = np.rint(image.f * points[:, 1] / points[:, 2] + image.cy)
        inside = (column >= 0) & (row >= 0) & (column < image.width) & (row < image.height)
        hidden = np.count_nonzero(mask[row[inside].astype(int), column[inside].astype(int)]) * _STEP_MM**2
        out.append(bool(hidden >= _LEAST_SHARE * hole.area))
    return tuple(out)
