"""The signature of a scan: what its own points on the ply show of the scanner, its filters and the export."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk.arrays import Cloud, Floats
from debulk.inspection.clouds.products import product
from debulk.inspection.clouds.thinning import complete
from debulk.inspection.evidence.cloud_image import step_of
from debulk.inspection.evidence.medians import OF_MEDIAN

_DEGREE = 4  # of the polynomial that takes the ply's shape from a window
_POWERS = [(i, j) for i in range(_DEGREE + 1) for j in range(_DEGREE + 1 - i)]
_LEAST_POINTS = 100  # of a window, for a polynomial of 15 coefficients
_LEAST_WINDOWS = 12
_OUTLIER = 4.0  # robust standard deviations beyond which a point is no noise
_LAGS = ((0.0, 1.5), (1.5, 2.5), (2.5, 4.5))  # distances in pitches at which the correlation is read
_FIRM = 1e-9  # of the squares' sum: points on one line leave a polynomial undetermined


@dataclass(frozen=True)
class Signature:
    """What a scan shows of the chain that made it; NaN where it shows too little."""

    pitch_mm: float
    """Side of the square that each point of the cloud has for itself."""
    noise_mm: float
    """Scatter of the points about a smooth surface, along the scanner's axis."""
    near: float
    middle: float
    far: float
    """`near`, `middle`, `far`: correlation of that scatter between points at most 1.5, 1.5 to 2.5, and 2.5 to 4.5
    pitches apart. White noise has a little less than 0, because the smooth surface follows it."""
    repeated: float
    """Share of the neighbours, at most 1.5 pitches apart, whose depths are the same to the last bit, as a median filter
    leaves them."""
    step_mm: float
    """Step to which the depths, the scanner's z, were rounded; 0: no coarser than float32."""
    missing: float
    """Share of an image's points on the ply that were not seen; NaN for a list of points."""
    edge_mm: float = float("nan")
    """Sigma of the Gaussian that would spread the ply's edge as much, less two standard errors; NaN without an outline
    or an image."""
    image: float = 1.0
    """1: the scan is an image; 0: a list of points."""


def signature_of(windows: Sequence[Cloud], pitch_mm: float, *, image: bool, edge_mm: float = float("nan")) -> Signature:
    """Measure a scan by the points of some windows on the ply, (M, 3) each, NaN: not seen; see `windows_of`.

    Of an image the points that were not seen are counted. The spread of the ply's edge is measured elsewhere.
    """
    unseen = float("nan")
    if image and windows:
        unseen = float(np.mean([1 - complete(np.isfinite(one)).mean() for one in windows]))
    full = [one[complete(np.isfinite(one))] for one in windows]
    full = [one for one in full if len(one) >= _LEAST_POINTS]
    if len(full) < _LEAST_WINDOWS:
        nothing = (float("nan"),) * 6
        return Signature(pitch_mm, *nothing, unseen, edge_mm, float(image))
    each = np.array([_of_window(one, pitch_mm) for one in full])
    noise, near, middle, far, repeated = np.median(each, axis=0).tolist()
    return Signature(
        pitch_mm, noise, near, middle, far, repeated, step_of(np.concatenate(full)[:, 2]), unseen, edge_mm, float(image)
    )


def _of_window(points: Cloud, pitch_mm: float) -> tuple[float, ...]:
    """Return scatter, correlations, and the share of neighbours whose depths repeat, of (M, 3) points."""
    xy = points[:, :2].astype(np.float64)
    xy -= xy.mean(axis=0)
    rest, kept = _rest(xy / max(float(np.abs(xy).max()), 1e-9), points[:, 2].astype(np.float64))
    rest, depth = rest[kept], points[kept, 2]
    x, y = (xy[kept] / pitch_mm).astype(np.float32).T
    apart = (x[:, None] - x) ** 2 + (y[:, None] - y) ** 2
    np.fill_diagonal(apart, np.inf)
    variance = max(float(np.mean(rest**2)), 1e-30)
    products = np.outer(*2 * (rest.astype(np.float32),))
    shared = []
    for low, high in _LAGS:
        these = products[(apart >= low**2) & (apart < high**2)]
        shared.append(float(these.mean()) / variance if len(these) else 0.0)
    first, second = np.nonzero(apart < _LAGS[0][1] ** 2)
    same = (depth[first] == depth[second]).mean() if len(first) else 0.0
    return float(np.sqrt(variance)), *shared, float(same)


def _rest(uv: Floats, depth: Floats) -> tuple[Floats, NDArray[np.bool_]]:
    """Return what a polynomial leaves of the depths, and which points are no outliers; fitted twice."""
    shape = np.stack([uv[:, 0] ** i * uv[:, 1] ** j for i, j in _POWERS], axis=1)
    kept = np.ones(len(uv), dtype=np.bool_)
    about = depth - np.median(depth)
    for _ in range(2):
        of = shape[kept]
        normal = np.einsum("ni,nj->ij", of, of) + _FIRM * np.eye(len(_POWERS))
        factors = np.linalg.solve(normal, np.einsum("ni,n->i", of, about[kept]))
        rest = about - product(shape, factors)
        sigma = OF_MEDIAN * float(np.median(np.abs(rest)))
        kept = np.abs(rest) <= max(_OUTLIER * sigma, 1e-12)
    return rest, kept
