"""What a blur by a Gaussian takes from narrow bumps, and how a strip of known size shows that blur."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError
from debulk.chain.study import Transfer

__all__ = ["strip_of", "transfer"]

Floats = NDArray[np.float64]
_WIDTHS_MM = (4.0, 6.0, 8.0, 10.0, 15.0, 20.0, 30.0)
_STEP_MM = 0.02
_LEAST_POINTS = 200


def transfer(sigma_mm: float) -> tuple[Transfer, ...]:
    """Return what is left of bumps H cos²(πx/w) of several widths after a blur of this sigma.

    The excess length of a low bump is the integral of half its slope's square, so its share depends on no height. The
    bump is a Fourier sum on a wide line, on which the blur multiplies by exp(-(k sigma)²/2).

    Examples
    --------
    >>> one = transfer(2.0)[4]
    >>> one.width_mm, round(one.height, 2), round(one.excess, 2)
    (15.0, 0.85, 0.58)
    """
    out = []
    for width in _WIDTHS_MM:
        reach = 4 * (width + 6 * sigma_mm)
        x = np.arange(-reach, reach, _STEP_MM)
        bump = np.where(np.abs(x) < width / 2, np.cos(np.pi * x / width) ** 2, 0.0)
        wave = 2 * np.pi * np.fft.rfftfreq(len(x), _STEP_MM)
        blurred = np.fft.irfft(np.fft.rfft(bump) * np.exp(-((wave * sigma_mm) ** 2) / 2), len(x))
        left = float(np.sum(np.diff(blurred) ** 2) / np.sum(np.diff(bump) ** 2))
        out.append(Transfer(width_mm=width, height=float(blurred.max()), excess=left))
    return tuple(out)


def strip_of(across_mm: Floats, height_mm: Floats, known_height_mm: float, width_mm: float) -> tuple[float, float]:
    """Fit a strip of known width, blurred by a Gaussian, to points across it.

    Parameters
    ----------
    across_mm, height_mm
        (N,) places across the strip, 0 near its middle, and heights above what it lies on.
    known_height_mm, width_mm
        The strip's.

    Returns
    -------
    tuple[float, float]
        Measured over known height, and the sigma of the blur, mm.

    Raises
    ------
    InputError
        If there are too few points, or none beside the strip, or no strip is there.
    """
    from scipy.optimize import curve_fit
    from scipy.special import ndtr

    beside = np.abs(across_mm) > width_mm
    if len(across_mm) < _LEAST_POINTS or not beside.any() or beside.all():
        raise InputError(f"strip: expected {_LEAST_POINTS} points on and beside it, but got {len(across_mm)}")

    def blurred(u: Floats, height: float, sigma: float, middle: float, level: float, slope: float) -> Floats:
        side = 0.5 * width_mm
        share = ndtr((u - middle + side) / abs(sigma)) - ndtr((u - middle - side) / abs(sigma))
        return np.asarray(level + slope * u + height * share)

    level = float(np.median(height_mm[beside]))
    try:
        found, _ = curve_fit(
            blurred, across_mm, height_mm, p0=(known_height_mm, 0.2 * width_mm, 0.0, level, 0.0), maxfev=2000
        )
    except RuntimeError:
        raise InputError("strip: its scan shows no strip of this width there") from None
    if not 0.2 < found[0] / known_height_mm < 5 or abs(found[2]) > width_mm:
        raise InputError(
            f"strip: expected one of {known_height_mm:g} mm there, but its scan shows {found[0]:.2g} mm, "
            f"{found[2]:.2g} mm beside"
        )
    return float(found[0] / known_height_mm), float(abs(found[1]))
