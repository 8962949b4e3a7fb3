"""How sure a median is, and standard deviations by medians and quartiles, for normally distributed values."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats

OF_MEDIAN = 1.4826  # standard deviation over the median of the absolute deviations
OF_QUARTILES = 1 / 1.349  # standard deviation over the distance between the quartiles
ERROR = 1.2533  # standard error of a median times the root of the count, over the standard deviation
SURE = 2.0  # standard errors by which something is off for sure


def error(between_quartiles: Floats | float, count: NDArray[np.int64] | int) -> Floats:
    """Return the standard error of medians of so many values, from the distance between the values' quartiles."""
    return np.asarray(ERROR * OF_QUARTILES * between_quartiles / np.sqrt(count))


def with_error(values: Floats) -> tuple[float, float]:
    """Return the median of values (N,), and by how much it may be off."""
    low, middle, high = (float(v) for v in np.quantile(values, [0.25, 0.5, 0.75]))
    return middle, SURE * float(error(high - low, len(values)))
