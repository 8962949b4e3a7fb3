"""The holes that the mask causes: under a clamp that the user has masked, another scan would show no pocket either."""

from __future__ import annotations

import numpy as np

from debulk.inspection.clouds.products import product
from debulk.inspection.ply.setup import Setup
from debulk.pocket import UnseenHole

_STEP_MM = 2.0
_LEAST_SHARE = 0.7  # of a hole's area; pixels at a tool's edge are often missing in addition to the masked ones


def is_masked(hole: UnseenHole, setup: Setup) -> bool:
    """Return whether the mask hides most of a hole; not without a camera, which relates mask and mold."""
    image, mask, reference, pose = setup.prepared.image, setup.mask, setup.prepared.reference, setup.pose
    if image is None or mask is None or mask.shape != image.shape:
        return False
    low, high = reference.box_mm
    begin, end = np.maximum(hole.box[0], low), np.minimum(hole.box[1], high)
    if (begin >= end).any():
        return False
    x, y = np.meshgrid(*(np.arange(b + 0.5 * _STEP_MM, e, _STEP_MM) for b, e in zip(begin, end, strict=True)))
    xy = np.column_stack([x.ravel(), y.ravel()])
    points = product(np.column_stack([xy, reference.height(xy)]) - pose[:3, 3], pose[:3, :3])
    column = np.rint(image.f * points[:, 0] / points[:, 2] + image.cx)
    row = np.rint(image.f * points[:, 1] / points[:, 2] + image.cy)
    inside = (column >= 0) & (row >= 0) & (column < image.width) & (row < image.height)
    hidden = np.count_nonzero(mask[row[inside].astype(int), column[inside].astype(int)]) * _STEP_MM**2
    return bool(hidden >= _LEAST_SHARE * hole.area)
