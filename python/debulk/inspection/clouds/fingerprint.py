"""Fingerprints of arrays; that of a scan is computed in its own thread in parallel to the inspection."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from contextlib import AbstractContextManager
from typing import Any, Literal

import numpy as np
import xxhash
from numpy.typing import ArrayLike, NDArray

from debulk import _core
from debulk._core import InputError
from debulk.inspection.clouds.cleaning import pieces
from debulk.inspection.running.cycle import in_parallel
from debulk.results.trace import ArrayTrace

Hash = Literal["sha256", "xxh3"]
Scanned = AbstractContextManager[Callable[[], ArrayTrace | None]]
_MAKE: dict[Hash, Callable[[], Any]] = {"sha256": hashlib.sha256, "xxh3": xxhash.xxh3_128}


def of_cloud(
    points: ArrayLike, stop: _core.Stop | None = None, name: str = "points", kind: Hash = "sha256"
) -> ArrayTrace:
    """Fingerprint a cloud as it is read (float32, mm); the hash is missing if the stop was raised meanwhile."""
    digest = _MAKE[kind]()
    try:
        for piece in pieces(points, name, stop):
            digest.update(piece.astype("<f4", copy=False).reshape(-1).view(np.uint8).data)  # releases the GIL
    except _core.Stopped:
        return ArrayTrace(shape=np.shape(points))
    return ArrayTrace(shape=np.shape(points), **{kind: digest.hexdigest()})


def of_mask(mask: NDArray[np.bool_]) -> ArrayTrace:
    """Fingerprint a mask, one byte per pixel."""
    plain = np.ascontiguousarray(mask, dtype="u1")
    return ArrayTrace(shape=mask.shape, sha256=hashlib.sha256(plain.reshape(-1).data).hexdigest())


def of_scan(points: ArrayLike, stop: _core.Stop, kind: Hash | None) -> Scanned:
    """Fingerprint a scan while the body runs, as `in_parallel` does any work, however few threads are allowed.

    The result is None if the scan is no cloud; the inspection itself refuses it and gives the reason. If its owner
    changes the scan meanwhile, the fingerprint matches neither state.
    """

    def work() -> ArrayTrace | None:
        try:
            return of_cloud(points, stop, kind=kind) if kind else ArrayTrace(shape=np.shape(points))
        except (InputError, ValueError, TypeError):
            return None

    return in_parallel(stop, work, threads=0)
