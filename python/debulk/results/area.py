"""Areas as text."""

from __future__ import annotations

import numpy as np


def in_cm2(area_mm2: float, digits: int = 2) -> str:
    """Return an area with its unit, in so many digits, but never with an exponent.

    Examples
    --------
    >>> in_cm2(361.2), in_cm2(16_049.0), in_cm2(16_149.0, digits=3), in_cm2(0.004), in_cm2(0.0)
    ('3.6 cm²', '160 cm²', '161 cm²', '0.00004 cm²', '0 cm²')
    """
    cm2 = area_mm2 / 100
    rounded = round(cm2) if cm2 >= 10**digits else float(f"{cm2:.{digits}g}")
    return f"{np.format_float_positional(rounded, trim='-')} cm²"
