"""Types of the compiled module `debulk._core.rawscan`."""

from collections.abc import Sequence

from numpy.typing import ArrayLike

from debulk._core import Stop, _Bytes, _Made

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
