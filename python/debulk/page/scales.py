"""Colours and round figures that map, nets, sections and charts share."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ["HeightScale", "colours", "nice"]

_LEAST_MM = 0.1  # least range of the colours: below it, noise would look like pockets
_APART = 9.0  # least distance of figures on the key, percent of its width


def colours(count: int) -> list[str]:
    """Return that many hexadecimal colours of cividis, which reads the same to colour-blind people and in grey."""
    ramp = np.linspace(0, 255, count).round().astype(np.uint8).reshape(-1, 1)
    table = cv2.applyColorMap(ramp, cv2.COLORMAP_CIVIDIS).reshape(-1, 3)
    return [f"#{r:02x}{g:02x}{b:02x}" for b, g, r in table.tolist()]


def nice(step: float) -> float:
    """Return the next larger of 1, 2, 5, 10 ..., or the step itself if it is one of them."""
    power = 10.0 ** math.floor(math.log10(step))
    return float(next(power * k for k in (1, 2, 5, 10) if power * k >= step * 0.999))


class HeightScale(NamedTuple):
    """Scale from heights to colours by the square root, so that a ridge of 0.6 mm shows beside a pocket of 15 mm.

    A pocket with a twenty-fifth of the highest one's height still gets a fifth of the colours.
    """

    top_mm: float

    @classmethod
    def up_to(cls, top_mm: float) -> HeightScale:
        """Return the scale whose last colour represents this height."""
        return cls(max(top_mm, _LEAST_MM))

    def levels(self, heights_mm: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
        """Return the numbers of the colours, 0 to 255."""
        share = np.clip(heights_mm / self.top_mm, 0, 1)
        levels: NDArray[np.uint8] = (255 * np.sqrt(share)).round().astype(np.uint8)
        return levels

    def ticks(self) -> list[tuple[float, str]]:
        """Return positions on the key in percent of its width, and their heights in mm."""
        round_mm = [m * 10.0**power for power in range(-1, 4) for m in (1, 2, 5)]
        chosen = [(0.0, "0")]
        for height in [h for h in round_mm if h < self.top_mm] + [self.top_mm]:
            at = 100 * math.sqrt(height / self.top_mm)
            last = height == self.top_mm
            if last and len(chosen) > 1 and at - chosen[-1][0] < _APART:
                chosen.pop()
            if last or at - chosen[-1][0] >= _APART:
                chosen.append((at, f"{height:.3g}"))
        return chosen
