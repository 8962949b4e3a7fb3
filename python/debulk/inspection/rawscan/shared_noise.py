"""Whether neighbouring points of a scan share their noise, as they do after the scanner's software has smoothed it."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from debulk.arrays import Bools, Cloud, Floats, Whole
from debulk.inspection.clouds.enough import FEW, PLACES, SEEN
from debulk.inspection.clouds.products import product
from debulk.inspection.clouds.thinning import complete
from debulk.inspection.evidence.cloud_image import CloudImage, step_of


@dataclass(frozen=True)
class Limits:
    """Of noise that neighbours share; bench/trust/smoothing.py smooths scans by all filters of such software."""

    across: float = 3.0  # squares that begin within the width of the smallest pocket that is looked for
    most_on_ply: int = 1000  # spread over the image
    side: int = 16  # points along the side of a square
    degree: int = 5  # of the polynomial that removes the ply's shape from a square
    least_share: float = 0.4  # of the squares looked at that must give a result
    silent_share: float = 0.8  # of them: if more show no noise, the scan has none
    resolutions: float = 2.0  # of a float32: smaller scatter is no noise; 4 would miss that of a scan smoothed much
    steps: float = 0.6  # of rounded depths: smaller scatter is that of rounding, 0.29 of a step, which is white
    # Share of white noise below which noise is shared: 1 for white noise; after a box of 3 points 0.29 is left, of 5
    # 0.23, after a Gaussian of 0.7 points 0.22, of 1 0.04.
    white_share: float = 0.25
    quantile: float = 0.75  # over the squares that is compared: an edge, or much shape, lowers the share in a square


LIMITS = Limits()
MIDDLE = 6  # rows and columns from a square's first pixel to that which shows whether it lies on the ply
_TURN = 0.618034  # share of all places from one that is taken to the next, so that no pattern of rows repeats
_FOURTH = 70.0  # root of the mean square of differences of fourth order, along both axes, of white noise of one unit


def spread_over(count: int, most: int) -> Whole:
    """Return the numbers of at most so many places, spread over all of `count`."""
    return np.asarray((_TURN * count * np.arange(min(most, count))).astype(np.int64) % max(1, count))


def squares_on(scan: Cloud, pitch_mm: float, wide_mm: float, on_ply: Callable[[Cloud], Bools]) -> Whole:
    """Return rows and columns (N, 2) of the first pixels of at most a thousand squares on the ply in an image.

    They are spread over the image (H, W, 3) so that a place of this width holds some, and may overlap. `on_ply` says
    which of (N, 3) points, all finite, lie on the ply.
    """
    step = int(np.clip(wide_mm / (LIMITS.across * pitch_mm), 4, 4 * MIDDLE))
    rows, columns = ((size - 2 * MIDDLE) // step + 1 for size in scan.shape[:2])
    index = np.arange(0, rows * columns, -(-rows * columns // LIMITS.most_on_ply), dtype=np.int64)
    first = step * np.column_stack(np.divmod(index, columns))
    middles = scan[tuple((first + MIDDLE).T)]
    seen = complete(np.isfinite(middles))
    return first[seen][on_ply(middles[seen])] if seen.any() else first[:0]


def noise_is_shared(image: CloudImage, squares: Whole, step: int) -> bool | None:
    """Return whether points `step` pixels apart, or twice that, have no white noise, which each point has for itself.

    None: nearly no square shows any noise. False, too, where there are too few squares. Noise that was smoothed varies
    slowly: its differences of fourth order along both axes of the image, which are 70 for white noise of one unit, are
    too small compared with its scatter. A scanner's own noise, even if correlated, has a white part. So has noise after
    a median filter, but not everywhere: patches of such a scan have none, as if they had been filled in.

    `squares` (N, 2) are rows and columns of the first pixels of squares on the ply.
    """
    some = squares[spread_over(len(squares), PLACES)]
    given = _depths(image.points, some, step)
    rounded_mm = step_of(given[np.isfinite(given)].astype(np.float32))
    near, far = (_depths(image.heights, some, apart) for apart in (step, 2 * step))
    return True if (own := _is_shared(near, rounded_mm)) else _is_shared(far, rounded_mm) or own


def _is_shared(depths: Floats, rounded_mm: float) -> bool | None:
    own, silent = _own_share(depths, rounded_mm)
    if silent > max(FEW, LIMITS.silent_share * len(depths)):
        return None
    told = len(own) >= max(FEW, LIMITS.least_share * len(depths))
    return told and float(np.quantile(own, LIMITS.quantile)) < LIMITS.white_share


def _depths(scan: Cloud, squares: Whole, step: int) -> Floats:
    """Return the (N, 16, 16) depths of the squares that lie in the image."""
    reach = step * np.arange(LIMITS.side)
    rows, columns = squares.T
    fits = (rows + reach[-1] < scan.shape[0]) & (columns + reach[-1] < scan.shape[1])
    at = (rows[fits, None] + reach)[:, :, None], (columns[fits, None] + reach)[:, None, :]
    depths = scan[(*at, 2)].astype(np.float64)
    return np.where(np.isfinite(depths), depths, np.nan)


def _own_share(depths: Floats, rounded_mm: float) -> tuple[Floats, int]:
    """Return the fourth differences of squares over their scatter about a polynomial, and how many show no noise.

    It is 1 for white noise.
    """
    flat = depths.reshape(len(depths), LIMITS.side**2)
    seen = np.isfinite(flat)
    enough = np.mean(seen, axis=1) >= SEEN
    flat, seen = flat[enough], seen[enough]
    if not len(flat):
        return np.empty(0), 0
    rest, count = _rest(np.where(seen, flat, 0.0), seen), np.sum(seen, axis=1)
    scatter = np.sqrt(np.sum(rest**2, axis=1) / (count - _polynomials()[0].shape[1]))
    rest = np.where(seen, rest, np.nan)  # a difference needs all of its points
    across = np.diff(rest.reshape(-1, LIMITS.side, LIMITS.side), n=4, axis=1)
    differences = np.diff(across, n=4, axis=2).reshape(len(rest), -1)
    there = np.isfinite(differences)
    number = np.sum(there, axis=1)
    squared = np.sum(np.where(there, differences, 0.0) ** 2, axis=1)
    of_white = np.sqrt(squared / np.maximum(number, 1)) / _FOURTH
    resolved = np.spacing(np.nanmax(np.abs(np.where(seen, flat, 0.0)), axis=1).astype(np.float32))
    noise_mm = np.maximum(LIMITS.resolutions * resolved, LIMITS.steps * rounded_mm)
    usable, noisy = number >= FEW, scatter > noise_mm
    tells = usable & noisy
    return np.asarray(of_white[tells] / scatter[tells]), int(np.count_nonzero(usable & ~noisy))


def _rest(flat: Floats, seen: Bools) -> Floats:
    """Return the residuals of each row about a polynomial fitted to its points that were seen; 0 for other points."""
    shape, products = _polynomials()
    level = np.sum(flat, axis=1, keepdims=True) / np.sum(seen, axis=1, keepdims=True)
    flat = np.where(seen, flat - level, 0.0)
    normal = np.tile(np.eye(shape.shape[1]), (len(flat), 1, 1))  # of a whole square, less what a few points lack
    square, point = np.nonzero(~seen)
    first = np.flatnonzero(np.diff(square, prepend=-1))
    normal[square[first]] -= np.add.reduceat(products[point], first)
    factors = np.linalg.solve(normal, product(flat, shape)[:, :, None])[:, :, 0]
    return np.where(seen, flat - product(factors, shape.T), 0.0)


@functools.cache
def _polynomials() -> tuple[Floats, Floats]:
    """Return orthonormal polynomials over a square, (256, 21), and the products of each pair, (256, 21, 21)."""
    u, v = np.meshgrid(*2 * (np.linspace(-1, 1, LIMITS.side),))
    powers = [(i, j) for i in range(LIMITS.degree + 1) for j in range(LIMITS.degree + 1 - i)]
    shape = np.linalg.qr(np.stack([(u**i * v**j).ravel() for i, j in powers], axis=1))[0]
    return shape, shape[:, :, None] * shape[:, None, :]
