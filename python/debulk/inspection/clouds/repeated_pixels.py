"""Whether an image of points was enlarged by repeating pixels, as the option "nearest" of many programs does.

Its points then lie in heaps, and the outlier filter, which compares distances, takes all of them away.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["REPEATED", "repeated_reason", "repeated_share"]

REPEATED = 0.6  # 0.75 if every pixel became 2 by 2 pixels; 0.5 if only rows or columns were doubled, which does no harm
_ROWS = 16  # looked at
_COLUMNS = 7  # one of so many is looked at: an odd number, so that pixels of every place in a block are among them


def repeated_share(scan: NDArray[np.float32]) -> float:
    """Return the share of the pixels that hold the same point as the next one to the right or below, bit for bit.

    Only some rows and columns are looked at. Pixels in which nothing was seen do not count; points without an order
    have no share.

    Examples
    --------
    >>> image = np.arange(300, dtype=np.float32).reshape(10, 10, 3)
    >>> repeated_share(image), repeated_share(image.repeat(2, axis=0).repeat(2, axis=1)) > 0.6
    (0.0, True)
    """
    if scan.ndim != 3 or min(scan.shape[:2]) < 2:
        return 0.0
    rows = np.linspace(0, scan.shape[0] - 2, _ROWS).astype(np.intp)
    rows = np.minimum(rows // 2 * 2 + np.arange(_ROWS) % 2, scan.shape[0] - 2)  # even and odd ones in turn
    columns = np.arange(0, scan.shape[1] - 1, _COLUMNS)
    here, right, below = (scan[np.ix_(rows + down, columns + on)] for down, on in ((0, 0), (0, 1), (1, 0)))
    same = (here == right).all(axis=2) | (here == below).all(axis=2)
    seen = np.isfinite(here).all(axis=2)
    return float(same.sum() / max(1, seen.sum()))


def repeated_reason(share: float) -> str:
    """Say that the pixels are repeated, and what to give instead."""
    return (
        f"of the scan's pixels {100 * share:.0f} % hold the same point as a neighbour, bit for bit: its image was "
        "enlarged by repeating pixels; give the scan in the resolution in which it was taken"
    )
