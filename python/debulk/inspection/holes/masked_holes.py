"""The holes that the mask causes: under a clamp that the user has masked, a better scan would show no pocket either."""

from __future__ import annotations

import numpy as np

from debulk.inspection.clouds.products import product
from debulk.inspection.find.found import Found
from debulk.inspection.ply.setup import Setup

_STEP_MM = 2.0
_LEAST_SHARE = 0.7  # of a hole's area; pixels at a tool's edge are often missing in addition to the masked ones


def masked_holes(found: Found, setup: Setup) -> tuple[bool, ...]:
    """Return for each hole whether the mask hides most of it.

    It is False without a mask, and without a camera, which relates mask and mold.
    """
    image, mask, reference, pose = setup.prepared.image, setup.mask, setup.prepared.reference, setup.pose
    low, high = reference.box_mm
    if image is None or mask is None or mask.shape != image.shape:
        return (False,) * len(found.unseen.holes)
    out = []
    for hole in found.unseen.holes:
        begin, end = np.maximum(hole.box[0], low), np.minimum(hole.box[1], high)
        if (begin >= end).any():
            out.append(False)
            continue
        x, y = np.meshgrid(*(np.arange(b + 0.5 * _STEP_MM, e, _STEP_MM) for b, e in zip(begin, end, strict=True)))
        xy = np.column_stack([x.ravel(), y.ravel()])
        points = product(np.column_stack([xy, reference.height(xy)]) - pose[:3, 3], pose[:3, :3])
        column = np.rint(image.f * points[:, 0] / points[:, 2] + image.cx)
        row = np.rint(image.f * points[:, 1] / points[:, 2] + image.cy)
        inside = (column >= 0) & (row >= 0) & (column < image.width) & (row < image.height)
        hidden = np.count_nonzero(mask[row[inside].astype(int), column[inside].astype(int)]) * _STEP_MM**2
        out.append(bool(hidden >= _LEAST_SHARE * hole.area))
    return tuple(out)
