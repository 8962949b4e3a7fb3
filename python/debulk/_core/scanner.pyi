"""Types of `debulk._core.scanner`."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk._core import Stop

_Image = NDArray[np.uint8] | NDArray[np.uint16]
_Planes = tuple[NDArray[np.float32], NDArray[np.float32] | None, NDArray[np.uint8]]
_Texture = tuple[NDArray[np.float32], NDArray[np.uint8], Sequence[float], NDArray[np.float32], NDArray[np.float32]]

patch_half: int
row_reach: int

def check_neighbours(
    phase: NDArray[np.float32], order_step: float, threads: int, widest: int, stop: Stop
) -> dict[str, int]: ...
def decode(
    images: Sequence[_Image],
    exposures: int,
    *,
    periods: Sequence[int],
    steps: int,
    saturated: float,
    noise: tuple[float, float],
    start: float,
    maps: dict[str, Any],
    threads: int,
    widest: int,
    stop: Stop,
    planes: _Planes | None = None,
) -> dict[str, int]: ...
def match(
    left: tuple[Any, ...],
    right: tuple[Any, ...],
    geometry: Sequence[float],
    maps: dict[str, Any],
    *,
    threads: int,
    widest: int,
    stop: Stop,
) -> dict[str, int]: ...
def row_shifts(
    places: Sequence[tuple[int, int]],
    step: int,
    points: NDArray[np.float32],
    depth_px: float,
    shift: float,
    left: _Texture,
    right: _Texture,
    *,
    threads: int,
    stop: Stop,
) -> list[tuple[bool, float, float]]: ...
def sensor_noise(
    images: Sequence[_Image], exposures: int, steps: int, saturated: float, threads: int, stop: Stop
) -> tuple[float, float]: ...
def take_in(
    images: Sequence[_Image],
    exposure: int,
    period: int,
    *,
    periods: Sequence[int],
    saturated: float,
    planes: _Planes,
    threads: int,
    widest: int,
    stop: Stop,
) -> None: ...
def take_out_blur(
    phase: NDArray[np.float32],
    modulation: NDArray[np.float32],
    exposure: NDArray[np.uint8],
    brightness: Sequence[float],
    variance_px2: float,
    threads: int,
    widest: int,
    stop: Stop,
) -> float: ...
def unwrap_stages(periods: Sequence[int]) -> tuple[list[tuple[int, list[int]]], float]: ...
