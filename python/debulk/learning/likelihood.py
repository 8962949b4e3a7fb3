"""The likelihood of outcomes, and what they say about the limit of a ridge (docs/learning.md).

A pocket whose ridge by the excess is h creases with the probability 1 / (1 + exp(-(h - L) / s)), where L is the limit,
at which half of all pockets crease, and s = (sqrt(3) / pi) sqrt(spread² + noise²): the spread of the shop's own limit
from pocket to pocket, and the noise of this ridge. Prior: L normal, ln(spread) normal. Both are summed over a grid, so
that there is neither a chain that may not have converged nor an interval that supposes many outcomes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk._core import InputError
from debulk.arguments import typed
from debulk.arrays import Floats

_LIMITS_MM = np.linspace(0.01, 2.0, 399)
_SPREADS_MM = np.geomspace(0.005, 0.5, 41)
_TO_SCALE = np.sqrt(3.0) / np.pi  # from a standard deviation to the scale of a logistic law
_MOST_AT_ONCE = 4_000_000


@dataclass(frozen=True)
class Prior:
    """What is believed before any outcome: normal in the limit, mm, and in the logarithm of its spread.

    The default says next to nothing: 95 % of the limits within 0 and 1.2 mm, of the spreads within 0.015 and 0.24 mm.
    """

    limit_mm: float = 0.60
    limit_sd_mm: float = 0.30
    spread_mm: float = 0.06
    spread_factor: float = 2.0

    def log(self) -> Floats:
        """Return its logarithm on the grid, (limits, spreads)."""
        limit = -0.5 * ((_LIMITS_MM - self.limit_mm) / self.limit_sd_mm) ** 2
        spread = -0.5 * (np.log(_SPREADS_MM / self.spread_mm) / np.log(self.spread_factor)) ** 2
        total: Floats = limit[:, None] + spread
        return total


@dataclass(frozen=True, eq=False)
class Outcomes:
    """What became of pockets."""

    ridge_mm: Floats
    noise_mm: Floats
    """`ridge_mm`, `noise_mm`: (N,) ridges that were predicted by the excess, and their standard deviations by the
    scans' noise."""
    creased: NDArray[np.bool_]
    """(N,) whether the pocket creased."""

    def __len__(self) -> int:
        return len(self.creased)

    def part(self, chosen: NDArray[Any]) -> Outcomes:
        """Return some of them."""
        return Outcomes(self.ridge_mm[chosen], self.noise_mm[chosen], self.creased[chosen])


@dataclass(frozen=True, eq=False)
class Posterior:
    """What is believed after the outcomes: a weight for each limit and spread of the grid; they sum to 1."""

    weights: Floats

    @property
    def limit_mm(self) -> float:
        """The expected limit."""
        return float(self._of_limit() @ _LIMITS_MM)

    @property
    def limit_sd_mm(self) -> float:
        """Its standard deviation."""
        return float(np.sqrt(self._of_limit() @ (_LIMITS_MM - self.limit_mm) ** 2))

    @property
    def spread_mm(self) -> float:
        """The expected spread of the limit from pocket to pocket."""
        return float(self.weights.sum(axis=0) @ _SPREADS_MM)

    def interval_mm(self, confidence: float = 0.95) -> tuple[float, float]:
        """Return the interval with equal tails that holds the limit with this probability."""
        return _between(_LIMITS_MM, self._of_limit(), confidence)

    def spread_interval_mm(self, confidence: float = 0.95) -> tuple[float, float]:
        """Return the same of the spread."""
        return _between(_SPREADS_MM, self.weights.sum(axis=0), confidence)

    def creases(self, ridge_mm: ArrayLike, noise_mm: ArrayLike = 0.0) -> Floats:
        """Return the probability that pockets with these ridges crease, (N,), over all that is believed."""
        ridges, noises = np.broadcast_arrays(np.atleast_1d(np.asarray(ridge_mm, dtype=np.float64)), noise_mm)
        return np.array([float((self.weights * _crease(h, sd)).sum()) for h, sd in zip(ridges, noises, strict=True)])

    def information(self, ridge_mm: ArrayLike) -> Floats:
        """Return what one more outcome at these ridges tells of the limit, 1/mm², (N,): Fisher's information."""
        found = []
        for ridge in np.atleast_1d(np.asarray(ridge_mm, dtype=np.float64)):
            p = _crease(ridge, 0.0)
            found.append(float((self.weights * p * (1 - p) / (_TO_SCALE * _SPREADS_MM) ** 2).sum()))
        return np.array(found)

    def _of_limit(self) -> Floats:
        total: Floats = self.weights.sum(axis=1)
        return total


@typed
def posterior(outcomes: Outcomes, prior: Prior | None = None) -> Posterior:
    """Return what outcomes say about the limit.

    Parameters
    ----------
    outcomes
        Ridges, their noise, and whether each creased.
    prior
        What is believed without them; None: `Prior()`.

    Raises
    ------
    InputError
        If the lengths differ, or a figure is not finite.

    Examples
    --------
    >>> ridges = np.linspace(0.3, 0.9, 61)
    >>> found = posterior(Outcomes(ridges, np.full(61, 0.01), ridges > 0.7))
    >>> low, high = found.interval_mm()
    >>> low < 0.7 < high and high - low < 0.1
    True
    """
    ridge, noise, creased = np.asarray(outcomes.ridge_mm), np.asarray(outcomes.noise_mm), np.asarray(outcomes.creased)
    if not len(ridge) == len(noise) == len(creased):
        raise InputError(f"outcomes: expected equal lengths, got {len(ridge)}, {len(noise)} and {len(creased)}")
    if not (np.isfinite(ridge).all() and np.isfinite(noise).all()):
        raise InputError("outcomes: expected finite ridges and noises")
    log = (prior or Prior()).log()
    step = max(1, _MOST_AT_ONCE // log.size)
    for at in range(0, len(ridge), step):
        scale = _scale(noise[at : at + step, None])
        z = (ridge[at : at + step, None, None] - _LIMITS_MM[:, None]) / scale[:, None, :]
        z = np.where(creased[at : at + step, None, None], z, -z)
        log -= np.logaddexp(0.0, -z).sum(axis=0)
    weights = np.exp(log - log.max())
    return Posterior(weights / weights.sum())


def _scale(noise_mm: ArrayLike) -> Floats:
    """Return the scale of the logistic law for each spread of the grid."""
    scale: Floats = _TO_SCALE * np.hypot(_SPREADS_MM, noise_mm)
    return scale


def _crease(ridge_mm: float, noise_mm: float) -> Floats:
    """Return the probability of a crease for each limit and spread of the grid."""
    return expit((ridge_mm - _LIMITS_MM[:, None]) / _scale(noise_mm))


def expit(z: Floats) -> Floats:
    """Return the logistic law's distribution."""
    p: Floats = 1.0 / (1.0 + np.exp(-np.clip(z, -700, 700)))
    return p


def _between(values: Floats, weights: Floats, confidence: float) -> tuple[float, float]:
    """Return the ends of the interval between equal tails, interpolated between the values."""
    if not 0 < confidence < 1:
        raise InputError(f"confidence: expected a share between 0 and 1, got {confidence!r}")
    middles = np.cumsum(weights) - 0.5 * weights
    tail = 0.5 * (1 - confidence)
    low, high = np.interp([tail, 1 - tail], middles, values)
    return float(low), float(high)
