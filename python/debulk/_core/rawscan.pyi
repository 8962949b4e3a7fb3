"""Types of the compiled module `debulk._core.rawscan`."""

from collections.abc import Sequence

from numpy.typing import ArrayLike

from debulk._core import Stop, _Bound, _Bytes, _Floats, _Made, _Options
from debulk._core.pocket import Foot, FootMap
from debulk._core.surface import Reference, Surface

class QuietLimits(_Made):
    @property
    def told(self) -> bool: ...
    @property
    def stepped(self) -> bool: ...
    @property
    def step_mm(self) -> float: ...
    @property
    def scatter_mm(self) -> float: ...

square_side: int

def quiet_limits(
    scan: ArrayLike, step: int, squares: ArrayLike, axes: ArrayLike, threads: int, stop: Stop
) -> list[QuietLimits]: ...
def quiet_squares(scan: ArrayLike, step: int, limits: Sequence[QuietLimits], threads: int, stop: Stop) -> _Bytes: ...

class WrinkleOptions(_Options):
    widest_mm: float
    links: int
    most: int

class NarrowBumpOptions(_Options):
    most: int

class WrinkleFinder(metaclass=_Bound):
    def __init__(
        self,
        reference: Reference,
        seen: tuple[ArrayLike, ArrayLike, float],
        mold_from_scanner: ArrayLike,
        ply_outline: ArrayLike,
        threads: int,
    ) -> None: ...
    def find(
        self, scan: ArrayLike, mask: ArrayLike | None, pitch_mm: float, options: WrinkleOptions, stop: Stop
    ) -> tuple[list[tuple[_Floats, float, float]], bool]: ...
    def find_bumps(
        self, scan: ArrayLike, mask: ArrayLike | None, pitch_mm: float, options: NarrowBumpOptions, stop: Stop
    ) -> tuple[list[list[float]], bool]: ...

def riders(
    points: ArrayLike, pitch_mm: float, feet: FootMap, foot: Foot, reference: Surface, stop: Stop
) -> list[list[float]]: ...
