"""How a pixel's grey values become the cell of a Gray code, and this and the wrapped phase the fringe order.

At the edge of a stripe the grey value lies between black and white and its bit is uncertain. Two cells that meet
differ in one image only, so a single uncertain bit leaves two cells, and the place is where they meet. The order is the
whole number for which order plus phase is closest to the place that the code gives. In a complementary code, where a
cell is half a period, the place is wrong by a quarter of a period at most, whether the bit of an edge is read as black
or white.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from debulk.arrays import Bools, Singles

_SURE = 0.25  # a sure bit is this far from the threshold, relative to half the step from black to white


@dataclass(frozen=True, eq=False)
class Code:
    """What the Gray images show: (n, ...) for n images, the widest stripes first."""

    bits: Bools
    """Whether the pixel is bright."""
    sure: Bools
    """Whether the pixel is clearly on one side of the threshold."""


def read_code(images: Singles, dark: Singles, bright: Singles) -> Code:
    """Read the bits of (n, ...) grey values between the grey values of black and of white stripes."""
    off, half = images - 0.5 * (dark + bright), 0.5 * np.abs(bright - dark)
    return Code(off > 0, np.abs(off) > _SURE * half)


def place_of(code: Code, cells: int) -> tuple[Singles, Bools]:
    """Place in periods that the code gives, and whether it is known; ``cells`` in each period."""
    count = len(code.bits)
    bit = np.zeros(code.bits.shape[1:], np.bool_)
    cell = np.zeros(bit.shape, np.int32)
    other = np.zeros(bit.shape, np.int32)
    for k in range(count):
        bit ^= code.bits[k]
        cell = 2 * cell + bit
        # To turn this image's bit changes all following bits of the cell's number.
        other = np.where(code.sure[k], other, (1 << (count - k)) - 1)
    unsure = count - code.sure.sum(axis=0, dtype=np.int32)
    other = cell ^ other
    meet = (unsure == 1) & (np.abs(other - cell) == 1)
    place = np.where(meet, np.maximum(cell, other), cell + np.float32(0.5))
    return (place / np.float32(cells)).astype(np.float32), (unsure == 0) | meet


def most_residual(cells: int) -> float:
    """Distance of a sure order from a whole number, at most: what half a cell allows, and a tenth for noise."""
    return min(0.5 / cells + 0.1, 0.46)


def order_of(place: Singles, turns: Singles) -> tuple[Singles, Singles]:
    """Fringe order, and the distance of place minus phase from it; ``turns`` is the wrapped phase, 0 to 1."""
    off = place - turns
    order = np.rint(off)
    return order, np.abs(off - order)
