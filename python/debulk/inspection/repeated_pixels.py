"""Whether an image of points was enlarged by repeating pixels, as the option "nearest" of many programs does.

Its points then lie in heaps, and the outlier filter, which compares distances, takes all of them away.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["REPEATED", "repeated_reason", "repeated_share"]

REPEATED = 0.6  # 0.75 if every pixel became 2 by 2 pixels; 0.5 if only rows or columns were doubled, which does no harm
_ROWS = 16  # looked at


def repeated_share(scan: NDArray[np.float32]) -> float:
    """Return the share of the pixels that hold the same point as the next one to the right or below, bit for bit.

    Only some rows are looked at. Pixels in which nothing was seen do not count; points without an order have no share.

    Examples
    --------
    >>> image = np.arange(300, dtype=np.float32).reshape(10, 10, 3)
    >>> repeated_share(image), repeated_share(image.repeat(2, axis=0).repeat(2, axis=1)) > 0.6
    (0.0, True)
    """
    if scan.ndim != 3 or min(scan.shape[:2]) < 2:
        return 0.0
    rows = np.unique(np.linspace(0, scan.shape[0] - 2, _ROWS).astype(np.intp))
    here, below = scan[rows], scan[rows + 1]
    same = (here[:, :-1] == here[:, 1:]).all(axis=2) | (here[:, :-1] == below[:, :-1]).all(axis=2)
    seen = np.isfinite(here[:, :-1]).all(axis=2)
    return float(same.sum() / max(1, seen.sum()))


def repeated_reason(share: float) -> str:
    """Say that the pixels are repeated, and what to give instead."""
    return (
        f"of the scan's pixels {100 * share:.0f} % hold the same point as a neighbour, bit for bit: its image was "
        "enlarged by repeating pixels; give the scan in the resolution in which it was taken"
    )
