"""From fringe images to absolute phases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core
from debulk.arrays import Singles
from debulk.scanner.faults import refuse_faults
from debulk.scanner.inputs import InputError, Stack, checked_periods, checked_stack, checked_steps

NO_EXPOSURE = 255
"""In `Phase.exposure`: every exposure is saturated."""


@dataclass(frozen=True, eq=False)
class Planes:
    """What was taken of a camera's images while they arrived; pixels in groups of sixteen."""

    best: Singles
    """(2 + numbers of periods, pixels), of each pixel's brightest exposure so far without saturation."""
    coming: Singles | None
    """(1 + numbers of periods, pixels), of the exposure whose images arrive; None if there is only one."""
    exposure: NDArray[np.uint8]
    """(pixels,) exposures in ``best``."""
    white: int
    """Greatest grey value, as assumed while images were missing."""

    @property
    def arrays(self) -> tuple[Singles, Singles | None, NDArray[np.uint8]]:
        """The arrays as the core takes them."""
        return self.best, self.coming, self.exposure


@dataclass(frozen=True, eq=False)
class Phase:
    """Values that a camera's fringe images give for each pixel. Maps are (H, W) in the original image."""

    phase_rad: Singles = field(repr=False)
    """Absolute phase for the first number of periods N, growing by 2π N over the projector's field, from 0 or the start
    phase on, made from all numbers of periods; NaN where the pixel is dark or saturated, or its fringe order is
    doubtful."""
    noise_rad: Singles = field(repr=False)
    """Standard deviation of the phase due to the sensor's noise; NaN where the pixel is not lit. The ripple that a
    projector's gamma leaves with few steps is no part of it: both cameras see the same one, so it cancels in depth."""
    modulation: Singles = field(repr=False)
    """Amplitude of the fringes in grey values of the chosen exposure, averaged over the numbers of periods."""
    exposure: NDArray[np.uint8] = field(repr=False)
    """Index of the exposure that was chosen; 255 where all are saturated."""
    offset: Singles | None = field(default=None, repr=False)
    """Mean grey value, if requested."""
    order_residual: Singles | None = field(default=None, repr=False)
    """Distance of the fringe order from a whole number, 0 to 0.5; at 0.5 the next order would have been as likely. NaN
    where the pixel is not lit."""
    brightness: tuple[float, ...] = (1.0,)
    """Brightness of each exposure relative to the shortest."""
    sensor_noise: tuple[float, float] = (1.0, 0.0)
    """Variance of a grey value: the first number plus the second times the grey value."""
    blur_px: float = 0.0
    """Standard deviation of the lens blur whose effect on the phases was removed."""
    periods: tuple[int, ...] = ()
    """Numbers of fringes over the field; the phase refers to the first."""
    start_phase_rad: float = 0.0
    """Phase at the field's edge, the same for all numbers of periods. 0 for the patterns of `fringe_patterns`; other
    projectors begin with another step or show sines."""
    counts: Mapping[str, int] = field(default_factory=dict)
    """Numbers of pixels: ``lit``; of those ``doubtful`` (the beat leaves the order uncertain), of which ``repaired``
    with the help of neighbouring pixels; ``isolated`` (phase unlike their neighbours', removed); ``saturated`` in every
    exposure; and of grey values ``read``."""


def decode(
    images: ArrayLike | Sequence[Any],
    periods: Sequence[int] = (50, 51),
    steps: int = 6,
    *,
    bits: int | None = None,
    sensor_noise: tuple[float, float] | None = None,
    blur_px: float | None = None,
    start_phase_rad: float | None = None,
    threads: int = 0,
) -> Phase:
    """Decode the fringe images of one camera, taken with one or several exposures.

    Grey values follow I_k = offset + modulation cos(phase + 2π k / steps), k = 0, 1, ...: phase = 2π N u for N
    periods over the projector's field 0 <= u < 1, as `fringe_patterns` makes them. Each pixel takes its brightest
    exposure that is not saturated in any step, and its fringe order from the beat of the numbers of periods (heterodyne
    unwrapping).

    Parameters
    ----------
    images
        (n, H, W) or (E, n, H, W), uint8 or uint16, shortest exposure first; or sequences of (H, W) arrays, which need
        not be contiguous with one another. All steps of the first number of periods come first, then those of the
        second, and so on.
    periods
        Numbers of fringes over the field.
    steps
        Number of steps for each number of periods.
    bits
        Bits of the sensor; its greatest grey value counts as saturated. None: 8 for uint8, 12 for uint16.
    sensor_noise
        Variance of a grey value, (a, b) for a + b · value, as measured for the camera. None: estimated from the highest
        harmonic of the images, which contains no fringe; what a projector's gamma adds to it is fitted and taken out.
    blur_px
        Standard deviation of the lens blur, at most 1. Where the brightness changes across the fringes, a blurred phase
        shifts towards the brighter side, by blur² ∇phase · ∇ln(modulation), and this shift is removed. None: estimated
        from how the phase follows the texture. 0: not removed.
    start_phase_rad
        Phase at the field's edge, if the projector's patterns begin there with another one than 0, the same for all
        numbers of periods: I_k = offset + modulation cos(phase + start + 2π k / steps). None: estimated from the fringe
        orders, which are whole with the right one only; an estimate of less than 0.13 is taken for 0. It is needed for
        the orders alone and stays part of the phase, so its error does not matter; but give the second camera that of
        the first, ``left.start_phase_rad``, lest one be estimated near 6.03 and the other a turn below, near -0.25.
    threads
        Number of threads; 0 means as many as the process may use. The result does not depend on it.

    Returns
    -------
    Phase
        Phase with modulation, offset, noise, exposure and order residual.

    Raises
    ------
    debulk.InputError
        If images are not as expected, or are spoiled: one is missing, repeated, swapped or differently exposed, a lamp
        flickers, or the number of steps or periods is another. The message names which images.

    Examples
    --------
    >>> u = (np.arange(640) + 0.5) / 640
    >>> k = np.arange(6)[:, None]
    >>> lines = [120 + 100 * np.cos(2 * np.pi * (n * u + k / 6)) for n in (50, 51)]
    >>> images = np.rint(np.concatenate(lines))[:, None, :].repeat(8, axis=1).astype(np.uint8)
    >>> phase = decode(images)
    >>> bool(np.abs(phase.phase_rad[4] - 2 * np.pi * 50 * u).max() < 0.01)
    True
    """
    numbers, count, blur = checked_periods(periods), checked_steps(steps, periods), checked_blur(blur_px)
    stack, stop = checked_stack(images, count * len(numbers), bits=bits), _core.Stop()
    noise = noise_of(stack, count, sensor_noise, threads, stop)
    start = refuse_faults(stack, numbers, count, noise, checked_start(start_phase_rad))
    maps = empty_maps(stack.shape, "offset", "residual")
    return decode_into(maps, stack, numbers, count, noise, start, blur, threads, stop)


