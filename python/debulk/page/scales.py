"""Colours and round figures that map, nets, sections and charts share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

_LEAST_MM = 0.1  # least range of the colours: below it, noise would look like pockets
_DEEPEST = (0x78, 0xEB, 0xFF)  # colour of the lowest height: cyan, which no height above the reference has
# Below the limit blue, above it orange, which colour-blind people tell apart.
_BELOW, _ABOVE = ((0xE3, 0xEC, 0xF7), (0x4C, 0x7F, 0xB8)), ((0xF7, 0xA8, 0x55), (0x7F, 0x2A, 0x04))
_APART = 11.0  # least distance of figures on the key, percent of its width


def colours(count: int) -> list[str]:
    """Return that many hexadecimal colours of cividis, which reads the same to colour-blind people and in grey."""
    return _hexadecimal(_cividis(count))


def ridge_colours(count: int = 256) -> list[str]:
    """Return the colours of a scale of ridges from 0 to twice the limit; it changes at the limit, in its middle."""
    return _hexadecimal(np.vstack([_ramp(*ends, count // 2) for ends in (_BELOW, _ABOVE)]))


def _hexadecimal(table: NDArray[np.uint8]) -> list[str]:
    return [f"#{r:02x}{g:02x}{b:02x}" for r, g, b in table.tolist()]


def _cividis(count: int) -> NDArray[np.uint8]:
    ramp = np.linspace(0, 255, count).round().astype(np.uint8).reshape(-1, 1)
    return np.asarray(cv2.applyColorMap(ramp, cv2.COLORMAP_CIVIDIS).reshape(-1, 3)[:, ::-1], dtype=np.uint8)


def _ramp(first: Sequence[float], last: Sequence[float], count: int) -> NDArray[np.uint8]:
    share = np.linspace(0.0, 1.0, count)[:, None]
    mixed = (1 - share) * np.array(first, dtype=np.float64) + share * np.array(last, dtype=np.float64)
    return np.asarray(np.rint(mixed), dtype=np.uint8)


def nice(step: float) -> float:
    """Return the next larger of 1, 2, 5, 10 ..., or the step itself if it is one of them."""
    power = 10.0 ** math.floor(math.log10(step))
    return float(next(power * k for k in (1, 2, 5, 10) if power * k >= step * 0.999))


class HeightScale(NamedTuple):
    """Scale from heights to colours by the square root, so that a ridge of 0.6 mm shows beside a pocket of 15 mm.

    A pocket with a twenty-fifth of the highest one's height still gets a fifth of the colours. Heights below the
    reference have colours of their own, by the same rule: a millimetre below is as far from 0 as one above.
    """

    top_mm: float
    lowest_mm: float = 0.0

    @classmethod
    def up_to(cls, top_mm: float, lowest_mm: float = 0.0) -> HeightScale:
        """Return the scale whose last colour represents this height, and whose key begins at the lowest height."""
        top_mm = max(top_mm, _LEAST_MM)
        return cls(top_mm, max(lowest_mm, -top_mm) if lowest_mm <= -_LEAST_MM else 0.0)

    @staticmethod
    def table() -> NDArray[np.uint8]:
        """Return the (511, 3) colours, red, green and blue, from the deepest to the highest; 0 mm is in the middle."""
        above = _cividis(256)
        return np.vstack([_ramp(_DEEPEST, above[0].tolist(), 256)[:-1], above])

    def paint(self, heights_mm: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
        """Return the colours of heights, red, green and blue in the last axis."""
        share = np.clip(heights_mm / self.top_mm, -1, 1)
        levels = (255 * np.sign(share) * np.sqrt(np.abs(share))).round().astype(np.int16)
        painted: NDArray[np.uint8] = self.table()[levels + 255]
        return painted

    def stops(self, count: int = 24) -> list[str]:
        """Return colours at equal distances along the key."""
        first = round(255 - 255 * math.sqrt(-self.lowest_mm / self.top_mm))
        return _hexadecimal(self.table()[np.linspace(first, 510, count).round().astype(int)])

    def ticks(self) -> list[tuple[float, str]]:
        """Return positions on the key in percent of its width, and their heights in mm."""
        round_mm = [m * 10.0**power for power in range(-1, 4) for m in (1, 2, 5)]
        below = [-mm for mm in reversed(round_mm) if -mm > self.lowest_mm]
        every = [self.lowest_mm, *below, 0.0] if self.lowest_mm else [0.0]
        every += [mm for mm in round_mm if mm < self.top_mm] + [self.top_mm]
        start = -math.sqrt(-self.lowest_mm)

        def at(mm: float) -> float:
            return 100 * (math.copysign(math.sqrt(abs(mm)), mm) - start) / (math.sqrt(self.top_mm) - start)

        kept: list[float] = []
        for mm in [0.0, self.top_mm, *every]:  # 0 and the top always have their figures, others if there is room
            if len(kept) < 2 or all(abs(at(mm) - at(other)) >= _APART for other in kept):
                kept.append(mm)
        return [(at(mm), f"{mm:.{3 if mm > 0 else 1}g}".replace("-", "−")) for mm in sorted(kept)]
