"""Patterns of a Gray code beside fringes of one number of periods.

The field is divided into cells, which are numbered from 0. In image j, the stripes show bit j of each cell's Gray code,
the most significant bit first, so that from one cell to the next a single image changes. With one more image than the
periods need, a cell is half a period wide, and the code also changes in the middle of every period. This is the
complementary Gray code of Q. Zhang, X. Su, L. Xiang and X. Sun, "3-D shape measurement based on complementary Gray-code
light", Optics and Lasers in Engineering 50 (2012) 574-579.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from debulk.arguments import whole
from debulk.arrays import Floats
from debulk.scanner.inputs import MOST_IMAGES
from debulk.scanner.patterns import Direction, spread

MOST_PERIODS = 2048


def checked_gray_periods(periods: object, steps: object) -> tuple[int, int]:
    """Check the number of periods that a Gray code counts, and the number of steps."""
    return whole("periods", periods, 2, MOST_PERIODS), whole("steps", steps, 3, MOST_IMAGES)


def code_images(periods: int, cells: int) -> int:
    """Return the number of images that number the cells, ``cells`` of them in each period."""
    return (cells * periods - 1).bit_length()


def gray_patterns(
    pixels: tuple[int, int] = (1920, 1080),
    periods: int = 64,
    steps: int = 6,
    direction: Direction = "vertical",
    *,
    complementary: bool = True,
) -> NDArray[np.uint8]:
    """Make fringes of one number of periods, and the stripes of the Gray code that numbers the periods.

    Step k shows 127.5 (1 + cos(phase + 2π k / steps)), rounded, as in `fringe_patterns`. Stripes are 0 or 255, the
    widest first; a period begins where the phase is 0.

    Parameters
    ----------
    pixels
        The projector's width and height.
    periods
        Number of fringes over the width, 2 to 2048.
    steps
        Number of steps, 3 or more.
    direction
        "vertical", "horizontal", or "both" (vertical ones first).
    complementary
        Whether to show one more image, whose stripes also change in the middle of every period. Without it, the order
        is uncertain where a period begins, and pixels there are lost or depend on their neighbours.

    Returns
    -------
    NDArray[np.uint8]
        (n, H, W): the fringes' steps, then the Gray code. With "both", these for vertical fringes, then for horizontal.

    Raises
    ------
    debulk.InputError
        If an argument is out of its range.

    Examples
    --------
    >>> patterns = gray_patterns((1024, 768), periods=64, steps=6)
    >>> patterns.shape  # 6 steps, and 7 images for 128 cells of half a period
    (13, 768, 1024)
    >>> patterns[6:, 0, 0].tolist(), patterns[6:, 0, -1].tolist()
    ([0, 0, 0, 0, 0, 0, 0], [255, 0, 0, 0, 0, 0, 0])
    """
    count, moves = checked_gray_periods(periods, steps)
    cells = 2 if complementary else 1
    shifts = np.arange(code_images(count, cells))[::-1]

    def lines(u: Floats) -> Floats:
        turn = 2 * np.pi * (count * u + np.arange(moves)[:, None] / moves)
        cell = np.floor(cells * count * u).astype(np.int64)
        stripes = ((cell ^ (cell >> 1)) >> shifts[:, None]) & 1
        return np.concatenate([127.5 * (1 + np.cos(turn)), 255.0 * stripes])

    return spread(pixels, direction, lines)
