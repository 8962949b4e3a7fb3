"""Faults of fringe images, which are found on a sample of the pixels and named before anything is decoded.

A healthy pixel follows I_k = offset + modulation cos(phase + 2π k / steps), and the beat of its phases gives whole
fringe orders. An image that is missing, repeated or in the place of another breaks both. An image with another
exposure, or a lamp that flickers, shows in the brightness of the images, with each pixel measured relative to its own
mean and all phases weighted equally.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk.scanner.inputs import InputError, Stack

F64 = NDArray[np.float64]
Stage = tuple[int, list[int]]

MOST_BRIGHTNESS = 0.015  # relative difference of an image from the others with its number of periods
MOST_RESIDUAL = 0.15  # median distance of fringe orders from whole numbers; 0.25 is pure chance
MOST_MISFIT = 0.10  # ratio of the highest harmonic to the modulation
_PIXELS = 40_000  # size of the sample
_BINS = 24  # bins of the phase
_LEAST = 400  # lit pixels of the sample that are needed for a judgement


def refuse_faults(stack: Stack, periods: tuple[int, ...], steps: int) -> None:
    """Raise an InputError that names what is wrong with the images; images too dark to judge are accepted."""
    stages = _core.scanner.unwrap_stages(list(periods))[0]
    step = max(1, round(np.sqrt(stack.shape[0] * stack.shape[1] / _PIXELS)))
    before = -1.0
    for e in range(stack.exposures):
        # Columns in the sample are close together, because it must contain every phase of the fringes.
        sample = np.stack([image[step // 2 :: step, ::step].ravel() for image in stack.exposure(e)]).astype(np.float64)
        where = f" of exposure {e + 1}" if stack.exposures > 1 else ""
        if sample.max() > stack.white:
            raise InputError(
                f"{stack.name}: expected grey values up to {stack.white}, but got {sample.max():.0f}: give the "
                f"sensor's bits"
            )
        mean = float(np.minimum(sample, stack.white).mean())
        if mean < before:
            raise InputError(
                f"{stack.name}: expected the shortest exposure first, but exposure {e + 1} is darker than {e}"
            )
        before = mean
        found = _fault(sample, stack.white, stages, steps, where)
        if found:
            raise InputError(f"{stack.name}: {found}")


@dataclass(frozen=True, eq=False)
class _Fit:
    misfit: float  # highest harmonic over modulation
    residual: float  # median distance of the fringe orders from whole numbers
    phases: F64  # (P, M), turns
    means: F64  # (P, M)

    @property
    def fine(self) -> bool:
        return self.misfit <= MOST_MISFIT and self.residual <= MOST_RESIDUAL


def _fit(sample: F64, stages: list[Stage], steps: int) -> _Fit:
    values = sample.reshape(-1, steps, sample.shape[1])
    turn = np.exp(-2j * np.pi * np.arange(steps) / steps)
    first = np.einsum("k,pkm->pm", turn, values) * (2 / steps)
    phases = np.angle(first) / (2 * np.pi)
    highest = 0.0
    if steps >= 6:  # with fewer steps, a projector's gamma contributes to it
        spare = np.einsum("k,pkm->pm", np.cos(2 * np.pi * (steps // 2) * np.arange(steps) / steps), values)
        highest = float(np.sqrt(np.mean(spare**2) / steps) / np.mean(np.abs(first)))
    absolute, periods, worst = np.zeros(sample.shape[1]), 1, np.zeros(sample.shape[1])
    for k, (count, weights) in enumerate(stages):
        wrapped = (np.asarray(weights) @ phases) % 1.0
        expected = absolute * (count / periods) - wrapped
        order = np.rint(expected)
        if k > 0:
            worst = np.maximum(worst, np.abs(expected - order))
        absolute, periods = (wrapped + order if k > 0 else wrapped), count
    return _Fit(highest, float(np.median(worst)), phases, values.mean(axis=1))


def _lit(sample: F64, white: int) -> F64:
    """Select the clearest half of the pixels that are lit and saturated in no image."""
    contrast = 0.5 * (sample.max(axis=0) - sample.min(axis=0))
    fine = (sample.max(axis=0) < white) & (contrast > max(4.0, white / 100))
    if np.count_nonzero(fine) < _LEAST:
        return sample[:, :0]
    return sample[:, fine & (contrast >= np.median(contrast[fine]))]


def _fault(sample: F64, white: int, stages: list[Stage], steps: int, where: str) -> str:
    lit = _lit(sample, white)
    if lit.shape[1] < _LEAST // 2:
        return ""
    fit = _fit(lit, stages, steps)
    uneven = _uneven(lit, stages, steps, where)
    if fit.fine and not uneven:
        return ""
    return (
        _misplaced(lit, stages, steps, where, fit)
        or uneven
        or (
            f"the images{where} do not follow the fringes of {steps} steps: fringe orders are "
            f"{fit.residual:.2f} from whole numbers "
            f"in the median (0.25 is chance); steps or periods are not those of the projector, or images are "
            f"out of order"
        )
    )


def _misplaced(lit: F64, stages: list[Stage], steps: int, where: str, fit: _Fit) -> str:
    """Say which images are dark, repeated or in the place of another."""
    brightness = lit.mean(axis=1)
    for k in np.flatnonzero(brightness < 0.25 * np.median(brightness)):
        return f"image {k + 1}{where} is dark: it was taken without light, or is missing"
    contrast = float(np.mean(0.5 * (lit.max(axis=0) - lit.min(axis=0))))
    few = lit[:, :: max(1, lit.shape[1] // 4000)]
    usual = contrast * np.sin(np.pi / steps)
    pairs = list(combinations(range(len(lit)), 2))
    differences = np.array([np.abs(few[i] - few[j]).mean() for i, j in pairs])
    i, j = pairs[int(np.argmin(differences))]
    if differences.min() < 0.3 * usual:
        return (
            f"images {i + 1} and {j + 1}{where} show the same pattern: one is a repetition, "
            "and the pattern after it is missing"
        )
    count = len(few)
    orders = [np.roll(np.arange(count), 1), np.roll(np.arange(count), -1)]
    names = [f"the images{where} begin with the second pattern", f"the images{where} begin with the last pattern"]
    for i, j in pairs:
        order = np.arange(count)
        order[[i, j]] = j, i
        orders.append(order)
        names.append(f"images {i + 1} and {j + 1}{where} are exchanged")
    fits = [_fit(few[order], stages, steps) for order in orders]
    best = min(range(len(orders)), key=lambda k: fits[k].residual + fits[k].misfit)
    better = fits[best].residual + fits[best].misfit < 0.6 * (fit.residual + fit.misfit)
    return names[best] if fits[best].fine and better else ""


def _uneven(lit: F64, stages: list[Stage], steps: int, where: str) -> str:
    """Say which images are brighter or darker than the others of their number of periods."""
    off = brightness_of_images(lit, stages, steps) - 1.0
    size = np.sort(np.abs(off))
    if size[-1] <= MOST_BRIGHTNESS:
        return ""
    if size[-2] < 0.4 * size[-1]:
        k = int(np.argmax(np.abs(off)))
        return f"image {k + 1}{where} is differently exposed: {1 + off[k]:.2f} times as bright as its neighbours"
    return (
        f"the light flickers: images{where} differ in brightness by up to {100 * np.ptp(off):.1f} %; "
        "synchronise the exposure with the projector, or expose longer"
    )


def brightness_of_images(lit: F64, stages: list[Stage], steps: int) -> F64:
    """Brightness of each image relative to the others with its number of periods.

    It is the mean of grey values over their pixel's mean, with every phase weighted equally, so that the fringes
    cancel. An abnormal image also spoils the phases and means, so the images are corrected and measured again.
    """
    brightness = np.ones(len(lit))
    for _ in range(2):
        fit = _fit(lit / brightness[:, None], stages, steps)
        for p, (phase, mean) in enumerate(zip(fit.phases, fit.means, strict=True)):
            bins = np.floor((phase % 1.0) * _BINS).astype(int) % _BINS
            count = np.bincount(bins, minlength=_BINS)
            for k in range(p * steps, (p + 1) * steps):
                sums = np.bincount(bins, lit[k] / (brightness[k] * mean), minlength=_BINS)
                brightness[k] *= np.mean(sums[count > 0] / count[count > 0])
            own = brightness[p * steps : (p + 1) * steps]
            own /= np.median(own)
    return brightness
