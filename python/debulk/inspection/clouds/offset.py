"""A scan raised by a rigid offset."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk.inspection.clouds.cleaning import pieces


def raised(
    scan: NDArray[np.float32],
    mold_from_scanner: NDArray[np.float64] | None,
    offset_mm: float,
    *,
    along_rays: bool,
    stop: _core.Stop | None = None,
) -> NDArray[np.float32]:
    """Return a copy of a scan in the scanner's frame whose points lie higher in the mold's frame, along its z.

    `along_rays` keeps each point on its pixel's ray, as the points of a pinhole camera must be. It then also moves
    sideways, by the offset times the tangent of the ray's angle to z.

    >>> scan = np.array([[0.0, 300.0, 1000.0]], dtype=np.float32)
    >>> raised(scan, np.diag([1.0, -1.0, -1.0, 1.0]), 1.0, along_rays=True).tolist()
    [[0.0, 299.70001220703125, 999.0]]
    """
    up = np.array([0.0, 0.0, 1.0]) if mold_from_scanner is None else mold_from_scanner[2, :3]
    out = np.empty_like(scan)
    for points, moved in zip(pieces(scan, "scan", stop), pieces(out, "scan"), strict=True):
        if not along_rays:
            np.add(points, (offset_mm * up).astype(np.float32), out=moved)
            continue
        with np.errstate(invalid="ignore", divide="ignore"):
            rise = points[..., 0] * up[0] + points[..., 1] * up[1] + points[..., 2] * up[2]
            moved[...] = points * (1 + offset_mm / rise)[..., None]
    return out
