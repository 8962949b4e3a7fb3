"""How firmly the flat ply sticks while it is reworked, and what a hand or a suction cup can hold."""

from __future__ import annotations

import math
from dataclasses import dataclass

from debulk._core import InputError


@dataclass(frozen=True)
class Handling:
    """What is known of the hand or the gripper that moves the ply, before the vacuum is drawn.

    Raises
    ------
    InputError
        If a figure is not positive, or not finite.

    Examples
    --------
    >>> Handling(hold_n=4 * 42).stick_mpa
    0.001
    """

    hold_n: float = 42.0
    """Force along the ply that can be held, N. The default is that of one suction cup 60 mm wide at 60 kPa, with the
    friction of 0.5 and the safety of 2 that makers of cups calculate with (docs/rework.md)."""
    stick_mpa: float = 0.001
    """Shear stress at which the flat ply slides on what lies below it, MPa, in addition to the friction of its own
    weight. The default is an assumption: pull a strip of your ply over the mold with a spring balance, and divide the
    force by its area."""

    def __post_init__(self) -> None:
        for name in ("hold_n", "stick_mpa"):
            value = getattr(self, name)
            if not (isinstance(value, (int, float)) and 0 < value < math.inf):
                raise InputError(f"{name}: expected a positive number, got {value!r}")
