"""Fingerprints of arrays: SHA-256, of a scan in a thread of its own beside the inspection."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from debulk import _core, cloud
from debulk._core import InputError
from debulk.results.trace import ArrayTrace

__all__ = ["beside", "of_cloud", "of_mask"]

_BLOCK = 1 << 23  # bytes, a few milliseconds: so soon a cancelled inspection ends


def of_cloud(points: ArrayLike, stop: _core.Stop | None = None, name: str = "points") -> ArrayTrace:
    """Fingerprint a cloud as it is read: float32, mm. Without the hash where the stop was raised meanwhile."""
    return _of(cloud.as_cloud(points, name), "<f4", stop)


def of_mask(mask: NDArray[np.bool_]) -> ArrayTrace:
    """Fingerprint a mask, one byte per pixel."""
    return _of(mask, "u1", None)


def _of(array: NDArray[Any], dtype: str, stop: _core.Stop | None) -> ArrayTrace:
    plain = np.ascontiguousarray(array, dtype=dtype)
    data, digest = plain.reshape(-1).view(np.uint8), hashlib.sha256()
    for first in range(0, data.size, _BLOCK):
        if stop is not None and stop.now():
            return ArrayTrace(shape=array.shape)
        digest.update(data[first : first + _BLOCK].data)  # releases the GIL
    return ArrayTrace(shape=array.shape, sha256=digest.hexdigest())


@contextmanager
def beside(points: ArrayLike, stop: _core.Stop, wanted: bool) -> Iterator[Callable[[], ArrayTrace | None]]:
    """Fingerprint a scan while the body runs; it gets a function that waits for the result.

    None for what is no cloud, which the inspection itself refuses with its reason. A scan that its owner changes
    meanwhile has the fingerprint of neither state.
    """

    def work() -> ArrayTrace | None:
        try:
            return of_cloud(points, stop) if wanted else ArrayTrace(shape=np.shape(points))
        except (InputError, ValueError, TypeError):
            return None

    with ThreadPoolExecutor(1, "debulk-sha256") as pool:
        yield pool.submit(work).result