def empty_maps(shape: tuple[int, int], *more: str) -> dict[str, Any]:
    """Return memory for the maps that every decoding makes, and for more of them."""
    maps: dict[str, Any] = {name: np.empty(shape, np.float32) for name in ("phase", "noise", "modulation", *more)}
    return maps | {"exposure": np.empty(shape, np.uint8)}


def checked_blur(blur_px: float | None) -> float | None:
    """Check the standard deviation of a lens's blur."""
    if blur_px is not None and not 0 <= blur_px <= 1:
        raise InputError(f"blur_px: expected 0 to 1 pixel, or None for an estimate, but got {blur_px!r}")
    return blur_px


def checked_start(start_phase_rad: float | None) -> float | None:
    """Check a start phase and convert it to turns, from -0.04 to 0.96 like the estimates."""
    if start_phase_rad is None:
        return None
    if not np.isfinite(start_phase_rad):
        raise InputError(f"start_phase_rad: expected an angle in radians, or None, but got {start_phase_rad!r}")
    return float((start_phase_rad / (2 * np.pi) + 0.04) % 1.0 - 0.04)


def noise_of(
    stack: Stack, steps: int, sensor_noise: tuple[float, float] | None, threads: int, stop: _core.Stop
) -> tuple[float, float]:
    """Check the sensor's noise, or estimate it from the images."""
    if sensor_noise is not None:
        return checked_noise(sensor_noise)
    return _core.scanner.sensor_noise(list(stack.images), stack.exposures, steps, float(stack.white), threads, stop)


def checked_noise(sensor_noise: tuple[float, float]) -> tuple[float, float]:
    """Check the sensor's noise."""
    if not (len(sensor_noise) == 2 and sensor_noise[0] >= 0 and sensor_noise[1] >= 0 and sum(sensor_noise) > 0):
        raise InputError(
            f"sensor_noise: expected (a, b), not negative, for the variance a + b · value, but got {sensor_noise!r}"
        )
    return float(sensor_noise[0]), float(sensor_noise[1])


def decode_into(
    maps: dict[str, Any],
    stack: Stack,
    periods: tuple[int, ...],
    steps: int,
    noise: tuple[float, float],
    start: float,
    blur_px: float | None,
    threads: int,
    stop: _core.Stop,
    widest: int = 4,
    planes: Planes | None = None,
) -> Phase:
    """Decode into memory that the caller keeps; ``widest``: 2, 3 or 4 for SSE4, AVX2 or AVX-512 at most."""
    counts = _core.scanner.decode(
        list(stack.images),
        stack.exposures,
        periods=list(periods),
        steps=steps,
        saturated=float(stack.white),
        noise=noise,
        start=start,
        maps=maps,
        threads=threads,
        widest=widest,
        stop=stop,
        planes=None if planes is None or planes.white != stack.white else planes.arrays,
    )
    return phase_of(maps, stack, periods, noise, 2 * np.pi * start, blur_px, counts, threads, stop, widest)


def phase_of(
    maps: dict[str, Any],
    stack: Stack,
    periods: tuple[int, ...],
    noise: tuple[float, float],
    start_rad: float,
    blur_px: float | None,
    counts: Mapping[str, int],
    threads: int,
    stop: _core.Stop,
    widest: int = 4,
) -> Phase:
    """Remove the blur from a decoded phase, and return it with all maps."""
    brightness = stack.brightness()
    light = maps["modulation"], maps["exposure"], brightness
    given = -1.0 if blur_px is None else blur_px**2
    variance = _core.scanner.take_out_blur(maps["phase"], *light, given, threads, widest, stop)
    return Phase(
        maps["phase"],
        maps["noise"],
        maps["modulation"],
        maps["exposure"],
        maps.get("offset"),
        maps.get("residual"),
        brightness,
        noise,
        float(np.sqrt(variance)),
        periods,
        start_rad,
        counts,
    )
