"""Where the predicted ridges of a pocket run, read from its net."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from debulk.results.report import PocketReport

__all__ = ["ridge_lines"]

_SPARE_MM = 0.02  # gaps this far above the laid ply belong to ridges or bridges


def ridge_lines(pocket: PocketReport) -> tuple[NDArray[np.float64], ...]:
    """Return the ridges' lines, mold XY.

    Parameters
    ----------
    pocket
        Of a report. A pocket without a minimum has no lines, for nothing says where its ridges stand.

    Returns
    -------
    tuple of (M, 2) arrays
        Pieces from peak to peak of neighbouring sections; a peak without a neighbour is a single point.
    """
    net, feet, coarse, post = pocket.net, pocket.debulked_mm, pocket.debulked_gap_mm, pocket.post_processed_gap_mm
    if net is None or feet is None or coarse is None or post is None or not post.size:
        return ()
    # A node that bridges a hollow keeps the coarse net's gap; the others lie on the mold or top a ridge.
    peaks = (post > post.min() + _SPARE_MM) & (post != coarse)
    pieces, joined = [], np.zeros(len(post), dtype=bool)
    for a, b in _neighbours(net.neighbours, peaks):
        pieces.append(feet[[a, b], :2])
        joined[[a, b]] = True
    alone = [feet[[k], :2] for k in np.flatnonzero(peaks & ~joined)]
    return (*pieces, *alone)


def _neighbours(neighbours: NDArray[np.int32], peaks: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Pairs of peaks one segment apart, and those across a cell without a peak that leads from one to the other."""
    pairs = []
    for node in np.flatnonzero(peaks).tolist():
        east, _, north, south = (int(n) for n in neighbours[node])
        pairs += [(node, side) for side in (east, north) if side >= 0 and peaks[side]]
        for turn in (2, 3):  # the corners to the north-east and to the south-east
            side = (north, south)[turn - 2]
            corner = int(neighbours[east, turn]) if east >= 0 else -1
            if corner >= 0 and peaks[corner] and not peaks[east] and not (side >= 0 and peaks[side]):
                pairs.append((node, corner))
    return pairs
