"""Figures as text."""

from __future__ import annotations

HIGHEST_MM = 25.0
"""Air lifts no ply so high: what stands higher is a clamp, a tool or the mold; an upper end above it bounds nothing."""


def number(value: float | None, digits: int) -> str:
    """Return a figure with the given number of decimals, or a dash if there is none.

    Examples
    --------
    >>> number(0.125, 1), number(-0.001, 2), number(None, 2)
    ('0.1', '0.00', '–')
    """
    # Adding zero turns the -0.0 that rounding makes of a tiny negative figure into 0.0.
    return "–" if value is None else f"{round(value, digits) + 0.0:.{digits}f}"


def span(ends: tuple[float, float]) -> str:
    """Return lowest and highest height in mm, or one figure if they are the same when rounded.

    Examples
    --------
    >>> span((0.2, 0.5)), span((0.201, 0.204)), span((0.2, 5358.26))
    ('0.20 to 0.50', '0.20', '0.20 or more')
    """
    low, high = (number(height, 2) for height in ends)
    if ends[0] <= HIGHEST_MM < ends[1]:
        return f"{low} or more"
    return low if low == high else f"{low} to {high}"
