"""Whether neighbouring points of a scan share their noise, as they do once its scanner's software has smoothed it."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from debulk.inspection.smooth_patches import Squares

__all__ = ["noise_is_shared"]

Floats = NDArray[np.float64]

_SIDE = 16  # points, of a square
_DEGREE = 5  # of the polynomial that takes the ply's shape out of it
_SQUARES = 400
_FEWEST, _LEAST_SHARE = 20, 0.5  # squares that tell, and of all
_ROUNDED = 2.0  # times what a float32 resolves: scatter below that is no noise
_SHARED = 0.25  # of white noise 1; of a box of 3 points 0.29, of 5 0.23, of a Gaussian of 0.7 points 0.22, of 1 0.04
_MOST_TELL = 0.75  # the quantile: a square with an edge, or much shape, shows less than its noise has
_FOURTH = np.array([1.0, -4.0, 6.0, -4.0, 1.0])


def noise_is_shared(scan: NDArray[np.float32], squares: Squares, index: NDArray[np.int64], step: int) -> bool:
    """Tell whether points `step` pixels apart, or twice that, lack what they have of their own: white noise.

    What a smoothing leaves varies slowly: differences of fourth order along both axes of the image, in which white
    noise of one unit makes 70, are too small beside its scatter. Scanners' noise that is correlated has a white part.

    Parameters
    ----------
    scan
        (H, W, 3), scanner frame, NaN where nothing was seen.
    squares, index
        Where to look: squares that lie on the ply, counted row by row.
    step
        Pixels from a point to the next that is looked at.
    """
    some = index[:: max(1, len(index) // _SQUARES)]
    return any(_shared(_depths(scan, squares, some, apart)) for apart in (step, 2 * step))


def _shared(depths: Floats) -> bool:
    own = _own_share(depths)
    told = len(own) >= max(_FEWEST, _LEAST_SHARE * len(depths))
    return told and float(np.quantile(own, _MOST_TELL)) < _SHARED


def _depths(scan: NDArray[np.float32], squares: Squares, index: NDArray[np.int64], step: int) -> Floats:
    """Take the depths, (N, 16, 16), of squares that were seen as a whole."""
    wide = len(squares.columns)
    reach = step * np.arange(_SIDE)
    rows, columns = squares.rows[index // wide], squares.columns[index % wide]
    fits = (rows + reach[-1] < scan.shape[0]) & (columns + reach[-1] < scan.shape[1])
    at = (rows[fits, None] + reach)[:, :, None], (columns[fits, None] + reach)[:, None, :]
    depths = scan[(*at, 2)].astype(np.float64)
    return np.asarray(depths[np.isfinite(depths).all(axis=(1, 2))])


def _own_share(depths: Floats) -> Floats:
    """Return for each square its fourth differences over the scatter about its polynomial; of white noise 1."""
    shape = _polynomials()
    flat = (depths - depths.mean(axis=(1, 2), keepdims=True)).reshape(len(depths), _SIDE**2)
    rest = flat - (flat @ shape) @ shape.T
    scatter = np.sqrt(np.sum(rest**2, axis=1) / (_SIDE**2 - shape.shape[1]))
    differences = _fourth(_fourth(rest.reshape(depths.shape)).transpose(0, 2, 1))
    of_white = np.sqrt(np.mean(differences**2, axis=(1, 2))) / np.sum(_FOURTH**2)
    tells = scatter > _ROUNDED * np.spacing(np.abs(depths[:, 0, 0]).astype(np.float32))
    return np.asarray(of_white[tells] / scatter[tells])


def _fourth(values: Floats) -> Floats:
    """Differences of fourth order along the last axis."""
    return np.asarray(sum(c * values[..., k : values.shape[-1] - 4 + k] for k, c in enumerate(_FOURTH)))


@functools.cache
def _polynomials() -> Floats:
    """Orthonormal polynomials over a square, (256, 21)."""
    u, v = np.meshgrid(*2 * (np.linspace(-1, 1, _SIDE),))
    powers = [(i, j) for i in range(_DEGREE + 1) for j in range(_DEGREE + 1 - i)]
    return np.asarray(np.linalg.qr(np.stack([(u**i * v**j).ravel() for i, j in powers], axis=1))[0])
