"""Qualified chains and changed filters: python bench/trust/chains.py [--scans 100] [--others 6] [--out FILE].

The virtual scanner with each of these filters is a chain. Each is qualified by ten scans of one unmoved layup of the
first family. Then scans of other layups are compared with the chain that made them, which must raise no alarm, and with
every other one, which must, wherever the filters differ in a ridge by 0.05 mm or more. The ridge is that of the largest
excess of a fibre line over any of the pockets; it is read from the same scan with both filters.
"""

from __future__ import annotations

import argparse
import math
from collections import defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

import debulk
from debulk import pocket, scenes
from debulk.chain import Chain, Signature, recognised
from debulk.chain.figures import FIGURES
from debulk.chain.qualifying import limits
from debulk.chain.recognise import Recogniser
from lab.varied.filters import FILTERS, filtered

Cloud = NDArray[np.float32]
Floats = NDArray[np.float64]
Filter = Callable[[list[Cloud]], Cloud]
PIXELS = (640, 480)
MATTERS_MM = 0.05
QUALIFYING = 10


def _quadratic(size: int) -> Callable[[NDArray[np.float32]], NDArray[np.float32]]:
    """Return the fit of a quadratic surface in a moving window, which is what MLS does on a regular image."""
    v, u = np.mgrid[-(size // 2) : size // 2 + 1, -(size // 2) : size // 2 + 1]
    shape = np.stack([np.ones(size**2), u.ravel(), v.ravel(), u.ravel() ** 2, (u * v).ravel(), v.ravel() ** 2], axis=1)
    kernel = np.linalg.pinv(shape)[0].reshape(size, size)
    return lambda image: np.asarray(cv2.filter2D(image.astype(np.float64), -1, kernel), np.float32)


def _along_rays(change: Callable[[NDArray[np.float32]], NDArray[np.float32]]) -> Filter:
    return lambda frames: filtered(frames[0], change)


def _temporal(frames: list[Cloud]) -> Cloud:
    stack = np.stack(frames[:3])
    count = np.isfinite(stack[..., 2]).sum(axis=0)[..., None]
    return np.where(count > 0, np.nan_to_num(stack).sum(axis=0) / np.maximum(count, 1), np.nan).astype(np.float32)


def _holes_filled(frames: list[Cloud]) -> Cloud:
    """Fill pixels that were not seen by the mean of those around them, along their rays."""
    scan = frames[0]
    rows, columns = np.mgrid[: scan.shape[0], : scan.shape[1]]
    depth, seen = scan[..., 2], np.isfinite(scan[..., 2])
    x, y = scan[..., 0] / depth, scan[..., 1] / depth  # of a pinhole: linear in column and row
    along = np.polyfit(columns[seen], x[seen], 1), np.polyfit(rows[seen], y[seen], 1)
    share = cv2.blur(seen.astype(np.float64), (9, 9))
    mean = cv2.blur(np.where(seen, depth, 0.0).astype(np.float64), (9, 9)) / np.maximum(share, 1e-9)
    filled = np.where(seen, depth, np.where(share > 0.2, mean, np.nan))
    return np.dstack([filled * np.polyval(along[0], columns), filled * np.polyval(along[1], rows), filled]).astype(
        np.float32
    )


def _rounded(step_mm: float) -> Filter:
    return lambda frames: (np.round(frames[0].astype(np.float64) / step_mm) * step_mm).astype(np.float32)


def _voxel(side_mm: float) -> Filter:
    """Return the mean of the points in each cube, as libraries of point clouds thin them."""

    def mean(frames: list[Cloud]) -> Cloud:
        points = frames[0].reshape(-1, 3)
        points = points[np.isfinite(points).all(axis=1)].astype(np.float64)
        cell = np.floor(points / side_mm).astype(np.int64)
        cell -= cell.min(axis=0)
        size = cell.max(axis=0) + 1
        _, of = np.unique((cell[:, 0] * size[1] + cell[:, 1]) * size[2] + cell[:, 2], return_inverse=True)
        count = np.bincount(of)
        return np.stack([np.bincount(of, axis) / count for axis in points.T], axis=1).astype(np.float32)

    return mean


def _list(frames: list[Cloud]) -> Cloud:
    points = frames[0].reshape(-1, 3)
    return points[np.isfinite(points).all(axis=1)]


def _resampled(frames: list[Cloud]) -> Cloud:
    """Return the points in the middles of a mesh's facets: the mesh joins every four neighbouring pixels."""
    scan = frames[0]
    return _list([0.25 * (scan[:-1, :-1] + scan[1:, :-1] + scan[:-1, 1:] + scan[1:, 1:])])


def _decimated(frames: list[Cloud]) -> Cloud:
    return np.ascontiguousarray(frames[0][::2, ::2])


CHAINS: dict[str, Filter] = {
    "none": lambda frames: frames[0],
    "mean of 3 pixels": _along_rays(lambda image: np.asarray(cv2.blur(image, (3, 3)), np.float32)),
    "mean of 5 pixels": _along_rays(FILTERS["box of 5 pixels"]),
    "median of 3 pixels": _along_rays(lambda image: np.asarray(cv2.medianBlur(image, 3), np.float32)),
    "median of 5 pixels": _along_rays(FILTERS["median of 5 pixels"]),
    "Gaussian of 1 pixel": _along_rays(FILTERS["Gaussian of 1 pixel"]),
    "Gaussian of 2 pixels": _along_rays(FILTERS["Gaussian of 2 pixels"]),
    "bilateral, 5 pixels, 2 mm": _along_rays(FILTERS["bilateral, 5 pixels, 2 mm"]),
    "bilateral, 9 pixels, 0.2 mm": _along_rays(FILTERS["bilateral, 9 pixels, 0.2 mm"]),
    "MLS of 7 pixels": _along_rays(_quadratic(7)),
    "temporal, 3 frames": _temporal,
    "holes filled": _holes_filled,
    "rounded to 0.02 mm": _rounded(0.02),
    "rounded to 0.1 mm": _rounded(0.1),
    "decimated by 2": _decimated,
    "list of points": _list,
    "voxel of 1 mm": _voxel(1.0),
    "voxel of 2 mm": _voxel(2.0),
    "voxel of 3 mm": _voxel(3.0),
    "voxel of 4 mm": _voxel(4.0),
    "mesh resampled": _resampled,
}


class Seen(NamedTuple):
    """What a scan shows: its signature, and the ridge of the largest excess over each pocket, mm."""

    signature: Signature
    ridges_mm: Floats


def main() -> None:
    """Qualify every chain, compare scans with all of them, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scans", type=int, default=100, help="more scans of the unfiltered chain, of other layups")
    parser.add_argument("--others", type=int, default=6, help="layups whose scans are put through every filter")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    chains = {name: _chain(name, found) for name, found in _qualifying().items()}
    right: dict[str, list[list[str]]] = defaultdict(list)
    pairs: dict[tuple[str, str], list[tuple[bool, float]]] = defaultdict(list)
    why: dict[tuple[str, str], set[str]] = defaultdict(set)
    for seed in range(100, 100 + args.others):
        seen = _through_all(seed)
        for made, one in seen.items():
            right[made].append(_alarm(one, chains[made]))
            for other, chain in chains.items():
                if other != made:
                    off = float(np.nanmax(np.abs(one.ridges_mm - seen[other].ridges_mm)))
                    words = _alarm(one, chain)
                    pairs[other, made].append((bool(words), off))
                    why[other, made] |= set(words)
    quiet = [not _alarm(one, chains["none"]) for one in _plain(args.scans)]
    text = _table(right, pairs, why, quiet)
    print(text, end="")
    if args.out is not None:
        args.out.write_text(text)


def _table(
    right: dict[str, list[list[str]]],
    pairs: dict[tuple[str, str], list[tuple[bool, float]]],
    why: dict[tuple[str, str], set[str]],
    quiet: list[bool],
) -> str:
    every = [not one for found in right.values() for one in found]
    matter = [alarm for found in pairs.values() for alarm, off in found if off >= MATTERS_MM]
    all_pairs = [alarm for found in pairs.values() for alarm, _ in found]
    missed = sorted(
        (max(off for alarm, off in found if not alarm), f"{one} instead of {other}")
        for (other, one), found in pairs.items()
        if any(not alarm and off >= MATTERS_MM for alarm, off in found)
    )
    lines = [
        f"{len(right)} chains, each qualified by {QUALIFYING} scans of one layup of the first family, "
        f"{PIXELS[0]}x{PIXELS[1]}",
        "",
        f"right chain, no filter, other layups: {sum(quiet)} of {len(quiet)} scans without an alarm",
        f"right chain, every filter, other layups: {sum(every)} of {len(every)} without an alarm",
        f"another filter that changes a ridge by {MATTERS_MM} mm or more: {sum(matter)} of {len(matter)} found",
        f"another filter, whatever it changes: {sum(all_pairs)} of {len(all_pairs)} found",
        "",
        f"{'qualified: none; came':32}{'right':>8}{'found':>8}{'largest change, mm':>20}  by",
    ]
    for name, found in right.items():
        own = f"{found.count([])}/{len(found)}"
        if name == "none":
            lines.append(f"{name:32}{own:>8}")
            continue
        of = pairs["none", name]
        off = max(one for _, one in of)
        alarms = f"{sum(alarm for alarm, _ in of)}/{len(of)}"
        lines.append(f"{name:32}{own:>8}{alarms:>8}{off:>20.2f}  {', '.join(sorted(why['none', name])) or '-'}")
    lines += ["", "not found although it matters:", *(f"{name}: {off:.2f} mm" for off, name in missed[::-1])]
    if not missed:
        lines.append("none")
    false = [f"{name}: {', '.join(one)}" for name, found in right.items() for one in found if one]
    lines += ["", "alarms although the chain was right:", *(false or ["none"])]
    return "\n".join(line.rstrip() for line in lines) + "\n"


def _alarm(seen: Seen | Signature, chain: Chain) -> list[str]:
    """Return in what a scan differs from a chain."""
    signature = seen.signature if isinstance(seen, Seen) else seen
    return [one.differs for one in recognised(signature, chain).report.figures if one.differs]


def _chain(name: str, found: list[Signature]) -> Chain:
    values = {one.name: np.array([getattr(of, one.name) for of in found]) for one in FIGURES}
    known = {key: of for key, of in values.items() if np.isfinite(of).all()}
    return Chain(name=name, made_utc="2026-01-01", debulk=debulk.__version__, scans=len(found), figures=limits(known))


def _inspector(layup: scenes.Layup) -> debulk.Inspector:
    return debulk.Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)


def _signature(inspector: debulk.Inspector, scan: Cloud) -> Signature:
    measuring = Recogniser(inspector._filled, None, _NOTHING)
    placing = inspector._placing
    sample = placing.look(scan, debulk._core.Stop())
    figures = {one.name: one.measured for one in measuring.look(scan, sample).report.figures}
    return Signature(**{one.name: figures.get(one.name, math.nan) for one in FIGURES})


def _qualifying() -> dict[str, list[Signature]]:
    first = scenes.layup(0, PIXELS)
    inspector = _inspector(first)
    scans = [scenes.layup(0, PIXELS, repeat=k).scan for k in range(QUALIFYING + 2)]
    return {
        name: [_signature(inspector, change(scans[k:])) for k in range(QUALIFYING)] for name, change in CHAINS.items()
    }


def _through_all(seed: int) -> dict[str, Seen]:
    layup = scenes.layup(seed, PIXELS)
    inspector = _inspector(layup)
    frames = [layup.scan, *(scenes.layup(seed, PIXELS, repeat=k).scan for k in (1, 2))]
    outlines = [one.pocket.outline_mm for one in inspector.find(layup.scan).pockets]
    out = {}
    for name, change in CHAINS.items():
        scan = change(frames)
        out[name] = Seen(_signature(inspector, scan), _ridges(inspector, scan, outlines))
    return out


def _ridges(inspector: debulk.Inspector, scan: Cloud, outlines: list[Floats]) -> Floats:
    """Return the ridge of the largest excess over each outline, mm; NaN where no line is."""
    runs = inspector.find(scan).runs
    if runs is None or runs.largest is None:
        return np.full(len(outlines), np.nan)
    grid = runs.largest
    y, x = np.mgrid[: grid.values.shape[0], : grid.values.shape[1]]
    xy = grid.origin_mm + grid.spacing_mm * np.stack([x.ravel(), y.ravel()], axis=1)
    values = grid.values.ravel()
    return np.array([0.5 * np.nanmax(np.where(pocket.inside(one, xy), values, 0.0)) for one in outlines])


def _plain(count: int) -> Iterator[Signature]:
    """Return signatures of unfiltered scans, ten of each of several layups."""
    for k in range(count):
        if k % 10 == 0:
            layup = scenes.layup(200 + k // 10, PIXELS)
            inspector = _inspector(layup)
        yield _signature(inspector, scenes.layup(200 + k // 10, PIXELS, repeat=k % 10).scan)


_NOTHING = Chain(
    name="none",
    made_utc="",
    debulk=debulk.__version__,
    scans=1,
    figures=tuple(debulk.chain.Figure(name=one.name, mean=0.0, sd=0.0, low=None, high=None) for one in FIGURES),
)

if __name__ == "__main__":
    main()
