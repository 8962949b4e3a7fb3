"""Probability of detection over size, for outcomes that are hit or miss, in the form of MIL-HDBK-1823A (appendix G)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk._core import InputError
from debulk.arrays import Floats
from debulk.learning.likelihood import expit

_ONE_SIDED_95 = 2.705543  # chi-squared with one degree of freedom, of which 90 % lie below: 5 % on each side
_STEPS = 100


@dataclass(frozen=True)
class Pod:
    """A curve of detection: logit(POD) = b0 + b1 ln(size)."""

    b0: float
    b1: float
    """`b0`, `b1`: its parameters, by maximum likelihood."""
    a50_mm: float
    a90_mm: float
    """`a50_mm`, `a90_mm`: sizes that are detected with 50 and 90 %."""
    a90_95_mm: float
    """Upper end of the one-sided 95 % interval of `a90_mm`, by the likelihood ratio; infinite if the outcomes do not
    bound it."""
    hits: int
    total: int
    """`hits`, `total`: number of defects that were detected, and of all."""

    def at(self, size_mm: ArrayLike) -> Floats:
        """Return the probability of detection of these sizes."""
        return expit(self.b0 + self.b1 * np.log(np.asarray(size_mm, dtype=np.float64)))

    def __str__(self) -> str:
        bound = f"{self.a90_95_mm:.3f} mm" if math.isfinite(self.a90_95_mm) else "not bounded"
        return (
            f"{self.hits} of {self.total} detected; a50 {self.a50_mm:.3f} mm, a90 {self.a90_mm:.3f} mm, a90/95 {bound}"
        )


def pod(size_mm: ArrayLike, detected: ArrayLike) -> Pod:
    """Fit the probability of detection to hits and misses.

    Parameters
    ----------
    size_mm
        (N,) sizes of the defects, above 0.
    detected
        (N,) whether each was detected. The handbook wants at least 60 of sizes about where the probability rises.

    Raises
    ------
    InputError
        If a size is not positive; or if hits and misses do not overlap or detection does not rise with size: then no
        curve fits best.

    Examples
    --------
    >>> sizes = np.linspace(0.2, 1.2, 60)
    >>> print(pod(sizes, (sizes > 0.6) ^ (np.arange(60) % 9 == 0)).total)
    60
    """
    size, hit = np.asarray(size_mm, dtype=np.float64), np.asarray(detected, dtype=bool)
    if size.shape != hit.shape or size.ndim != 1:
        raise InputError(f"detected: expected one per size, {size.shape}, got {hit.shape}")
    if not (np.isfinite(size) & (size > 0)).all():
        raise InputError("size_mm: expected positive sizes")
    if hit.all() or not hit.any():
        raise InputError(f"detected: expected hits and misses, got {int(hit.sum())} hits of {len(hit)}")
    if size[hit].min() > size[~hit].max():
        raise InputError("detected: every hit is larger than every miss, so no curve fits best: more sizes between")
    x = np.log(size)
    b0, b1 = _fit(x, hit)
    if not b1 > 0:
        raise InputError("detected: detection does not rise with size, so there is no size that is detected surely")
    log90 = (math.log(9.0) - b0) / b1
    bound = _upper(x, hit, _log_likelihood(x, hit, b0, b1), log90)
    return Pod(b0, b1, math.exp(-b0 / b1), math.exp(log90), bound, int(hit.sum()), len(hit))


def _log_likelihood(x: Floats, hit: NDArray[np.bool_], b0: float, b1: float) -> float:
    z = b0 + b1 * x
    return -float(np.logaddexp(0.0, np.where(hit, -z, z)).sum())


def _fit(x: Floats, hit: NDArray[np.bool_]) -> tuple[float, float]:
    """Return the parameters of the largest likelihood, by Newton's method with halved steps."""
    mean = float(x.mean())  # about which the two parameters hardly depend on each other
    u = np.column_stack([np.ones_like(x), x - mean])
    b, now = np.zeros(2), -len(x) * math.log(2.0)
    for _ in range(_STEPS):
        p = expit(u @ b)
        step = np.linalg.solve((u * (p * (1 - p))[:, None]).T @ u + 1e-12 * np.eye(2), u.T @ (hit - p))
        for half in range(30):
            trial = b + 0.5**half * step
            then = _log_likelihood(x - mean, hit, *trial)
            if then >= now:
                break
        gained, b, now = then - now, trial, then
        if gained < 1e-12:
            break
    return float(b[0] - b[1] * mean), float(b[1])


def _upper(x: Floats, hit: NDArray[np.bool_], best: float, log90: float) -> float:
    """Return the largest a90 that the likelihood ratio does not refuse; infinite if it refuses none."""

    def refused(log_a: float) -> bool:
        return 2 * (best - _profile(x - log_a, hit)) > _ONE_SIDED_95

    low, high = log90, log90 + 0.05
    while not refused(high):
        low, high = high, high + 2 * (high - log90)
        if high - log90 > 12:
            return math.inf
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if refused(middle) else (middle, high)
    return math.exp(high)


def _profile(x: Floats, hit: NDArray[np.bool_]) -> float:
    """Return the largest likelihood of all curves through POD = 90 % at x = 0: it is concave in the one slope left."""
    low, high = math.log(1e-4), math.log(1e4)
    golden = 0.5 * (math.sqrt(5.0) - 1)

    def value(log_slope: float) -> float:
        return _log_likelihood(x, hit, math.log(9.0), math.exp(log_slope))

    for _ in range(60):
        a, b = high - golden * (high - low), low + golden * (high - low)
        low, high = (low, b) if value(a) > value(b) else (a, high)
    return value(0.5 * (low + high))
