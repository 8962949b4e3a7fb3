"""How often a prediction was right, with the exact confidence interval of that rate."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from debulk._core import InputError


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """How often the prediction was right, and how certain that rate is with so few pockets."""

    hits: int
    total: int
    """`hits`, `total`: pockets predicted correctly, and pockets where both prediction and measurement have decided.
    Others are not counted."""
    low: float
    high: float
    """`low`, `high`: exact 95 % confidence interval of the hit rate (Clopper and Pearson 1934)."""

    @property
    def rate(self) -> float:
        """Share of hits; NaN if nothing was counted."""
        return self.hits / self.total if self.total else math.nan

    def __str__(self) -> str:
        if not self.total:
            return "no pocket was decided on both sides"
        return (
            f"{self.hits} of {self.total} right, {100 * self.rate:.0f} % "
            f"(95 % interval {100 * self.low:.1f} to {100 * self.high:.1f} %, Clopper-Pearson)"
        )


def agreement(hits: int, total: int, confidence: float = 0.95) -> Agreement:
    """Return the hit rate with its exact confidence interval.

    Parameters
    ----------
    hits, total
        0 <= hits <= total.
    confidence
        Confidence level, between 0 and 1; the interval covers the true rate at least that often.

    Raises
    ------
    InputError
        If the counts or the confidence level are impossible.

    Examples
    --------
    >>> print(agreement(13, 14))
    13 of 14 right, 93 % (95 % interval 66.1 to 99.8 %, Clopper-Pearson)
    """
    if not 0 <= hits <= total:
        raise InputError(f"hits: expected 0 to {total}, but got {hits}")
    if not 0 < confidence < 1:
        raise InputError(f"confidence: expected a share between 0 and 1, but got {confidence!r}")
    tail = 0.5 * (1 - confidence)
    # The lowest rate at which `hits` or more, and the highest at which `hits` or fewer, are no rarer than the tail.
    low = 0.0 if hits == 0 else _rate(lambda p: _between(hits, total, total, p) < tail)
    high = 1.0 if hits == total else _rate(lambda p: _between(0, hits, total, p) > tail)
    return Agreement(hits=hits, total=total, low=low, high=high)


def _between(least: int, most: int, total: int, rate: float) -> float:
    """Probability of `least` to `most` hits; by logarithms, for the coefficients of a large total overflow."""
    reach = 40 * math.sqrt(total * rate * (1 - rate)) + 40  # what is farther from the mean adds nothing
    least = max(least, math.floor(total * rate - reach))
    most = min(most, math.ceil(total * rate + reach))
    if least > most:
        return 0.0
    first = math.lgamma(total + 1) - math.lgamma(least + 1) - math.lgamma(total - least + 1)
    k = np.arange(least, most + 1)
    logs = first + np.concatenate([[0.0], np.cumsum(np.log((total - k[:-1]) / k[1:]))])
    return float(np.exp(logs + k * math.log(rate) + (total - k) * math.log1p(-rate)).sum())


def _rate(below: Callable[[float], bool]) -> float:
    """Return the rate up to which a condition that holds for low rates holds."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if below(middle) else (low, middle)
    return 0.5 * (low + high)
