"""The excess of a laid net's fibres: of whole fibres held at both ends, or of pieces within a sliding window."""

from __future__ import annotations

import numpy as np
from folds import fibres, mold_feet, mold_length

from debulk import net, surface


def largest(laid: net.Net, reference: surface.Reference, window_mm: float | None = None, held: bool = True) -> float:
    """Return the largest excess of a fibre, mm; 0 if no fibre is longer than its mold.

    Parameters
    ----------
    laid
        The net before the vacuum is drawn.
    reference
        The mold.
    window_mm
        Count only a piece of the fibre of at most this length, at the place where it gives the most; None means the
        whole fibre.
    held
        Count only fibres with a fixed node at both ends.
    """
    feet, _ = mold_feet(laid.nodes_mm, reference)
    found = 0.0
    for fibre in (0, 1):
        for line in fibres(laid.neighbours, fibre):
            if held and not (laid.kinds[line[[0, -1]]] == 1).all():
                continue
            segments = len(line) - 1
            if window_mm is None or window_mm >= segments * laid.spacing_mm:
                found = max(found, laid.spacing_mm * segments - _base(feet, line, reference))
            else:
                found = max(found, _windowed(feet, line, laid.spacing_mm, window_mm, reference))
    return found


def _base(feet: np.ndarray, line: np.ndarray, reference: surface.Reference) -> float:
    return mold_length(feet[line[0]], feet[line[-1]], len(line) - 1, reference)


def _windowed(
    feet: np.ndarray, line: np.ndarray, spacing: float, window_mm: float, reference: surface.Reference
) -> float:
    """Return the largest excess of a piece of one fibre: whole segments and fractions of them that fill the window."""
    count = len(line) - 1
    over = np.array([spacing - _base(feet, line[k : k + 2], reference) for k in range(count)])
    summed = np.concatenate([[0.0], np.cumsum(over)])
    at = np.arange(count + 1, dtype=float)
    width = window_mm / spacing
    starts = np.concatenate([at[at + width <= count], at[at >= width] - width])
    return float((np.interp(starts + width, at, summed) - np.interp(starts, at, summed)).max())
