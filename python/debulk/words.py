"""Words that many sentences share: areas, places, and pockets by their numbers."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

Place = tuple[float, float]


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


def in_mm(*places_mm: Sequence[float] | NDArray[np.floating]) -> str:
    """Return a place in the mold's frame in words, or several, one after the other.

    Examples
    --------
    >>> in_mm((12.3, -4.0)), in_mm((0, 0), (50, 0))
    ('(12, -4) mm', '(0, 0) to (50, 0) mm')
    """
    return f"{' to '.join(f'({x:.0f}, {y:.0f})' for x, y in places_mm)} mm"


def xy_of(values: NDArray[np.floating]) -> Place:
    """Return a place (2,), or the x and y of one (3,), as a report keeps it: two plain numbers."""
    return float(values[0]), float(values[1])


def pocket_names(numbers: Iterable[int]) -> str:
    """Name pockets by their numbers.

    Examples
    --------
    >>> pocket_names([2]), pocket_names([1, 3])
    ('pocket 2', 'pockets 1, 3')
    """
    each = [str(number) for number in numbers]
    return f"pocket{'s' * (len(each) > 1)} {', '.join(each)}"
