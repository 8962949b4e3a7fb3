"""Fringe patterns for the projector."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats
from debulk.scanner.inputs import checked_periods, checked_pixels, checked_steps, one_of

Direction = Literal["vertical", "horizontal", "both"]


def fringe_patterns(
    pixels: tuple[int, int] = (1920, 1080),
    periods: Sequence[int] = (50, 51),
    steps: int = 6,
    direction: Direction = "vertical",
) -> NDArray[np.uint8]:
    """Make the images that the projector shows.

    Step k at N periods shows 127.5 (1 + cos(phase + 2π k / steps)), rounded. The phase = 2π N u grows from 0 over the
    projector's width for vertical fringes (over its height for horizontal ones), with u = (column + 1/2) / width. The
    triangulation needs vertical fringes, across the rows of two cameras that are side by side.

    Parameters
    ----------
    pixels
        The projector's width and height.
    periods
        Numbers of fringes over the width: two to six different ones without a common divisor. If they are close
        together, like 50 and 51, both measure finely; the sharper the images, the more periods are worthwhile.
    steps
        Number of steps for each number of periods, 3 or more. With six or more, the second harmonic, which a
        projector's gamma causes, does not affect the phase.
    direction
        "vertical", "horizontal", or "both" (vertical ones first).

    Returns
    -------
    NDArray[np.uint8]
        (n, H, W): all steps of the first number of periods, then those of the second, and so on.

    Raises
    ------
    debulk.InputError
        If an argument is out of its range.

    Examples
    --------
    >>> patterns = fringe_patterns((1920, 1080))
    >>> patterns.shape, int(patterns[0, 0, 0]), int(patterns[3, 0, 0])
    ((12, 1080, 1920), 255, 0)
    """
    numbers, count = checked_periods(periods), checked_steps(steps, periods)

    def lines(u: Floats) -> Floats:
        phase = 2 * np.pi * np.asarray(numbers)[:, None, None] * u
        return 127.5 * (1 + np.cos(phase + 2 * np.pi * np.arange(count)[:, None] / count)).reshape(-1, len(u))

    return spread(pixels, direction, lines)


def spread(pixels: tuple[int, int], direction: str, lines: Callable[[Floats], Floats]) -> NDArray[np.uint8]:
    """Return images (n, H, W) whose lines along or across, (n, W) or (n, H), a function gives of places from 0 to 1."""
    width, height = checked_pixels(pixels)
    one_of("direction", direction, ("vertical", "horizontal", "both"))
    parts = []
    for across in ("vertical", "horizontal") if direction == "both" else (direction,):
        length = width if across == "vertical" else height
        grey = np.rint(lines((np.arange(length) + 0.5) / length)).astype(np.uint8)
        part = grey[:, None, :] if across == "vertical" else grey[:, :, None]
        parts.append(np.broadcast_to(part, (len(grey), height, width)))
    return np.concatenate(parts)
