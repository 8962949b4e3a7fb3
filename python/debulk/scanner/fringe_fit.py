"""How well a sample of pixels follows the fringes, weighted by the noise that is expected of each pixel.

Sums over pixels are taken by `einsum` alone: a matrix product of this size would wake a thread per core for nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk.arrays import Floats

_STARTS = 48  # start phases that are tried
_FIRST_START = -0.04  # turns
_SLOPES = np.arange(-5, 6)  # differences of the numbers of periods that are tried


@dataclass(frozen=True)
class Fringes:
    """What the projector shows, as the images are expected to follow it."""

    periods: tuple[int, ...]
    steps: int

    @cached_property
    def plan(self) -> tuple[list[tuple[int, list[int]]], float]:
        """Stages (periods, weights of the phases) and the noise of the least certain order for a phase noise of 1."""
        return _core.scanner.unwrap_stages(list(self.periods))

    @property
    def images(self) -> int:
        """Number of images of an exposure."""
        return len(self.periods) * self.steps

    @cached_property
    def turns(self) -> Floats:
        """Phase that each step adds, in turns."""
        return np.arange(self.steps) / self.steps


@dataclass(frozen=True, eq=False)
class Pixels:
    """Grey values (n, M) of pixels of one exposure, and the first harmonic of each number of periods."""

    values: Floats
    fringes: Fringes
    noise: tuple[float, float]

    @cached_property
    def first(self) -> NDArray[np.complex128]:
        """(P, M): modulation and phase."""
        sets = self.values.reshape(len(self.fringes.periods), self.fringes.steps, -1)
        turn = np.exp(-2j * np.pi * self.fringes.turns)
        return np.asarray(np.einsum("k,pkm->pm", turn, sets) * (2 / self.fringes.steps))

    @cached_property
    def level(self) -> Floats:
        """(M,) mean grey value."""
        return np.asarray(self.values.mean(axis=0))

    @cached_property
    def modulation(self) -> Floats:
        """(M,) amplitude of the fringes."""
        return np.asarray(np.abs(self.first).mean(axis=0))

    @cached_property
    def variance(self) -> Floats:
        """(M,) that is expected of a grey value."""
        return np.asarray(self.noise[0] + self.noise[1] * self.level)

    @cached_property
    def order_noise(self) -> Floats:
        """(M,) standard deviation that is expected of the least certain fringe order."""
        with np.errstate(divide="ignore"):
            wrapped = np.sqrt(2 / self.fringes.steps * self.variance) / (2 * np.pi * self.modulation)
        return np.asarray(self.fringes.plan[1] * wrapped)

    def __getitem__(self, which: object) -> Pixels:
        return Pixels(self.values[:, which], self.fringes, self.noise)  # type: ignore[index]

    def arranged(self, order: NDArray[np.intp]) -> Pixels:
        """Return the same pixels with the images in another order."""
        return Pixels(self.values[order], self.fringes, self.noise)

    @cached_property
    def phases(self) -> Floats:
        """(P, M) wrapped phases in turns."""
        return np.asarray(np.angle(self.first) / (2 * np.pi))


def off_orders(pixels: Pixels, starts: float | Floats) -> tuple[Floats, Floats]:
    """Return distances of fringe orders from whole numbers, -0.5 to 0.5, and places in the field, 0 to 1.

    Each start phase of an array (T, 1) gives its own; the shapes are (S, T, M) and (T, M), or (S, M) and (M,).
    """
    absolute, place, periods, off = np.zeros(()), np.zeros(()), 1, []
    for k, (count, weights) in enumerate(pixels.fringes.plan[0]):
        wrapped = np.einsum("p,pm->m", np.asarray(weights, dtype=np.float64), pixels.phases) - sum(weights) * starts
        wrapped = wrapped - np.floor(wrapped)  # the bits of % 1, which takes many times as long
        if k == 0:
            absolute = place = wrapped
        else:
            expected = absolute * (count / periods) - wrapped
            order = np.rint(expected)
            off.append(expected - order)
            absolute = wrapped + order
        periods = count
    return np.array(off), np.asarray(place)


def residual(pixels: Pixels, start: float) -> float:
    """Return the median distance of the fringe orders from whole numbers; 0.25 is chance."""
    return float(np.median(np.abs(off_orders(pixels, start)[0]).max(axis=0)))


def expected_residual(pixels: Pixels) -> float:
    """Return what the noise alone makes of the residual."""
    return 0.6745 * float(np.median(np.minimum(pixels.order_noise, 1.0)))


def misfit(pixels: Pixels) -> float:
    """Return the highest harmonic over the modulation, without noise and without what depends on gamma.

    The steps cannot tell it from odd multiples of it; a projector's gamma makes these. With fewer than six steps, gamma
    contributes too much.
    """
    steps = pixels.fringes.steps
    if steps < 6:
        return 0.0
    weights = np.cos(2 * np.pi * (steps // 2) * pixels.fringes.turns)
    weights /= np.linalg.norm(weights)
    sets = pixels.values.reshape(len(pixels.fringes.periods), steps, -1)
    spare = np.einsum("k,pkm->pm", weights, sets).ravel()
    first, weight = pixels.first.ravel(), np.tile(pixels.variance, len(pixels.first)) ** -0.5
    size = np.abs(first)
    turn = first / np.maximum(size, 1e-12)
    highest = steps // 2
    waves = [turn**n for n in ([highest, 3 * highest] if steps % 2 == 0 else [highest, highest + 1])]
    terms = np.array([part * size * weight for wave in waves for part in (wave.real, wave.imag)])
    scaled = spare * weight
    normal, right = np.einsum("am,bm->ab", terms, terms), np.einsum("am,m->a", terms, scaled)
    rest = scaled - np.einsum("a,am->m", np.linalg.lstsq(normal, right, rcond=None)[0], terms)
    return float(np.sqrt(max(0.0, np.mean(rest**2) - 1) / np.mean((size * weight) ** 2)))


def _by_start(fringes: Fringes) -> Floats:
    """Return how much a start phase changes the distance of each order, in orders per turn."""
    stages = fringes.plan[0]
    sums, counts = np.array([sum(weights) for _, weights in stages]), np.array([count for count, _ in stages])
    return np.asarray(sums[1:] - counts[1:] / counts[:-1] * sums[:-1])


def alike_starts(fringes: Fringes) -> int:
    """Return how many start phases, evenly spread over the turn, make the orders equally whole; 0: all do."""
    by_start = _by_start(fringes)
    whole = np.rint(by_start)
    return int(np.gcd.reduce(whole.astype(int))) if np.allclose(by_start, whole) else 1


def start_phase(pixels: Pixels) -> float:
    """Estimate the start phase with which the fringe orders become whole, in turns, -0.04 to 0.96.

    The range ends between the values that projectors use, so that both cameras' estimates lie on one side of its end.
    """
    starts = np.arange(_STARTS) / _STARTS + _FIRST_START
    few = pixels[:: max(1, pixels.values.shape[1] // 600)]
    tried = np.abs(off_orders(few, starts[:, None])[0]).max(axis=0)
    best = float(starts[int(np.argmin(np.median(tried, axis=1)))])
    by_start = _by_start(pixels.fringes)
    if not by_start.any():
        return 0.0
    for _ in range(2):
        off = np.angle(np.exp(2j * np.pi * off_orders(pixels, best)[0]).mean(axis=1)) / (2 * np.pi)
        best -= float(by_start @ off / (by_start @ by_start))
    return float((best - _FIRST_START) % 1.0 + _FIRST_START)


def other_periods(pixels: Pixels, start: float) -> int:
    """Return by how many periods the images differ, seen by how the orders' distance grows over the field."""
    off, place = off_orders(pixels, start)
    slopes = np.vander(np.exp(-2j * np.pi * place), len(_SLOPES), increasing=True)
    least = np.exp(2j * np.pi * (off - _SLOPES[0] * place))
    alike = np.abs(np.einsum("sm,mk->sk", least, slopes)) / len(place)
    usual = alike[:, len(_SLOPES) // 2]
    worst = int(np.argmax(alike.max(axis=1) - usual))
    return int(_SLOPES[int(np.argmax(alike[worst]))]) if alike[worst].max() - usual[worst] > 0.1 else 0


@dataclass(frozen=True, eq=False)
class Brightness:
    """Brightness of each image relative to the others with its number of periods, and what it does to the phase."""

    off: Floats
    """(n,) less 1; the median of each number of periods is 0."""
    ripple_rad: float
    """Root mean square of the error that it leaves in the phase, made from all numbers of periods."""
    scatter_rad: float
    """What noise alone makes of this, the greatest that can be expected."""


def brightness_of_images(pixels: Pixels) -> Brightness:
    """Fit a factor for each image, together with the harmonics that gamma makes.

    Each pixel's offset and fringes are free; what they cannot follow is the sum of each image's factor times its fitted
    value, of harmonics that are the same for all pixels relative to the modulation, and of noise.
    """
    fringes, values = pixels.fringes, pixels.values
    images, sets, steps = fringes.images, len(fringes.periods), fringes.steps
    design = np.zeros((images, 1 + 2 * sets))
    design[:, 0] = 1
    for p in range(sets):
        at = slice(p * steps, (p + 1) * steps)
        angle = 2 * np.pi * fringes.turns
        design[at, 1 + 2 * p], design[at, 2 + 2 * p] = np.cos(angle), np.sin(angle)
    basis = np.linalg.qr(design)[0]
    blind = np.eye(images) - basis @ basis.T  # what remains of a pixel's values
    weight = 1 / np.sqrt(pixels.variance)
    off = np.zeros(images)
    for _ in range(2):
        mended = Pixels(values / (1 + off)[:, None], fringes, pixels.noise)
        rest = np.einsum("kl,lm->km", blind, mended.values)
        fitted = (mended.values - rest) * weight
        rest *= weight
        turn = mended.first / np.maximum(np.abs(mended.first), 1e-12)
        each = turn[:, None, :] * np.exp(2j * np.pi * fringes.turns)[None, :, None]
        size = np.abs(mended.first)[:, None, :] * weight
        squared = each * each
        harmonics = squared, squared * each, squared * squared
        waves = np.array([(size * harmonic.real).reshape(images, -1) for harmonic in harmonics])
        seen = np.einsum("kl,nlm->nkm", blind, waves)
        normal = np.zeros((images + len(waves), images + len(waves)))
        normal[:images, :images] = blind * np.einsum("km,lm->kl", fitted, fitted)
        normal[:images, images:] = np.einsum("km,nkm->kn", fitted, seen)
        normal[images:, :images] = normal[:images, images:].T
        normal[images:, images:] = np.einsum("akm,bkm->ab", waves, seen)
        right = np.concatenate([np.einsum("km,km->k", fitted, rest), np.einsum("akm,km->a", waves, rest)])
        scale = 1 / np.sqrt(np.maximum(np.diag(normal), 1e-30))
        inverse = np.linalg.pinv(normal * scale[:, None] * scale, rcond=1e-9, hermitian=True) * scale[:, None] * scale
        found = inverse @ right
        off = (1 + off) * (1 + np.clip(found[:images], -0.5, 0.5)) - 1
        for p in range(sets):
            own = off[p * steps : (p + 1) * steps]
            own[:] = (1 + own) / (1 + np.median(own)) - 1
    # The scatter is the expected one, or what is left of the values if that is more.
    left = rest - np.einsum("kl,lm->km", blind * found[:images], fitted) - np.einsum("n,nkm->km", found[images:], seen)
    excess = float(np.mean(left**2) * images / max(np.trace(blind), 1))
    ripple = _ripple(fringes, float(np.median(pixels.level / pixels.modulation)))
    scatter = np.trace(ripple @ inverse[:images, :images]) * max(excess, 1.0)
    return Brightness(off, float(np.sqrt(off @ ripple @ off)), 3 * float(np.sqrt(max(scatter, 0.0))))


def _ripple(fringes: Fringes, offset: float) -> Floats:
    """Return the form by which relative errors of the images' brightness give the square of the phase's error, rad².

    An image k that is brighter by δ shifts a phase by -(2 δ / steps) (offset / modulation + cos a) sin a, a being its
    phase plus the step's; `offset` is relative to the modulation.
    """
    place = np.arange(48) / 48
    angle = 2 * np.pi * (place[:, None] + fringes.turns)
    error = -2 / fringes.steps * (offset + np.cos(angle)) * np.sin(angle)
    squares: Sequence[float] = [n**2 for n in fringes.periods]
    out = np.zeros((fringes.images, fringes.images))
    for p, n in enumerate(fringes.periods):
        share = n * fringes.periods[0] / sum(squares)
        at = slice(p * fringes.steps, (p + 1) * fringes.steps)
        out[at, at] = share**2 * (error.T @ error) / len(place)
    return out
