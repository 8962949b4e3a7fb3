"""Types of the compiled module `debulk._core.cloud`."""

from numpy.typing import ArrayLike

from debulk._core import Stop, _Bytes, _Flags, _Floats, _Options, _Singles

class OutlierOptions(_Options):
    neighbours: int
    std_ratio: float
    least_ratio: float

def bounds(points: ArrayLike, threads: int) -> tuple[int, list[float], list[float]]: ...
def transform(points: ArrayLike, matrix: ArrayLike, threads: int, stop: Stop) -> _Singles: ...
def points_over(
    points: ArrayLike,
    matrix: _Floats | None,
    box: _Floats,
    marks: list[tuple[_Flags, _Floats, float]],
    threads: int,
    stop: Stop,
) -> tuple[_Singles, _Bytes]: ...
def fit_pinhole(points: ArrayLike, /) -> tuple[float, float, float] | None: ...
def median_pitch(points: ArrayLike, threads: int, stop: Stop) -> float: ...
def widest_pitch(points: ArrayLike, pitch: float, stop: Stop) -> float: ...
def fourth_differences(
    heights: _Singles,
    points: _Singles,
    step: int,
    axes: tuple[tuple[float, float, float], ...],
    threads: int,
    stop: Stop,
) -> tuple[_Singles, _Bytes]: ...
def made_points(
    apart: _Singles, copied: _Flags, on_ply: _Flags, step_mm: float, limits: object, threads: int, stop: Stop
) -> tuple[bool, bool, _Bytes, _Bytes]: ...
def remove_outliers(
    points: ArrayLike,
    options: OutlierOptions,
    threads: int,
    stop: Stop,
    camera: tuple[float, float, float] | None = None,
) -> _Bytes: ...
def move_kept(points: _Singles, out: _Singles, keep: _Bytes, matrix: ArrayLike, threads: int, stop: Stop) -> None: ...
