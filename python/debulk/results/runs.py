"""The runs of the fibre lines that are too long, as a part of the report."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from debulk.fibre import FibreRuns
from debulk.results.record import Kinds, Numbers, PointsXY, Record, Stored, Values

Ends = Annotated[NDArray[np.uint8], Stored(np.uint8, None, 2)]


@dataclass(frozen=True, eq=False, kw_only=True)
class ExcessRuns(Record, FibreRuns):
    """All runs of those fibre lines of which one may make a ridge near the limit or above it; see `debulk.fibre`."""

    family: Kinds
    line: Numbers
    spans: Numbers
    from_mm: PointsXY
    to_mm: PointsXY
    top_mm: PointsXY
    gap_mm: Values
    length_mm: Values
    flat_mm: Values
    low_mm: Values
    excess_mm: Values
    high_mm: Values
    uncertainty_mm: Values
    turn_mm: Values
    ends: Ends
    beyond_mm: PointsXY
    pocket: Numbers
    """(N,) number of the pocket whose foot the run crosses, the largest if there are several; 0: none."""
    apart_mm: float
    """Distance of neighbouring lines."""
