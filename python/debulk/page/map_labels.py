"""Places the pockets' numbers on the map so that none covers another."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def labels(
    outlines: list[NDArray[np.float64]],
    font: float,
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    arrows: Sequence[NDArray[np.float64]] = (),
) -> list[tuple[float, float, str]]:
    """Put a number inside a large pocket, and beside a small one where it covers the others least.

    `arrows` are (2, 2) ends of lines that are not to be covered either.
    """
    boxes = [np.concatenate([outline.min(axis=0), outline.max(axis=0)]) for outline in outlines]
    along = np.linspace(0.0, 1.0, 8)[:, None]
    dots = [dot for a, b in arrows for dot in a + along * (b - a)]
    taken = [*boxes, *(np.concatenate([dot - 0.25 * font, dot + 0.25 * font]) for dot in dots)]
    places = []
    for own in boxes:
        middle = 0.5 * (own[:2] + own[2:])
        if (own[2:] - own[:2]).min() > 2.4 * font:
            spots = [(middle[0], middle[1], "middle")]
        else:
            spots = [
                (own[2] + 0.4 * font, middle[1], "start"),
                (own[0] - 0.4 * font, middle[1], "end"),
                (middle[0], own[3] + 0.8 * font, "middle"),
                (middle[0], own[1] - 0.8 * font, "middle"),
            ]
        costs = []
        for x, y, anchor in spots:
            box = label_box(x, y, anchor, font)
            inside = np.clip(box, [*low, *low], [*high, *high])
            outside = np.prod(box[2:] - box[:2]) - np.prod(inside[2:] - inside[:2])
            others = [other for other in taken if len(spots) == 1 or other is not own]
            costs.append(2 * float(outside) + sum(overlap(box, other) for other in others))
        x, y, anchor = spots[int(np.argmin(costs))]
        taken.append(label_box(x, y, anchor, font))
        places.append((float(x), float(-y + 0.35 * font), anchor))
    return places


def label_box(x: float, y: float, anchor: str, font: float) -> NDArray[np.float64]:
    """Return the (4,) lower and upper corners of a label such as "12 ✓"."""
    width = 2.6 * font
    left = {"start": x, "end": x - width, "middle": x - 0.5 * width}[anchor]
    return np.array([left, y - 0.55 * font, left + width, y + 0.55 * font])


def overlap(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Area that two boxes, each (4,) lower and upper corners, share."""
    size = np.minimum(a[2:], b[2:]) - np.maximum(a[:2], b[:2])
    return float(np.prod(np.maximum(size, 0.0)))
