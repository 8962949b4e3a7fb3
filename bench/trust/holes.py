"""Holes over pockets that crease: python bench/trust/holes.py [--holes 420] [--out FILE].

There are six layups of the second family with one creasing pocket each, and holes in the scan, 16 to 90 mm wide, of
random shape and at random places over the pocket and its rim. None may pass.
"""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from debulk import Inspector
from lab.varied import varied_layup
from lab.varied.given import given_right

KINDS = ("lobes", "gaussians", "wrinkle", "crescent", "ring", "superposed")
WIDTHS_MM = (16.0, 90.0)
RIM_MM = (30.0, 40.0)  # width of every fourth hole, which is a drop-out across the rim
Floats = np.ndarray[Any, np.dtype[np.float64]]


def hole(rng: np.random.Generator, xy: Floats, centre: Floats, width_mm: float) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Return which (H, W, 2) places lie in a hole, which is round, long, cornered or lobed, and turned at random."""
    turn, slender = rng.uniform(0, np.pi), rng.choice([1.0, 0.6, 0.35])
    c, s = np.cos(turn), np.sin(turn)
    x, y = xy[..., 0] - centre[0], xy[..., 1] - centre[1]
    u, v = (c * x + s * y) / (width_mm / 2), (c * y - s * x) / (slender * width_mm / 2)
    power = rng.choice([2.0, 2.0, 8.0])
    with np.errstate(invalid="ignore"):
        radius = (np.abs(u) ** power + np.abs(v) ** power) ** (1 / power)
        lobes = 1 + rng.uniform(0, 0.3) * np.cos(rng.integers(2, 6) * np.arctan2(v, u) + rng.uniform(0, 2 * np.pi))
        return radius < lobes


def tried(kind: str, seed: int, count: int, pixels: tuple[int, int]) -> tuple[str, Counter[str], list[str]]:
    """Inspect one layup without a hole, then with each of `count` holes."""
    layup = varied_layup(
        seed, pixels, mold="saddle", pockets=[kind], severity="one", noise=[], holes_mm=[], clamp=False, borders=0
    )
    given = given_right(layup)
    inspector = Inspector(
        None, given.reference, given.ply_outline, given.fibre_angles_deg, given.mold_from_scanner, mask=given.mask
    )
    whole = inspector.inspect(given.scan)
    pocket = max(whole.pockets, key=lambda p: p.verdict.severity)
    true = max(layup.truth.pockets, key=lambda p: p.ridge_mm)
    head = (
        f"{kind} (seed {seed}): {pocket.area_mm2 / 100:.1f} cm², {pocket.peak_mm:.1f} mm high, true ridge "
        f"{true.ridge_mm:.2f} mm; without a hole {whole.verdict.value}"
    )
    xy = given.in_mold(given.scan)[..., :2]
    rng = np.random.default_rng([seed, 1])
    inside = np.array(pocket.outline_mm)
    low, high = inside.min(axis=0), inside.max(axis=0)
    said, passed = Counter[str](), []
    for number in range(count):
        if number % 4 == 0:
            width, centre = rng.uniform(*RIM_MM), inside[rng.integers(len(inside))]
        else:
            width = float(np.exp(rng.uniform(*np.log(WIDTHS_MM))))
            centre = rng.uniform(low - 0.25 * width, high + 0.25 * width)
        scan = given.scan.copy()
        scan[hole(rng, xy, centre, width)] = np.nan
        report = inspector.inspect(scan)
        said[report.verdict.value] += 1
        if report.passed:
            passed.append(f"{kind} {number}: {width:.0f} mm at ({centre[0]:.0f}, {centre[1]:.0f}) mm: {report.reason}")
    return head, said, passed


def main() -> None:
    """Run all, print the verdicts, and write them to a file if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--holes", type=int, default=420)
    parser.add_argument("--pixels", default="640x480")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    width, height = map(int, args.pixels.split("x"))
    total, passed, lines = Counter[str](), list[str](), list[str]()
    for seed, kind in enumerate(KINDS):
        head, said, wrong = tried(kind, seed, -(-args.holes // len(KINDS)), (width, height))
        lines.append(f"{head}; with one: " + ", ".join(f"{n} {what}" for what, n in sorted(said.items())))
        total, passed = total + said, passed + wrong
    text = "\n".join(
        [
            f"{total.total()} holes of {WIDTHS_MM[0]:g} to {WIDTHS_MM[1]:g} mm, every fourth of {RIM_MM[0]:g} to "
            f"{RIM_MM[1]:g} mm across the rim ({args.pixels}): {total['cease']} passed; "
            + ", ".join(f"{n} {what}" for what, n in sorted(total.items())),
            "",
            *lines,
            *(["", "passed:", *passed] if passed else []),
        ]
    )
    print(text)
    if args.out:
        args.out.write_text(text + "\n")


if __name__ == "__main__":
    main()
