"""What a scanner's software does to a cloud before it is written: filters of images and of lists of points."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

__all__ = ["IMAGES", "LISTS", "as_list", "filled_linearly", "voxel"]

Floats = NDArray[np.float64]
Cloud = NDArray[np.float32]


def _at_depth(cloud: Cloud, depth: Floats) -> Cloud:
    """Return a cloud whose points are moved along their rays to other depths."""
    z = cloud[..., 2].astype(np.float64)
    return (cloud * (depth / z)[..., None]).astype(np.float32)


def _weighted(depth: Floats, by: Callable[[Floats], NDArray[Any]]) -> Floats:
    """Return a linear filter's result, of the known depths only."""
    known = np.isfinite(depth)
    middle = float(np.nanmedian(depth))
    part, share = by(np.where(known, depth - middle, 0.0)), by(known.astype(np.float64))
    return np.where(known, middle + part / np.maximum(share, 1e-9), np.nan)


def _of_depth(by: Callable[[Floats], Floats]) -> Callable[[Cloud], Cloud]:
    return lambda cloud: _at_depth(cloud, by(cloud[..., 2].astype(np.float64)))


def _mean(pixels: int) -> Callable[[Cloud], Cloud]:
    return _of_depth(lambda z: _weighted(z, lambda v: cv2.blur(v, (pixels, pixels))))


def _gaussian(sigma: float) -> Callable[[Cloud], Cloud]:
    return _of_depth(lambda z: _weighted(z, lambda v: cv2.GaussianBlur(v, (0, 0), sigma)))


def _median(pixels: int) -> Callable[[Cloud], Cloud]:
    def by(z: Floats) -> Floats:
        middle = float(np.nanmedian(z))
        out = cv2.medianBlur(np.where(np.isfinite(z), z - middle, 0.0).astype(np.float32), pixels)
        return np.where(np.isfinite(z), middle + out.astype(np.float64), np.nan)

    return _of_depth(by)


def _bilateral(pixels: int, sigma_mm: float) -> Callable[[Cloud], Cloud]:
    def by(z: Floats) -> Floats:
        middle = float(np.nanmedian(z))
        flat = np.where(np.isfinite(z), z - middle, 0.0).astype(np.float32)
        out = cv2.bilateralFilter(flat, pixels, sigma_mm, pixels / 3)
        return np.where(np.isfinite(z), middle + out.astype(np.float64), np.nan)

    return _of_depth(by)


def _quadratic(pixels: int) -> Callable[[Cloud], Cloud]:
    """Return a filter like moving least squares: the value in the middle of a quadratic fitted to a window."""
    r = np.arange(pixels) - pixels // 2
    x, y = (part.ravel() for part in np.meshgrid(r, r))
    weight = np.exp(-(x * x + y * y) / (2 * (pixels / 3.5) ** 2))
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1).astype(np.float64)
    kernel = (np.linalg.inv(terms.T @ (weight[:, None] * terms)) @ (terms * weight[:, None]).T)[0]
    kernel = kernel.reshape(pixels, pixels)
    return _of_depth(lambda z: _weighted(z, lambda v: cv2.filter2D(v, -1, kernel, borderType=cv2.BORDER_REFLECT)))


def _every(step: int) -> Callable[[Cloud], Cloud]:
    return lambda cloud: cloud[::step, ::step].copy()


IMAGES: dict[str, Callable[[Cloud], Cloud]] = {
    **{f"mean of {n} pixels": _mean(n) for n in (3, 5, 9)},
    **{f"median of {n} pixels": _median(n) for n in (3, 5)},
    **{f"Gaussian of {s:g} pixels": _gaussian(s) for s in (1, 2, 4, 8)},
    "bilateral of 9 pixels": _bilateral(9, 2.0),
    "quadratic of 9 pixels": _quadratic(9),
    "quadratic of 15 pixels": _quadratic(15),
    "every second pixel": _every(2),
    "every fifth pixel": _every(5),
}


def as_list(cloud: Cloud, rng: np.random.Generator) -> Cloud:
    """Return the points that were seen, in no order."""
    points = cloud.reshape(-1, 3)
    return rng.permutation(points[np.isfinite(points).all(axis=1)])


def voxel(side_mm: float, cloud: Cloud, rng: np.random.Generator) -> Cloud:
    """Return the mean of the points in every cube of a grid."""
    points = as_list(cloud, rng).astype(np.float64)
    _, of, count = np.unique(np.floor(points / side_mm), axis=0, return_inverse=True, return_counts=True)
    means = np.stack([np.bincount(of.ravel(), points[:, k]) / count for k in range(3)], axis=1)
    return rng.permutation(means).astype(np.float32)


def _listed(by: Callable[[Cloud], Cloud], cloud: Cloud, rng: np.random.Generator) -> Cloud:
    return as_list(by(cloud), rng)


LISTS: dict[str, Callable[[Cloud, np.random.Generator], Cloud]] = {
    **{f"voxel mean of {s:g} mm": partial(voxel, s) for s in (1, 2, 3, 4)},
    **{
        f"list, {name}": partial(_listed, IMAGES[name])
        for name in ("mean of 5 pixels", "Gaussian of 2 pixels", "Gaussian of 4 pixels", "Gaussian of 8 pixels",
                     "median of 5 pixels", "every fifth pixel")
    },
}  # fmt: skip


def filled_linearly(cloud: Cloud, hole: NDArray[np.bool_]) -> Cloud:
    """Return a cloud in whose rows a hole is filled by a straight line from side to side."""
    depth = cloud[..., 2].astype(np.float64)
    ray = cloud / cloud[..., 2:]
    column = np.arange(depth.shape[1])
    for row in np.flatnonzero(hole.any(axis=1)):
        gone = hole[row]
        depth[row, gone] = np.interp(column[gone], column[~gone], depth[row, ~gone])
    return (ray * depth[..., None]).astype(np.float32)
