"""Faults of fringe images, which are found on a sample of the pixels and named before anything is decoded.

A healthy pixel follows I_k = offset + modulation cos(phase + 2π k / steps), and the beat of its phases gives whole
fringe orders. An image that is missing, repeated or in the place of another breaks both. An image with another
exposure, or a lamp that flickers, leaves a ripple in the phase. Each exposure is judged by the pixels that take their
phase from it, and by what the sensor's noise makes one expect of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from debulk.scanner.fringe_fit import (
    Fringes,
    Pixels,
    alike_starts,
    brightness_of_images,
    expected_residual,
    misfit,
    other_periods,
    residual,
    start_phase,
)
from debulk.scanner.inputs import InputError, Stack

MOST_RIPPLE_RAD = 0.004  # root mean square of the phase's error from a lamp's flicker
MOST_RESIDUAL = 0.15  # median distance of fringe orders from whole numbers; 0.25 is pure chance
MOST_MISFIT = 0.10  # ratio of the highest harmonic to the modulation
MOST_NOISE = 0.01  # of half the greatest grey value, as a share of the greatest; sensors have less
LEAST_START = 0.02  # turns; a smaller start phase does not matter to the fringe orders
_LEAST = 150  # lit pixels of the sample that are needed for a judgement
_MOST = 4000  # pixels of the sample that are enough for one
_FEW = 1000  # pixels that are enough where their ripple and three deviations of it together are below the limit


def refuse_faults(
    stack: Stack, periods: tuple[int, ...], steps: int, noise: tuple[float, float], start: float | None = None
) -> float:
    """Raise an InputError that names what is wrong with the images; images too dark to judge are accepted.

    Returns the start phase in turns: the given one, or the estimate for None.
    """
    clear = clear_pixels(stack, periods, steps, noise)
    if start is None:
        start = clear.start()
    clear.refuse_faults(start)
    return start


@dataclass(frozen=True, eq=False)
class ClearPixels:
    """Pixels of the sample whose fringe orders are the surest, by their exposure, and the name of the images."""

    by_exposure: dict[int, Pixels]
    name: str
    several: bool
    """Whether there are several exposures."""

    def start(self) -> float:
        """Estimate the start phase, in turns: all that a decoding needs to know beforehand."""
        return _start(self.by_exposure, self.name)

    def refuse_faults(self, start: float) -> None:
        """Raise an InputError that names what is wrong with the images."""
        for e, pixels in self.by_exposure.items():
            found = _fault(pixels, start, f" of exposure {e + 1}" if self.several else "")
            if found:
                raise InputError(f"{self.name}: {found}")


def clear_pixels(stack: Stack, periods: tuple[int, ...], steps: int, noise: tuple[float, float]) -> ClearPixels:
    """Return the pixels by which images are judged; an InputError is raised for grey values that no sensor gives."""
    fringes = Fringes(periods, steps)
    noise = _plausible(noise, stack.white)
    sample = stack.sample
    top = sample.max(axis=1)
    _refuse_levels(stack, top)
    # The longest exposure in which no step of a pixel is saturated; -1 where there is none.
    used = np.where(top < stack.white, np.arange(stack.exposures)[:, None], -1).max(axis=0)
    clear = {}
    for e in range(stack.exposures):
        own = _spread(np.flatnonzero(used == e), 4 * _MOST)
        pixels = _clearest(Pixels(sample[e][:, own].astype(np.float64), fringes, noise))
        if pixels is not None:
            clear[e] = pixels
    return ClearPixels(clear, stack.name, stack.exposures > 1)


def _plausible(noise: tuple[float, float], white: int) -> tuple[float, float]:
    """Return the noise, or that of a usual sensor where images out of place have spoiled the estimate."""
    if noise[0] + noise[1] * white / 2 <= (MOST_NOISE * white) ** 2:
        return noise
    return (0.3 + 0.002 * white) ** 2, white / 20_000


def _refuse_levels(stack: Stack, top: NDArray[np.unsignedinteger]) -> None:
    before, scatter_before = -1.0, 0.0
    for e in range(stack.exposures):
        if top[e].max() > stack.white:
            raise InputError(
                f"{stack.name}: expected grey values up to {stack.white}, but got {top[e].max():.0f}: give the "
                f"sensor's bits"
            )
        values = stack.sample[e]
        mean, scatter = float(values.mean()), float(values[:, ::16].std(axis=0).mean()) / np.sqrt(values.size)
        if mean < before - 5 * np.hypot(scatter, scatter_before):
            raise InputError(
                f"{stack.name}: expected the shortest exposure first, but exposure {e + 1} is darker than {e}"
            )
        before, scatter_before = mean, scatter


def _clearest(pixels: Pixels) -> Pixels | None:
    """Select the half of the lit pixels whose fringe orders are expected to be the surest, or None if these are few."""
    lit = (pixels.modulation > 5 * np.sqrt(pixels.variance)) & (pixels.order_noise <= 0.25)
    if np.count_nonzero(lit) < _LEAST:
        return None
    expected = pixels.order_noise
    return pixels[_spread(np.flatnonzero(lit & (expected <= np.median(expected[lit]))), _MOST)]


def _spread(at: NDArray[np.intp], most: int) -> NDArray[np.intp]:
    """Return at most so many of the pixels, evenly spread."""
    return at[:: -(-len(at) // most) or 1]


def _start(clear: dict[int, Pixels], name: str) -> float:
    """Estimate the start phase from the exposure that tells most and follows the fringes with it."""
    for e in sorted(clear, key=lambda e: -float(np.sum(clear[e].order_noise ** -2.0))):
        start = start_phase(clear[e])
        if _fine(clear[e], start):
            alike = alike_starts(clear[e].fringes)
            if abs((start * alike + 0.5) % 1.0 - 0.5) <= LEAST_START * alike:
                return 0.0
            if alike > 1:
                raise InputError(
                    f"{name}: the fringes begin with a start phase of {2 * np.pi * (start % (1 / alike)):.2f} rad, or "
                    f"of this plus a multiple of {2 * np.pi / alike:.3f} rad, which these numbers of periods cannot "
                    f"tell: give start_phase_rad"
                )
            return start
    return 0.0


def _most_residual(pixels: Pixels) -> float:
    """Return the limit of the residual: where noise alone comes near it, half way from there to chance."""
    return max(MOST_RESIDUAL, 0.5 * (0.25 + expected_residual(pixels)))


def _fine(pixels: Pixels, start: float) -> bool:
    whole = residual(pixels, start) <= _most_residual(pixels)
    return whole and misfit(pixels) <= MOST_MISFIT and other_periods(pixels, start) == 0


def _fault(pixels: Pixels, start: float, where: str) -> str:
    uneven = _uneven(pixels, where)
    if not uneven and _fine(pixels, start):
        return ""
    return (
        _misplaced(pixels, start, where)
        or uneven
        or (
            f"the images{where} do not follow the fringes of {pixels.fringes.steps} steps: fringe orders are "
            f"{residual(pixels, start):.2f} from whole numbers in the median (0.25 is chance); steps, periods or "
            f"start phase are not those of the projector, images are out of order, or the steps are too few for the "
            f"projector's gamma"
        )
    )


def _misplaced(pixels: Pixels, start: float, where: str) -> str:
    """Say which images are dark, repeated or in the place of another."""
    brightness = pixels.values.mean(axis=1)
    for image in np.flatnonzero(brightness < 0.25 * np.median(brightness)):
        return f"image {image + 1}{where} is dark: it was taken without light, or is missing"
    few = pixels[:: max(1, pixels.values.shape[1] // 2000)]
    usual = 2 * np.mean(few.modulation**2) * np.sin(np.pi / pixels.fringes.steps) ** 2  # of neighbouring steps, squared
    pairs = list(combinations(range(pixels.fringes.images), 2))
    differences = np.array([np.mean((few.values[i] - few.values[j]) ** 2 - 2 * few.variance) for i, j in pairs])
    i, j = pairs[int(np.argmin(differences))]
    if differences.min() < 0.1 * usual:
        return (
            f"images {i + 1} and {j + 1}{where} show the same pattern: one is a repetition, "
            "and the pattern after it is missing"
        )
    count = pixels.fringes.images
    orders = [np.roll(np.arange(count), 1), np.roll(np.arange(count), -1)]
    names = [f"the images{where} begin with the second pattern", f"the images{where} begin with the last pattern"]
    for pair in pairs:
        order = np.arange(count)
        order[[*pair]] = pair[::-1]
        orders.append(order)
        names.append(f"images {pair[0] + 1} and {pair[1] + 1}{where} are exchanged")
    arranged = [few.arranged(order) for order in orders]
    for estimate in (False, True):  # two wrong arrangements can look like another start phase
        best, least = 0, np.inf
        for k, here in enumerate(arranged):
            off = misfit(here)
            if off <= MOST_MISFIT:
                begin = start_phase(here) if estimate else start
                wrong = residual(here, begin) + off
                if wrong < least and _fine(here, begin):
                    best, least = k, wrong
        if least < 0.6 * (residual(pixels, start) + misfit(pixels)):
            return names[best]
    return ""


def _uneven(pixels: Pixels, where: str) -> str:
    """Say which images are brighter or darker than the others of their number of periods."""
    found = brightness_of_images(pixels[:: max(1, pixels.values.shape[1] // _FEW)])
    if found.ripple_rad + found.scatter_rad > MOST_RIPPLE_RAD:  # few pixels leave it open
        found = brightness_of_images(pixels)
    if found.ripple_rad <= max(MOST_RIPPLE_RAD, found.scatter_rad):
        return ""
    off = found.off
    size = np.sort(np.abs(off))
    if size[-2] < 0.4 * size[-1]:
        k = int(np.argmax(np.abs(off)))
        return f"image {k + 1}{where} is differently exposed: {1 + off[k]:.2f} times as bright as its neighbours"
    return (
        f"the light flickers: images{where} differ in brightness by up to {100 * np.ptp(off):.1f} %, which leaves a "
        f"ripple of {found.ripple_rad:.3f} rad in the phase (limit {MOST_RIPPLE_RAD}); synchronise the exposure with "
        f"the projector, or expose longer"
    )
