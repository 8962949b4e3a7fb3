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


def affine(places: Floats, values: Floats) -> Floats:
    """Return the (3, M) factors of x, y and 1 that fit (N, M) values at (N, 2) places best, in closed form.

    Places on one line determine the slope along it, and the one across is 0.
    """
    middle, level = places.mean(axis=0), values.mean(axis=0)
    (x, y), off = (places - middle).T, values - level
    xx, xy, yy = (float(np.einsum("n,n->", a, b)) for a, b in ((x, x), (x, y), (y, y)))
    of_x, of_y = (np.einsum("n,nm->m", a, off) for a in (x, y))
    spread, determinant = xx + yy, xx * yy - xy * xy
    if determinant > 1e-12 * spread * spread:
        slopes = np.stack([yy * of_x - xy * of_y, xx * of_y - xy * of_x]) / determinant
    else:
        slopes = np.stack([of_x, of_y]) / max(spread, np.finfo(np.float64).tiny)
    return np.vstack([slopes, level - product(middle[None], slopes)])
