"""Numbers and units as line segments, as a pen plotter writes them, because Open3D draws no text into a picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_WIDTH, _GAP = 0.55, 0.25  # width of a character and gap after it, over its height
# The seven segments of a digit, as (x, y) of both ends, with x in widths and y in heights; "m" and "." have their own.
_SEGMENTS = {
    "a": (0, 1, 1, 1), "b": (1, 1, 1, 0.5), "c": (1, 0.5, 1, 0), "d": (0, 0, 1, 0), "e": (0, 0, 0, 0.5),
    "f": (0, 0.5, 0, 1), "g": (0, 0.5, 1, 0.5),
}  # fmt: skip
_DIGITS = ("abcdef", "bc", "abged", "abgcd", "fgbc", "afgcd", "afgedc", "abc", "abcdefg", "gfabcd")
_SIGNS: dict[str, list[tuple[float, float, float, float]]] = {
    **{str(digit): [_SEGMENTS[name] for name in names] for digit, names in enumerate(_DIGITS)},
    "m": [(0, 0, 0, 0.55), (0, 0.55, 1, 0.55), (0.5, 0.55, 0.5, 0), (1, 0.55, 1, 0)],
    ".": [(0.4, 0, 0.6, 0)],
    " ": [],
}


def strokes(text: str) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
    """Return the strokes of a text of digits, points, blanks and "m".

    Returns
    -------
    (M, 2) ends of the strokes, x to the right from 0 and y up from 0 to 1; (M / 2, 2) pairs of ends that form a stroke.

    Examples
    --------
    >>> ends, pairs = strokes("1")
    >>> ends.tolist(), pairs.tolist()
    ([[0.55, 1.0], [0.55, 0.5], [0.55, 0.5], [0.55, 0.0]], [[0, 1], [2, 3]])
    """
    ends = [
        (k * (_WIDTH + _GAP) + _WIDTH * x, float(y))
        for k, sign in enumerate(text)
        for stroke in _SIGNS[sign]
        for x, y in (stroke[:2], stroke[2:])
    ]
    return np.array(ends).reshape(-1, 2), np.arange(len(ends), dtype=np.int32).reshape(-1, 2)
