"""Areas as text."""

from __future__ import annotations

__all__ = ["in_cm2"]


def in_cm2(area_mm2: float, digits: int = 2) -> str:
    """Return an area with its unit, in so many digits, but never with an exponent.

    Examples
    --------
    >>> in_cm2(361.2), in_cm2(16_049.0), in_cm2(16_049.0, digits=3), in_cm2(0.04)
    ('3.6 cm²', '160 cm²', '160 cm²', '0.0004 cm²')
    """
    cm2 = area_mm2 / 100
    return f"{cm2:.0f} cm²" if cm2 >= 10**digits or cm2 == 0 else f"{float(f'{cm2:.{digits}g}'):.10g} cm²"
