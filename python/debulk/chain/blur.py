"""What a blur by a Gaussian takes from narrow bumps, and how a strip or a ridge of known size shows that blur."""

from __future__ import annotations

from typing import Literal

import numpy as np

from debulk._core import InputError
from debulk.arrays import Floats
from debulk.chain.study import Transfer

Shape = Literal["strip", "ridge"]
_WIDTHS_MM = (4.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0)
_STEP_MM = 0.02
_LEAST_POINTS = 200


def transfer(sigma_mm: float) -> tuple[Transfer, ...]:
    """Return what is left of bumps H cos²(πx/w) of several widths after a blur of this sigma.

    The excess length of a low bump is the integral of half its slope's square, so its share depends on no height. The
    bump is a Fourier sum on a wide line, on which the blur multiplies by exp(-(k sigma)²/2).
    """
    out = []
    for width in _WIDTHS_MM:
        _, blurred = _section("ridge", width, sigma_mm, sigma_mm)
        left = excess_left(1.0, sigma_mm, width)
        out.append(Transfer(width_mm=width, height=float(blurred.max()), excess=left))
    return tuple(out)


def _section(shape: Shape, width_mm: float, sigma_mm: float, most_mm: float) -> tuple[Floats, Floats]:
    """Return places and heights (N,) of a gauge 1 mm high after a blur, on a line wide enough for one of `most_mm`."""
    reach = 4 * (width_mm + 6 * most_mm)
    x = np.arange(-reach, reach, _STEP_MM)
    whole = 1.0 if shape == "strip" else np.cos(np.pi * x / width_mm) ** 2
    section = np.where(np.abs(x) < width_mm / 2, whole, 0.0)
    wave = 2 * np.pi * np.fft.rfftfreq(len(x), _STEP_MM)
    return x, np.fft.irfft(np.fft.rfft(section) * np.exp(-((wave * sigma_mm) ** 2) / 2), len(x))


def excess_left(gain: float, sigma_mm: float, width_mm: float) -> float:
    """Return the share of a ridge's excess length that a blur of this sigma and a gain of heights leave."""
    before, after = (_section("ridge", width_mm, sigma, sigma_mm)[1] for sigma in (0.0, sigma_mm))
    return gain**2 * float(np.sum(np.diff(after) ** 2) / np.sum(np.diff(before) ** 2))


def strip_of(
    across_mm: Floats, height_mm: Floats, known_height_mm: float, width_mm: float, shape: Shape = "strip"
) -> tuple[float, float]:
    """Fit a strip or a ridge of known height and width, blurred by a Gaussian, to points across it.

    Places are (N,), 0 near its middle, with heights above what it lies on. Returned are its measured over its known
    height, and the sigma of the blur, mm; an `InputError` if too few points are there, none beside it, or it is not
    there.
    """
    from scipy.optimize import least_squares

    beside = np.abs(across_mm) > width_mm
    if len(across_mm) < _LEAST_POINTS or not beside.any() or beside.all():
        raise InputError(f"{shape}: expected {_LEAST_POINTS} points on and beside it, but got {len(across_mm)}")

    def misfit(guess: Floats) -> Floats:
        height, sigma, middle, level, slope = guess
        x, section = _section(shape, width_mm, min(abs(sigma), width_mm), width_mm)
        share = np.interp(across_mm - middle, x, section)
        return np.asarray(level + slope * across_mm + height * share - height_mm)

    level = float(np.median(height_mm[beside]))
    found = least_squares(misfit, (known_height_mm, 0.2 * width_mm, 0.0, level, 0.0), x_scale="jac", max_nfev=400).x
    if not 0.2 < found[0] / known_height_mm < 5 or abs(found[2]) > width_mm:
        raise InputError(
            f"{shape}: expected one of {known_height_mm:g} mm there, but its scan shows {found[0]:.2g} mm, "
            f"{found[2]:.2g} mm beside"
        )
    return float(found[0] / known_height_mm), float(abs(found[1]))
