"""Types of the compiled module `debulk._core.fibre`."""

from typing import Any

from numpy.typing import ArrayLike, NDArray

from debulk._core import Stop, _Bound, _Bytes, _Floats, _Integers, _Made, _Options, _Singles
from debulk._core.pocket import FootMap, Segmentation
from debulk._core.surface import Reference

class FibreOptions(_Options):
    apart_mm: float
    blur_cells2: float
    draw_mm: float
    edge_cells: int
    fine_mm: float
    hold_mm: float
    mold_tol_mm: float
    step_mm: float
    thickness_mm: float
    threads: int

class FibreLines(_Made):
    def __len__(self) -> int: ...

class Heights(metaclass=_Bound):
    def __init__(self, values: ArrayLike, origin_mm: ArrayLike, spacing_mm: float) -> None: ...

class ExcessField(_Made):
    @property
    def columns(self) -> dict[str, NDArray[Any]]: ...
    @property
    def family(self) -> tuple[_Bytes, _Floats, float]: ...
    @property
    def flat_mm(self) -> float: ...
    @property
    def largest(self) -> tuple[_Singles, _Floats, float]: ...
    @property
    def noise_mm(self) -> float: ...
    @property
    def noise_per_mm(self) -> float: ...

def crossings(lines: FibreLines, field: ExcessField, feet: FootMap) -> _Integers: ...
def field_lines(
    angles_rad: ArrayLike,
    origin_mm: ArrayLike,
    spacing_mm: float,
    ply_outline: ArrayLike | None,
    box_mm: ArrayLike,
    options: FibreOptions,
    stop: Stop,
) -> FibreLines: ...
def measure_excess(
    lines: FibreLines,
    heights: Segmentation | Heights,
    mold: Reference,
    whole: bool,
    options: FibreOptions,
    stop: Stop,
) -> ExcessField: ...
def straight_lines(
    angles_rad: ArrayLike, ply_outline: ArrayLike | None, box_mm: ArrayLike, options: FibreOptions
) -> FibreLines: ...
