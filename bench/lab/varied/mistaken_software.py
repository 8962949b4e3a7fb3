"""Mistakes in a scanner's software settings: it smooths, interpolates, or writes markers for unseen points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lab.varied.given import AnyLayup, Cloud, Given, Mistake

Rng = np.random.Generator


def _smoothed(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    from lab.varied.filters import FILTERS, filtered

    name = list(FILTERS)[int(rng.integers(len(FILTERS)))]
    return replace(given, scan=filtered(given.scan, FILTERS[name]), note=name)


def _doubled(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    """Keep every second row and column, and fill in means between them."""
    scan = given.scan.copy()
    scan[1:-1:2] = _between(scan[:-2:2], scan[2::2])[: len(scan[1:-1:2])]
    scan[:, 1:-1:2] = _between(scan[:, :-2:2], scan[:, 2::2])[:, : scan[:, 1:-1:2].shape[1]]
    return replace(given, scan=scan)


def _between(left: Cloud, right: Cloud) -> Cloud:
    return np.asarray(0.5 * (left + right), np.float32)


def _marked(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    marks = ((0.0, 0.0, 0.0), (-9999.0, -9999.0, -9999.0), (0.0, 0.0, 1e5))
    mark = marks[int(rng.integers(len(marks)))]
    unseen = np.isnan(given.scan[..., 2])
    if not unseen.any():  # mark at least a strip at the image's border
        unseen[:, : unseen.shape[1] // 50] = True
    scan = np.where(unseen[..., None], np.array(mark, np.float32), given.scan)
    return replace(given, scan=scan.astype(np.float32), note=f"{mark}")


SOFTWARE: tuple[Mistake, ...] = (
    Mistake("scan smoothed", False, _smoothed),
    Mistake("scan interpolated", False, _doubled),
    Mistake("marks for what was not seen", False, _marked),
)
"""Mistakes in the software."""
