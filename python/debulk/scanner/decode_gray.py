"""From fringe images of one number of periods and a Gray code to absolute phases."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core
from debulk.arrays import Singles
from debulk.scanner.decode import NO_EXPOSURE, Phase, checked_blur, checked_noise, empty_maps, phase_of
from debulk.scanner.gray_code import Code, most_residual, order_of, place_of
from debulk.scanner.gray_faults import fault_of_code, neighbours
from debulk.scanner.gray_images import GrayLight, GrayStacks, checked_gray_stacks
from debulk.scanner.gray_patterns import checked_gray_periods
from debulk.scanner.inputs import InputError

C64 = NDArray[np.complex64]

_CONTRAST = 5.0  # a lit pixel's modulation exceeds this many standard deviations of a grey value
_MOST_MISFIT = 0.05  # of harmonics that only misplaced images cause, over the modulation
_STRIP = 64  # rows that are decoded together
_LINES = 48  # rows, and columns, that are looked at for faults
_LEAST = 400  # lit pixels that are needed for a judgement
_OUTSIDE = 0.05  # periods by which noise may take a phase across the field's border


def decode_gray(
    images: ArrayLike | Sequence[Any],
    gray_images: ArrayLike | Sequence[Any],
    periods: int = 64,
    steps: int = 6,
    *,
    inverted: ArrayLike | Sequence[Any] | None = None,
    white_black: ArrayLike | Sequence[Any] | None = None,
    start_rad: float = 0.0,
    bits: int | None = None,
    sensor_noise: tuple[float, float] | None = None,
    blur_px: float | None = None,
    threads: int = 0,
) -> Phase:
    """Decode the images of one camera of fringes and a Gray code, as `gray_patterns` makes them.

    The wrapped phase comes from the fringes, I_k = offset + modulation cos(phase + 2π k / steps), and its order from
    the Gray code, which numbers cells of half a period (complementary code) or of a period. At the edges of stripes a
    bit may be read either way: in a complementary code both lead to the same order. Where an order is in doubt, the
    neighbouring pixels decide; otherwise the pixel has no phase.

    Parameters
    ----------
    images
        (n, H, W) or (E, n, H, W) images of the fringes, n = ``steps``, as in `decode`.
    gray_images
        Images of the stripes with the same exposures, the widest stripes first. One more than the periods need means a
        complementary code, such as 7 for 64 periods.
    periods
        Number of fringes over the field.
    steps
        Number of steps.
    inverted
        Images of the same stripes, black for white. A bit is then the sign of the difference.
    white_black
        An image without stripes in white and one in black. Their mean is then the threshold. If neither is given, the
        mean of the fringes is; a strong gamma of the projector moves it.
    start_rad
        Phase of the fringes where the code's periods begin, such as π for patterns that begin with black. The phase
        that is returned counts from 0 there.
    bits, sensor_noise, blur_px, threads
        As in `decode`. With three steps the sensor's noise cannot be estimated, and ``noise_rad`` is NaN if it is not
        given.

    Returns
    -------
    Phase
        As from `decode`. The order residual is the distance of order plus phase from the middle of the code's cell, in
        periods.

    Raises
    ------
    debulk.InputError
        If images are not as expected, or are spoiled: one is missing, in the place of another or black for white, the
        code's images begin with the narrowest stripes, or the fringes begin elsewhere. The message names what is wrong.

    Examples
    --------
    >>> from debulk.scanner import gray_patterns
    >>> patterns = gray_patterns((1024, 32), periods=32, steps=6) // 2 + 20
    >>> phase = decode_gray(patterns[:6], patterns[6:], periods=32)
    >>> u = (np.arange(1024) + 0.5) / 1024
    >>> bool(np.abs(phase.phase_rad[4] - 2 * np.pi * 32 * u).max() < 0.05)
    True
    """
    count, moves = checked_gray_periods(periods, steps)
    stacks = checked_gray_stacks(images, gray_images, inverted, white_black, count, moves, bits)
    if not np.isfinite(start_rad):
        raise InputError(f"start_rad: expected a phase in rad, but got {start_rad!r}")
    given = None if sensor_noise is None else checked_noise(sensor_noise)
    blur, start, stop = checked_blur(blur_px), float(start_rad) / (2 * np.pi), _core.Stop()
    estimated = _refuse_faults(stacks, start)
    known = given or estimated
    noise = known or (1.0, 0.0)  # only to tell what is lit

    maps = empty_maps(stacks.fringes.shape, "offset", "residual")
    lit, doubtful = 0, 0
    for row in range(0, len(maps["phase"]), _STRIP):
        rows = slice(row, row + _STRIP)
        light = stacks.light(rows)
        here = _decode(light, stacks.cells, count, start, noise) | {"exposure": light.exposure}
        lit += int(np.count_nonzero(np.isfinite(here["noise"])))
        doubtful += int(np.count_nonzero(here["phase"] < 0))
        for name, part in here.items():
            maps[name][rows] = part
    beside = _core.scanner.check_neighbours(maps["phase"], 2 * np.pi, threads, 4, stop)
    if known is None:
        maps["noise"][:] = np.nan
    saturated = int(np.count_nonzero(maps["exposure"] == NO_EXPOSURE))
    counts = {"lit": lit, "doubtful": doubtful, **beside, "saturated": saturated}
    return phase_of(maps, stacks.fringes, (count,), noise, float(start_rad), blur, counts, threads, stop)


def _decode(light: GrayLight, cells: int, periods: int, start: float, noise: tuple[float, float]) -> dict[str, Singles]:
    """Decode some pixels; a phase whose order is in doubt is stored as -1 - phase, as the core does."""
    first, offset = light.first_harmonic(), light.fringes.mean(axis=0)
    modulation = np.abs(first)
    relative = np.sqrt(noise[0] + noise[1] * offset) / np.maximum(modulation, 1e-30)
    usable = light.exposure != NO_EXPOSURE
    lit = usable & (relative * _CONTRAST < 1)
    turns = ((np.angle(first) / (2 * np.pi) - start) % 1.0).astype(np.float32)
    place, known = place_of(light.read_code(modulation, offset), cells)
    order, residual = order_of(place, turns)
    total = order + turns
    sure = known & (residual <= most_residual(cells)) & (total >= -_OUTSIDE) & (total <= periods + _OUTSIDE)
    phase = 2 * np.pi * np.clip(total, 0, periods)
    steps = len(light.fringes)
    return {
        "phase": np.where(lit, np.where(sure, phase, -1 - phase), np.nan).astype(np.float32),
        "noise": np.where(lit, relative * np.sqrt(2 / steps), np.nan).astype(np.float32),
        "modulation": np.where(usable, modulation, np.nan).astype(np.float32),
        "offset": np.where(usable, offset, np.nan).astype(np.float32),
        "residual": np.where(lit, residual, np.nan).astype(np.float32),
    }


def _refuse_faults(stacks: GrayStacks, start: float) -> tuple[float, float] | None:
    """Raise an InputError that names a fault; otherwise return the sensor's noise, None if it cannot be estimated."""
    seen, noise = [], None
    for across in (False, True):  # the stripes may run either way
        size = stacks.fringes.shape[across]
        lines = np.unique(np.linspace(0, size - 1, _LINES, dtype=int))
        light = stacks.light((slice(None), lines) if across else lines)
        first, offset = light.first_harmonic(), light.fringes.mean(axis=0)
        modulation = np.abs(first)
        lit = (light.exposure != NO_EXPOSURE) & (modulation > max(2.0, 0.01 * stacks.fringes.white))
        if noise is None:
            noise = _noise_of(light, first, offset, lit)
        code = light.read_code(modulation, offset)
        turns = (np.angle(first) / (2 * np.pi)).astype(np.float32) % 1.0
        if across:
            code, turns, lit = Code(code.bits.swapaxes(1, 2), code.sure.swapaxes(1, 2)), turns.T, lit.T
        seen.append(neighbours(code, turns, lit))
    found = fault_of_code(max(seen, key=lambda pairs: pairs.ends), stacks.cells, start)
    if found:
        raise InputError(f"gray_images: {found}")
    return noise


