"""The excess of a pocket's fibres that its net misses: what the filters take away, and what lies beyond the foot."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from debulk import _core
from debulk.grid import Grid
from debulk.inspection.found import FoundPocket
from debulk.net import Net
from debulk.surface import Reference

__all__ = ["filtered_once_more", "missed_share", "tail_mm"]

Floats = NDArray[np.float64]

# Blur of the heights by gridding and the 3 by 3 median, as a variance in squares of their spacing: a quarter comes from
# the kernel of the gridding (surface/image_gridding.hpp), a half from the median's effect on a round crest.
_BLUR = 0.75
_LONGEST_TAIL_MM = 20.0


def missed_share(found: FoundPocket, laid: Net, reference: Reference) -> float:
    """Return by what share the largest excess of a fibre may exceed the value from its net.

    A filter that keeps cubics and loses a share of narrow features loses nearly the same share when it is applied again
    (Tukey's twicing), so filtering the filtered heights shows the loss. For round bells with 0.85 mm of excess and
    heights 0.5, 0.8 and 1.2 mm apart, the loss estimated in this way is 0.04 to 0.09 mm if the foot is 25 mm wide (0.05
    to 0.12 mm were missing), 0.01 to 0.05 mm if it is 35 mm wide (0.02 to 0.04 mm were missing), and up to 0.01 mm from
    80 mm on (nothing was missing).

    The ply is taken to lie on the mold where it is lower than the mold tolerance. A parabola that comes down to the
    mold from that height with a slope s has an excess of tolerance * s / 3; the net extends one spacing beyond, and
    includes a part of it.
    """
    nodes = np.array(laid.nodes_mm)
    before_mm = _core.ridge.largest_fibre_excess(nodes, laid.neighbours, reference)
    if before_mm <= 0:
        return 0.0
    nodes[:, 2] += filtered_once_more(found.feet.heights, nodes[:, :2], found.feet.smooth_mm)
    after_mm = _core.ridge.largest_fibre_excess(nodes, laid.neighbours, reference)
    ends_mm = 2 * found.feet.mold_tol_mm * found.foot_slope / 3
    return max(0.0, 1 - after_mm / before_mm) + ends_mm / before_mm


def tail_mm(found: FoundPocket) -> float:
    """Return how far beyond the outline of a pocket's foot its ply touches down on the mold.

    A parabola that comes down from the mold tolerance with a slope s touches down 2 * tolerance / s away.
    """
    twice_mm = 2 * found.feet.mold_tol_mm
    return twice_mm / max(found.foot_slope, twice_mm / _LONGEST_TAIL_MM)


def filtered_once_more(heights: Grid, xy: Floats, smooth_mm: float) -> Floats:
    """Return by how much filtering once more raises the heights at these places; 0 if a window is not all known."""
    half = max(1, round(smooth_mm / (2 * heights.spacing_mm)))
    cells = np.rint((xy - heights.origin_mm) / heights.spacing_mm).astype(np.intp)
    fits = ((cells >= half) & (cells < np.array(heights.values.shape[::-1]) - half)).all(axis=1)
    lifted = np.zeros(len(xy))
    if not fits.any():  # no cell fits, for example, if the grid is smaller than a window
        return lifted
    column, row = cells[fits].T
    side = 2 * half + 1
    windows = sliding_window_view(heights.values, (side, side))[row - half, column - half]
    lifted[fits] = np.nan_to_num(np.einsum("nij,ij->n", windows, _weights(half)) - heights.values[row, column])
    return lifted


def _weights(half: int) -> Floats:
    """Return the weights a + b r^2 of a quadratic fit to blurred heights: sum 1, second moments those of the blur."""
    squares = np.arange(-half, half + 1.0) ** 2
    n, second, fourth = len(squares), squares.sum(), (squares**2).sum()
    s0, s2, s4 = n * n, n * second, n * fourth + second * second
    b = (_BLUR * s0 - s2) / (s0 * s4 - 2 * s2 * s2)
    a = (1 - 2 * b * s2) / s0
    weights: Floats = a + b * (squares[:, None] + squares)
    return weights
