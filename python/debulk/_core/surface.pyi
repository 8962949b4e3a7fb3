"""Types of the compiled module `debulk._core.surface`."""

from typing import overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk._core import Stop, _Bound, _Bytes, _Floats, _Made, _Options, _Singles
from debulk._core.cloud import OutlierOptions

class FitOptions(_Options):
    node_spacing_mm: float
    window_mm: float
    robust: float
    doublings: int

class FrontEndOptions(_Options):
    outliers: OutlierOptions
    spacing_mm: float
    jump_ratio: float
    hole_diameter_mm: float
    spike_mm: float
    median_cells: int

class FrontEnd(metaclass=_Bound):
    def __init__(
        self,
        reference: Reference,
        shape: tuple[int, int],
        camera: tuple[float, float, float] | None,
        mold_from_scanner: ArrayLike,
        box: tuple[float, ...],
        options: FrontEndOptions,
        threads: int,
        seen: tuple[ArrayLike, ArrayLike, float] | None,
    ) -> None: ...
    def keep(self, shape: tuple[int, int]) -> NDArray[np.uint8]: ...
    def run(
        self, scan: ArrayLike, stop: Stop
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8], NDArray[np.float32] | None, NDArray[np.float64], float]: ...
    @property
    def blur_mm2(self) -> float: ...
    @property
    def fast(self) -> bool: ...
    @property
    def times(self) -> list[float]: ...

class Reference(Surface):
    def __init__(self, heights_mm: ArrayLike, origin_mm: ArrayLike, spacing_mm: float) -> None: ...
    def _height(self, xy: ArrayLike) -> _Floats: ...
    def _gradient(self, xy: ArrayLike) -> _Floats: ...
    def _hessian(self, xy: ArrayLike) -> _Floats: ...
    @property
    def heights_mm(self) -> _Floats: ...
    @property
    def origin_mm(self) -> _Floats: ...
    @property
    def spacing_mm(self) -> float: ...

class Surface(_Made): ...

def covering_grid(low_mm: ArrayLike, high_mm: ArrayLike, spacing_mm: float) -> tuple[_Floats, tuple[int, int]]: ...
def fit_reference(
    values: ArrayLike,
    origin_mm: ArrayLike,
    spacing_mm: float,
    options: FitOptions,
    under_ply: ArrayLike,
    threads: int,
    stop: Stop,
) -> tuple[_Floats, _Floats, float]: ...
def datum(reference: Reference, thickness_mm: float, threads: int) -> _Floats: ...
def above_cliffs(values: ArrayLike, origin_mm: ArrayLike, spacing_mm: float, threads: int, stop: Stop) -> _Bytes: ...
def misfits(
    values: ArrayLike, origin_mm: ArrayLike, spacing_mm: float, reference: Reference, threads: int, stop: Stop
) -> _Bytes: ...
def grid_heights(
    points: ArrayLike,
    origin_mm: ArrayLike,
    spacing_mm: float,
    shape: tuple[int, int],
    jump_ratio: float,
    pitch_mm: float,
    threads: int,
    stop: Stop,
) -> _Singles: ...
@overload
def height_map(
    scan: ArrayLike,
    reference: Reference,
    spacing_mm: float,
    hole_diameter_mm: float,
    jump_ratio: float,
    threads: int,
    stop: Stop,
) -> tuple[_Singles, _Bytes, _Floats, float]: ...
@overload
def height_map(
    scan: ArrayLike,
    reference: ArrayLike,
    spacing_mm: float,
    hole_diameter_mm: float,
    jump_ratio: float,
    threads: int,
    stop: Stop,
) -> tuple[_Singles, _Bytes, _Floats, float]: ...
def bridged(heights: ArrayLike, unknown: ArrayLike, levelling: float, stop: Stop) -> _Singles | None: ...
def extent(surface: Reference) -> _Floats: ...
def median(values: ArrayLike, size: int, threads: int) -> _Singles: ...
def row_medians(values: ArrayLike, cells: int, threads: int) -> _Singles: ...
def without_spikes(values: ArrayLike, tolerance_mm: float, threads: int) -> _Singles: ...
