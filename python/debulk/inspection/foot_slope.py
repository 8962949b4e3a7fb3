"""The slope with which a pocket comes down to the mold at the outline of its foot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from debulk.grid import Grid

__all__ = ["foot_slope"]

Floats = NDArray[np.float64]

_SLOPE_MM = 1.5  # distance to either side over which the slope is taken
_PLACES = 64  # on the foot's outline, at most


def foot_slope(heights: Grid, outline: Floats) -> float:
    """Return the mean slope of the heights along an outline; 0 if it is not known anywhere on it."""
    off = max(1, round(_SLOPE_MM / heights.spacing_mm))
    places = outline[:: -(-len(outline) // _PLACES)]
    last = np.array(heights.values.shape[::-1]) - 1
    cells = np.rint((places - heights.origin_mm) / heights.spacing_mm).astype(np.intp)
    column, row = np.clip(cells, off, np.maximum(last - off, off)).T
    values = heights.values
    if (last < 2 * off).any():
        return 0.0
    rise = values[row, column + off] - values[row, column - off], values[row + off, column] - values[row - off, column]
    slopes = np.hypot(*rise) / (2 * off * heights.spacing_mm)
    known = slopes[np.isfinite(slopes)]
    return float(known.mean()) if known.size else 0.0
