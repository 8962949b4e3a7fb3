"""Control charts: how a figure drifts from layup to layup, and which layups its rules point at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError

RULES = {
    "beyond": "one beyond three standard deviations",
    "two of three": "two of three in a row beyond two, on one side",
    "shift": "nine in a row on one side of the middle",
    "trend": "six in a row rising or falling",
}
BY_CHANCE = 0.012  # share of figures that only scatter at which one of the rules points
_BASELINE = 300
_LEAST = 20  # with fewer figures the limits mean nothing


@dataclass(frozen=True, eq=False)
class Control:
    """A chart of individual values."""

    values: NDArray[np.float64]
    """(N,) the figures in the order of the layups; NaN where a layup has none."""
    middle: float | None
    sigma: float | None
    """`middle`, `sigma`: mean, and standard deviation by the mean moving range over 1.128, of the first `baseline`
    figures that are known. None: there are fewer than 20."""
    signals: dict[str, NDArray[np.bool_]]
    """For each rule, by its name in `RULES`, (N,) whether it points at that layup."""
    baseline: int
    """Number of figures that the limits were taken from."""

    @property
    def limits(self) -> tuple[float, float] | None:
        """Lower and upper control limit, three standard deviations from the middle; None if they are not known."""
        if self.middle is None or self.sigma is None:
            return None
        return self.middle - 3 * self.sigma, self.middle + 3 * self.sigma


def control(values: NDArray[np.float64], baseline: int = _BASELINE) -> Control:
    """Chart (N,) figures against limits that the first `baseline` of them give, NaN where a layup has none.

    The rules are numbers 1, 5, 2 and 3 of Nelson, *The Shewhart control chart: tests for special causes*, Journal of
    Quality Technology 16 (1984). Of figures in control that are independent and normal, they point at about one in 100.
    """
    if baseline < _LEAST:
        raise InputError(f"baseline: expected at least {_LEAST}, got {baseline}")
    known = np.isfinite(values)
    figures = values[known]
    first = figures[:baseline]
    middle = sigma = None
    found = {name: np.zeros(len(figures), dtype=bool) for name in RULES}
    if len(first) >= _LEAST:
        middle = float(first.mean())
        sigma = float(np.abs(np.diff(first)).mean()) / 1.128
        found = _rules((figures - middle) / sigma) if sigma > 0 else found
    signals = {}
    for name, at in found.items():
        signals[name] = np.zeros(len(values), dtype=bool)
        signals[name][known] = at
    return Control(values, middle, sigma, signals, len(first))


def _rules(z: NDArray[np.float64]) -> dict[str, NDArray[np.bool_]]:
    up, down = z > 0, z < 0
    two = [_last(side, 3).sum(axis=1) >= 2 for side in (z > 2, z < -2)]
    step = np.diff(z, prepend=np.nan)
    return {
        "beyond": np.abs(z) > 3,
        "two of three": (two[0] & (z > 2)) | (two[1] & (z < -2)),
        "shift": _last(up, 9).all(axis=1) | _last(down, 9).all(axis=1),
        "trend": _last(step > 0, 5).all(axis=1) | _last(step < 0, 5).all(axis=1),
    }


def _last(flags: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
    """Return each flag with those before it, (N, count); before the first all are False."""
    padded = np.concatenate([np.zeros(count - 1, dtype=bool), flags])
    return np.lib.stride_tricks.sliding_window_view(padded, count)
