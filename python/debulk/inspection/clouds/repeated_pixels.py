"""Whether points are repeated: in an enlarged image, as the option "nearest" of many programs does, or in a list.

Its points then lie in heaps, and the outlier filter, which compares distances, takes all of them away.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Limits:
    """Of repeated points; `tests/python/inspection/test_repeated_pixels.py` enlarges images and repeats lists."""

    share: float = 0.6  # 0.75 if every pixel became 2 by 2; 0.5 if only rows or columns were doubled: that does no harm


LIMITS = Limits()
_POINTS = 20_000  # of a list that are looked at
_ROWS = 16  # looked at
_COLUMNS = 7  # one of so many is looked at: an odd number, so that pixels of every place in a block are among them


def repeated_share(scan: NDArray[np.float32]) -> float:
    """Return the share of the pixels that hold the same point as the next one to the right or below, bit for bit.

    Only some rows and columns are looked at. Pixels in which nothing was seen do not count. In a list of points it is
    the share of the points that are copies; only the points of some values of x are looked at.

    Examples
    --------
    >>> image = np.arange(300, dtype=np.float32).reshape(10, 10, 3)
    >>> repeated_share(image), repeated_share(image.repeat(2, axis=0).repeat(2, axis=1)) > 0.6
    (0.0, True)
    """
    if scan.ndim == 2:
        return _again_share(scan)
    if scan.ndim != 3 or min(scan.shape[:2]) < 2:
        return 0.0
    rows = np.linspace(0, scan.shape[0] - 2, _ROWS).astype(np.intp)
    rows = np.minimum(rows // 2 * 2 + np.arange(_ROWS) % 2, scan.shape[0] - 2)  # even and odd ones in turn
    columns = np.arange(0, scan.shape[1] - 1, _COLUMNS)
    here, right, below = (scan[np.ix_(rows + down, columns + on)] for down, on in ((0, 0), (0, 1), (1, 0)))
    same = (here == right).all(axis=2) | (here == below).all(axis=2)
    seen = np.isfinite(here).all(axis=2)
    return float(same.sum() / max(1, seen.sum()))


def _again_share(points: NDArray[np.float32]) -> float:
    """Return the share of (N, 3) points that are copies of another one, estimated from some 20 000 of them."""
    some = max(1, len(points) // _POINTS)
    # A hash of x takes all copies of a point or none of them, whatever their order, and also where x was rounded.
    of_x = np.ascontiguousarray(points[:, 0], dtype=np.float32).view(np.uint32) * np.uint32(2654435761)
    few = points[(of_x >> np.uint32(8)) % np.uint32(some) == 0]
    few = few[np.isfinite(few).all(axis=1)]
    return 1 - len(np.unique(few, axis=0)) / len(few) if len(few) else 0.0


def repeated_reason(share: float, *, image: bool) -> str:
    """Say that the points are repeated, and what to give instead."""
    if not image:
        return (
            f"{100 * share:.0f} % of the scan's points are copies of another point, bit for bit: each is there about "
            f"{1 / (1 - share):.0f} times; give each point once, or look which clouds were put together"
        )
    return (
        f"of the scan's pixels {100 * share:.0f} % hold the same point as a neighbour, bit for bit: its image was "
        "enlarged by repeating pixels; give the scan in the resolution in which it was taken"
    )
