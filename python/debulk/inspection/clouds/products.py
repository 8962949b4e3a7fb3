"""Matrix products of many rows, computed by numpy itself instead of by BLAS.

BLAS, which ``@`` calls, divides a product of some thousand rows among threads of its own, one per processor. Each
thread spins for about 30 ms afterwards, on the cores that the inspection works on, and the number of threads may change
a sum's last bits.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Floats


def product(rows: NDArray[np.floating], factors: NDArray[np.floating]) -> Floats:
    """Return ``rows @ factors`` for (N, K) rows and (K,) or (K, M) factors."""
    return np.asarray(np.einsum("nk,k...->n...", rows, factors))


def paraboloid(u: Floats, v: Floats) -> Floats:
    """Return the (N, 6) terms of a quadratic surface at (N,) coordinates: a plane's three come first."""
    return np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=1)


def least_squares(rows: Floats, values: Floats) -> Floats:
    """Return the (K,) factors that fit (N, K) rows to (N,) values best, by the normal equations of few terms."""
    return np.asarray(np.linalg.solve(product(rows.T, rows), product(rows.T, values)))
