"""Whether a scan is in another unit than its reference: too small by just that factor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from debulk.grid import Grid

__all__ = ["unit_reason"]

Floats = NDArray[np.float64]
_UNITS = {"centimetres": 10.0, "inches": 25.4, "decimetres": 100.0, "metres": 1000.0}
_NEAR = 0.15  # of the factor: ply and reference are not seen from quite the same place


def unit_reason(points_mm: Floats, seen: Grid) -> str:
    """Say which unit (N, 3) points of a scan, all finite, are likely to be in; empty where it may be the reference's.

    A scan that is smaller by such a factor shows far too little of the ply in any case.
    """
    rows, columns = np.nonzero(np.isfinite(seen.values))
    if not len(rows) or not len(points_mm):
        return ""
    wide = np.array([np.ptp(columns), np.ptp(rows)]) * seen.spacing_mm
    low, high = np.percentile(points_mm[:, :2], [1, 99], axis=0)
    ratio = float(np.hypot(*wide) / max(1e-9, np.hypot(*(high - low))))
    for unit, factor in _UNITS.items():
        if abs(ratio / factor - 1) < _NEAR:
            return (
                f"the scan is {high[0] - low[0]:.3g} by {high[1] - low[1]:.3g} mm and the reference {wide[0]:.4g} by "
                f"{wide[1]:.4g} mm: is the scan in {unit}? Multiply its points by {factor:g}"
            )
    return ""
