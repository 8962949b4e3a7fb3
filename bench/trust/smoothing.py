"""Verdicts on scans that were smoothed: python bench/trust/smoothing.py [--bumps 30] [--layups 60] [--out FILE].

Bells of random width, length and height lie on the mold of a virtual layup of the first family; by the arc of their
profile they are slightly to well above the limit. Their scans are put through the filters that scanners' software
offers. Also measured is by how much layups of both families, unfiltered and filtered, spread the ply's edge.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

import debulk
from debulk import pocket, scenes
from debulk.inspection.evidence.outline import Outline
from debulk.inspection.rawscan.edge_spread import EdgeSpread
from lab.varied import varied_layup
from lab.varied.filters import FILTERS, filtered

Floats = NDArray[np.float64]
NOISE_MM = 0.02
TOLD = {"share their measuring noise": "noise", "spreads the ply's edge": "edge"}
SPREAD = ("Gaussian of 1 pixel", "box of 5 pixels", "median of 5 pixels, twice", "bilateral, 9 pixels, 2 mm")
# As lists of points in no order: a filter of the image before it is written, or means over cubes of so many mm.
LISTS: dict[str, str | float] = {
    "list of points": "none",
    "list, Gaussian of 4 pixels": "Gaussian of 4 pixels",
    "list, means over 3 mm": 3.0,
}
SAID = ("cease", "undecided", "crease", "invalid")


def main() -> None:
    """Inspect the scans and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bumps", type=int, default=30)
    parser.add_argument("--layups", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--pixels", default="1280x960")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    width, height = map(int, args.pixels.split("x"))
    rng = np.random.default_rng([args.seed, 5])
    counts: dict[str, dict[str, int]] = {name: {} for name in ("none", *FILTERS, *LISTS)}
    for number in range(args.bumps):
        layup = scenes.layup(3 + number % 5, (width, height))
        inspector = debulk.Inspector(
            None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner
        )
        scan = laid(layup, inspector, bell(layup, rng), rng)
        for name, of in counts.items():
            given = listed(scan, LISTS[name], rng) if name in LISTS else through(scan, name)
            report = inspector.inspect(given)
            of[report.verdict.value] = of.get(report.verdict.value, 0) + 1
            for words, told in TOLD.items():
                of[told] = of.get(told, 0) + (words in report.reason)
    lines = [
        f"{args.bumps} bells that crease (ridge 0.65 to 0.9 mm by the arc of the profile), 10 to 40 mm wide, on five "
        f"layups of the first family, {args.pixels}, noise {NOISE_MM} mm; CEASE is wrong for each",
        "told by noise or by the ply's edge: in the reason (a layup that is CREASE does not say it)",
        "",
        f"{'filter':32}" + "".join(f"{word:>11}" for word in (*SAID, "noise", "edge")),
    ]
    lines += [
        f"{name:32}" + "".join(f"{of.get(word, 0) or '-':>11}" for word in (*SAID, "noise", "edge"))
        for name, of in counts.items()
    ]
    lines += ["", *edges(args.layups, args.seed, (width, height))]
    text = "\n".join(line.rstrip() for line in lines) + "\n"
    print(text, end="")
    if args.out is not None:
        args.out.write_text(text)


def through(scan: NDArray[np.float32], name: str) -> NDArray[np.float32]:
    """Return a scan put through a filter of this name."""
    return scan if name == "none" else filtered(scan, FILTERS[name])


def listed(scan: NDArray[np.float32], by: str | float, rng: np.random.Generator) -> NDArray[np.float32]:
    """Return a scan as a list of points, after a filter of this name, or as means over cubes of this side."""
    points = (through(scan, by) if isinstance(by, str) else scan).reshape(-1, 3)
    points = rng.permutation(points[np.isfinite(points).all(axis=1)])
    if isinstance(by, str):
        return points
    _, of, count = np.unique(np.floor(points / by), axis=0, return_inverse=True, return_counts=True)
    means = [np.bincount(of.ravel(), points[:, k].astype(np.float64)) / count for k in range(3)]
    return np.stack(means, axis=1).astype(np.float32)


def edges(number: int, seed: int, pixels: tuple[int, int]) -> list[str]:
    """Return as text by how much layups spread the ply's edge; two of three are of the second family."""
    spreads: dict[str, list[float]] = {name: [] for name in ("none", *SPREAD)}
    for k in range(number):
        make = scenes.layup if k % 3 == 0 else varied_layup
        layup = make(1000 * seed + k, pixels)
        inspector = debulk.Inspector(
            None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner
        )
        edge = EdgeSpread(inspector.setup, Outline(layup.ply_outline))
        for name, of in spreads.items():
            scan = layup.scan if name == "none" else filtered(layup.scan, FILTERS[name])
            of.append(edge.least_mm(scan) / pitch_mm(scan))
    lines = [
        f"by how much {number} layups of both families spread the ply's edge: sigma, pixels, less two standard errors; "
        "more than 0.9 (or 0.45 mm) is told",
        "",
        f"{'filter':32}{'least':>11}{'median':>11}{'most':>11}{'unknown':>11}",
    ]
    for name, of in spreads.items():
        least, middle, most = np.nanquantile(of, [0, 0.5, 1])
        lines.append(f"{name:32}{least:11.2f}{middle:11.2f}{most:11.2f}{int(np.isnan(of).sum()) or '-':>11}")
    return lines


def pitch_mm(scan: NDArray[np.float32]) -> float:
    """Return the median distance of neighbours in a row."""
    return float(np.nanmedian(np.linalg.norm(np.diff(scan[::16].astype(np.float64), axis=1), axis=-1)))


def bell(layup: scenes.Layup, rng: np.random.Generator) -> Floats:
    """Return x, y, width, length and height, mm, of a bell that creases."""
    wide = float(np.exp(rng.uniform(np.log(10), np.log(40))))
    long = wide * float(rng.uniform(1, 2.5))
    excess = 2 * (rng.uniform(0.65, 0.9) - 0.43 * layup.truth.thickness_mm)
    low, high = layup.ply_outline.min(axis=0), layup.ply_outline.max(axis=0)
    x, y = (low + high) / 2 + rng.uniform(-0.25, 0.25, 2) * (high - low)
    return np.array([x, y, wide, long, height_of(wide, excess)])


def height_of(wide_mm: float, excess_mm: float) -> float:
    """Return the height at which the arc over the profile is longer than its chord by `excess_mm`."""
    s = np.linspace(-0.5, 0.5, 2001) * wide_mm
    low, high = 0.0, wide_mm
    for _ in range(50):
        middle = 0.5 * (low + high)
        rise = np.diff(middle * np.cos(np.pi * s / wide_mm) ** 2)
        low, high = (middle, high) if np.hypot(rise, np.diff(s)).sum() - wide_mm < excess_mm else (low, middle)
    return low


def laid(
    layup: scenes.Layup, inspector: debulk.Inspector, bump: Floats, rng: np.random.Generator
) -> NDArray[np.float32]:
    """Move each point of the reference along its ray to the ply: one thickness plus the bell above the mold."""
    pose = layup.mold_from_scanner
    points = layup.reference.reshape(-1, 3).astype(np.float64) @ pose[:3, :3].T + pose[:3, 3]
    seen = np.isfinite(points).all(axis=1)
    at = points[seen]
    rays = at - pose[:3, 3]
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    inside = pocket.inside(layup.ply_outline, at[:, :2])
    x0, y0, wide, long, high = bump
    for _ in range(6):
        x, y = at[inside, 0], at[inside, 1]
        u, v = np.clip((x - x0) / wide, -0.5, 0.5), np.clip((y - y0) / long, -0.5, 0.5)
        above = layup.truth.thickness_mm + high * (np.cos(np.pi * u) * np.cos(np.pi * v)) ** 2
        off = inspector.reference.height(np.stack([x, y], axis=1)) + above - at[inside, 2]
        at[inside] += rays[inside] * (off / rays[inside, 2])[:, None]
    at += rays * rng.normal(0.0, NOISE_MM, len(at))[:, None]
    points[seen] = at
    return ((points - pose[:3, 3]) @ pose[:3, :3]).astype(np.float32).reshape(layup.reference.shape)


if __name__ == "__main__":
    cv2.setNumThreads(2)
    main()