def _noise_of(light: GrayLight, first: C64, offset: Singles, lit: NDArray[np.bool_]) -> tuple[float, float] | None:
    """Estimate the sensor's noise (a, b) from the harmonics that neither the fringes nor a gamma of theirs contain.

    A gamma gives harmonics whose phase is a multiple of the fringes', the same for all pixels relative to the
    modulation. Misplaced images give harmonics with the phase of the fringes themselves. Both are fitted and taken out.
    """
    steps = len(light.fringes)
    if steps < 4 or np.count_nonzero(lit) < _LEAST:
        return None
    size = np.abs(first[lit])
    unit = first[lit] / size
    left, weight, misfit = np.zeros(size.shape), 0.0, 0.0
    for order in range(2, steps // 2 + 1):
        shape = np.stack(
            [unit**order, np.conj(unit) ** (steps - order), unit, np.conj(unit), offset[lit] / size], axis=1
        )
        value = light.harmonic(order)[lit] / size
        fit, *_ = np.linalg.lstsq(shape.astype(np.complex128), value.astype(np.complex128), rcond=1e-6)
        left += np.abs(value - shape @ fit) ** 2 * size**2
        weight += 1 / steps if 2 * order == steps else 4 / steps
        misfit += float(np.abs(fit[2]) ** 2 + np.abs(fit[3]) ** 2)
    if np.sqrt(misfit) > _MOST_MISFIT:
        raise InputError(
            f"images: the fringes do not follow {steps} steps: harmonics that they do not have are "
            f"{np.sqrt(misfit):.2f} of the modulation; an image is missing, repeated or in the place of another, or "
            f"steps are not those of the projector"
        )
    variance, grey = left / weight, offset[lit]
    ends = np.quantile(grey, np.linspace(0, 1, 9))
    bins = np.clip(np.searchsorted(ends, grey, side="right") - 1, 0, 7)
    means = []
    for k in range(8):
        here = variance[bins == k]
        if len(here) >= 20:
            means.append((float(grey[bins == k].mean()), float(here[here <= np.quantile(here, 0.99)].mean())))
    x, y = np.array(means).T
    gain = float(np.polyfit(x, y, 1)[0]) if np.ptp(x) > 5 else 0.0
    gain = min(max(gain, 0.0), float(y.mean() / x.mean()))
    return float(max(np.mean(y - gain * x), 0.0)) + 1e-6, gain
