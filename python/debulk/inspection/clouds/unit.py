"""Whether a scan is in another unit than its reference: its size is then off by just the factor between the units."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from debulk.arrays import Floats
from debulk.results.finding import Reason

_UNITS = {"micrometres": 0.001, "centimetres": 10.0, "inches": 25.4, "decimetres": 100.0, "metres": 1000.0}


@dataclass(frozen=True)
class Limits:
    """Of a scan in another unit; bench/trust/setups.py gives clouds in inches, centimetres and metres."""

    factor_share: float = 0.15  # of the factor: ply and reference are not seen from exactly the same place


LIMITS = Limits()


def unit_reason(points_mm: Floats, wide: Floats) -> Reason | None:
    """Return which other unit (N, 3) points of a scan, all finite, are likely to be in; None if there is no sign.

    A scan whose size differs by such a factor from that of the reference, which is (2,) mm wide, shows far too little
    of the ply in any case.
    """
    if not len(points_mm):
        return None
    low, high = np.array([np.percentile(points_mm[:, axis], [1, 99]) for axis in (0, 1)]).T  # faster than along an axis
    ratio = float(np.hypot(*wide) / max(1e-9, np.hypot(*(high - low))))
    for unit, factor in _UNITS.items():
        if abs(ratio / factor - 1) < LIMITS.factor_share:
            what = (
                f"the scan is {high[0] - low[0]:.3g} by {high[1] - low[1]:.3g} mm and the reference {wide[0]:.4g} by "
                f"{wide[1]:.4g} mm: is the scan in {unit}?"
            )
            return Reason(f"{what} Multiply its points by {factor:g}", f"multiply the scan's points by {factor:g}")
    return None
