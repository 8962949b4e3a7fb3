"""How sure a median is, and standard deviations by medians and quartiles, for normally distributed values."""

from __future__ import annotations

OF_MEDIAN = 1.4826  # standard deviation over the median of the absolute deviations
OF_QUARTILES = 1 / 1.349  # standard deviation over the distance between the quartiles
ERROR = 1.2533  # standard error of a median times the root of the count, over the standard deviation
SURE = 2.0  # standard errors by which something is off for sure
