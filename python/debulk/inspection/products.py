"""Products of many rows, by numpy itself instead of by BLAS.

BLAS, which ``@`` calls, shares a product of some thousand rows among threads of its own, one a processor. Each spins
for some 30 ms after it, on the cores that the inspection works on, and how many there are may change a sum's last bits.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["product"]

Floats = NDArray[np.float64]


def product(rows: NDArray[np.floating], factors: NDArray[np.floating]) -> Floats:
    """Return ``rows @ factors``, of (N, K) with (K,) or (K, M)."""
    return np.asarray(np.einsum("nk,k...->n...", rows, factors))
