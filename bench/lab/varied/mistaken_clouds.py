"""Mistakes in the clouds: bent, thinned, cut off, mirrored, with holes at important places."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from lab.varied.faults import Hole
from lab.varied.given import AnyLayup, Change, Cloud, Floats, Given, Mistake

Rng = np.random.Generator


def raised(given: Given, cloud: Cloud, rise: Callable[[Floats, Floats], Floats]) -> Cloud:
    """Move points along their rays so that they rise in the mold's frame by a function of x and y, each -1 to 1."""
    points = given.in_mold(cloud)
    x, y = points[..., 0], points[..., 1]
    low, high = np.nanmin(points[..., :2], axis=(0, 1)), np.nanmax(points[..., :2], axis=(0, 1))
    u, v = 2 * (x - low[0]) / (high[0] - low[0]) - 1, 2 * (y - low[1]) / (high[1] - low[1]) - 1
    pose = np.eye(4) if given.mold_from_scanner is None else given.mold_from_scanner
    fall = sum(pose[2, i] * cloud[..., i].astype(np.float64) for i in range(3))
    lifted: Cloud = (cloud * (1 + rise(u, v) / fall)[..., None]).astype(np.float32)
    return lifted


def _bow(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    size = float(rng.choice([-1, 1]) * np.exp(rng.uniform(np.log(0.2), np.log(3))))
    scan = raised(given, given.scan, lambda u, v: size * (1 - u * u))
    return replace(given, scan=scan, note=f"{size:+.2f} mm")


def _warp(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    size = float(rng.choice([-1, 1]) * np.exp(rng.uniform(np.log(0.2), np.log(3))))
    scan = raised(given, given.scan, lambda u, v: size * u * v)
    return replace(given, scan=scan, note=f"{size:+.2f} mm")


def _both(change: Callable[[Cloud], Cloud]) -> Change:
    return lambda given, rng, layup: replace(given, scan=change(given.scan), reference=change(given.reference))


def _mirrored(cloud: Cloud) -> Cloud:
    """Make the cloud of an image that was mirrored before it was turned into points."""
    return np.ascontiguousarray(cloud[:, ::-1]) * np.array([-1, 1, 1], np.float32)


def _half_unseen(name: str) -> Change:
    def change(given: Given, rng: Rng, layup: AnyLayup) -> Given:
        cloud = getattr(given, name).copy()
        side = int(rng.integers(4))
        height, width = cloud.shape[:2]
        cloud[
            (
                (slice(0, height // 2), slice(None)),
                (slice(height // 2, None), slice(None)),
                (slice(None), slice(0, width // 2)),
                (slice(None), slice(width // 2, None)),
            )[side]
        ] = np.nan
        changed: dict[str, Any] = {name: cloud}
        return replace(given, **changed)

    return change


def _coarse_reference(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    """Keep only points some 6 to 16 mm apart, as a list."""
    pitch = float(rng.uniform(6, 16))
    step = max(2, round(pitch / _pixel_mm(given.reference)))
    points = given.reference[::step, ::step].reshape(-1, 3)
    return replace(given, reference=points[np.isfinite(points[:, 2])], note=f"{pitch:.1f} mm")


def _thinned_reference(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    """Leave an image in which only one pixel in several, along rows and columns, has a point."""
    pitch = float(rng.uniform(4, 12))
    step = max(2, round(pitch / _pixel_mm(given.reference)))
    thin = np.full_like(given.reference, np.nan)
    thin[::step, ::step] = given.reference[::step, ::step]
    return replace(given, reference=thin, note=f"{pitch:.1f} mm")


def _thinned_scan(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    """Keep every 8th, 24th or 100th point, as a list."""
    points = given.scan.reshape(-1, 3)
    points = points[np.isfinite(points[:, 2])]
    return replace(given, scan=points[:: int(rng.choice([8, 24, 100]))])


def _pixel_mm(cloud: Cloud) -> float:
    return float(np.nanmedian(np.linalg.norm(np.diff(cloud[::7, :].astype(np.float64), axis=1), axis=-1)))


def _without(given: Given, holes: list[Hole]) -> Given:
    points = given.in_mold(given.scan)
    scan = given.scan.copy()
    for hole in holes:
        scan[hole.covers(points[..., 0], points[..., 1])] = np.nan
    return replace(given, scan=scan)


def _pocket(layup: AnyLayup, rng: Rng) -> Any:
    """Pick the pocket with the most excess, or any other."""
    known = list(getattr(layup, "truth").pockets)  # noqa: B009
    if not known:
        return None
    worst = max(known, key=lambda p: p.ridge_mm if hasattr(p, "ridge_mm") else p.straight_excess_mm)
    return worst if rng.random() < 0.7 else known[int(rng.integers(len(known)))]


def _hole_over_pocket(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    pocket = _pocket(layup, rng)
    if pocket is None:
        return replace(given, note="no pocket")
    size = float(rng.uniform(16, 90))
    x, y = np.asarray(pocket.centre_mm) + rng.normal(0, 0.2 * size, 2)
    hole = Hole((float(x), float(y)), (size / 2, size / 2 * rng.uniform(0.5, 1)), rng.uniform(0, np.pi), False)
    return replace(_without(given, [hole]), note=f"{size:.0f} mm")


def _hole_across_rim(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    pocket = _pocket(layup, rng)
    if pocket is None:
        return replace(given, note="no pocket")
    size = float(rng.uniform(10, 60))
    x, y = pocket.outline_mm[int(rng.integers(len(pocket.outline_mm)))]
    hole = Hole((float(x), float(y)), (size / 2, size / 2 * rng.uniform(0.4, 1)), rng.uniform(0, np.pi), True)
    return replace(_without(given, [hole]), note=f"{size:.0f} mm")


def _many_holes(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    corners = layup.ply_outline
    low, high = corners.min(axis=0), corners.max(axis=0)
    holes = []
    for size in np.exp(rng.uniform(np.log(2), np.log(100), int(rng.integers(3, 12)))):
        x, y = rng.uniform(low, high)
        half = (float(size / 2), float(size / 2 * rng.uniform(0.3, 1)))
        holes.append(Hole((float(x), float(y)), half, rng.uniform(0, np.pi), bool(rng.random() < 0.5)))
    return replace(_without(given, holes), note=f"{len(holes)} holes")


def _rows_missing(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    rows = given.scan.shape[0]
    kept = round(rows * float(rng.choice([400 / 960, 0.8, 0.95])))
    return replace(given, scan=given.scan[:kept], mask=None if given.mask is None else given.mask[:kept])


def _shuffled(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    points = given.scan.reshape(-1, 3)
    return replace(given, scan=points[rng.permutation(len(points))].reshape(given.scan.shape))


def _quantised(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    return replace(given, scan=np.round(given.scan), reference=np.round(given.reference))


def _scale_error(given: Given, rng: Rng, layup: AnyLayup) -> Given:
    factor = np.float32(1 + rng.choice([-0.01, 0.01]))
    return replace(given, scan=given.scan * factor, note=f"{factor:.2f}")


CLOUDS: tuple[Mistake, ...] = (
    Mistake("bow", False, _bow),
    Mistake("warp", False, _warp),
    Mistake("half of the reference unseen", True, _half_unseen("reference")),
    Mistake("half of the scan unseen", True, _half_unseen("scan")),
    Mistake("coarse reference", False, _coarse_reference),
    Mistake("thinned reference", False, _thinned_reference),
    Mistake("thinned scan", False, _thinned_scan),
    Mistake("hole over a pocket", False, _hole_over_pocket),
    Mistake("drop-out across a rim", False, _hole_across_rim),
    Mistake("holes", False, _many_holes),
    Mistake("scan mirrored", True, lambda given, rng, layup: replace(given, scan=_mirrored(given.scan))),
    Mistake("scan and reference mirrored", False, _both(_mirrored)),
    Mistake("columns in reverse", False, _both(lambda cloud: np.ascontiguousarray(cloud[:, ::-1]))),
    Mistake("rows missing", False, _rows_missing),
    Mistake("points shuffled", False, _shuffled),
    Mistake("whole millimetres", False, _quantised),
    Mistake("scale of the scan off by 1 %", True, _scale_error),
)
"""Mistakes in the clouds."""
