"""Bent and branched bumps below or above the tolerances: python bench/trust/branched.py [--scenes 60] [--out FILE].

The bumps are S, Y, T, X and C shapes, combs and needles, and low bumps with a narrow one on them, on plates and domes,
seen by a pinhole camera. Half of them are scaled to crease, half not. The truth is the straight fibre with the largest
excess that is held at both ends.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import debulk

Floats = NDArray[np.float64]
Surface = Callable[[Floats, Floats], Floats]

THICK_MM, LIMIT_MM = 0.3, 0.6
SIZE_MM = (380.0, 300.0)
PITCH_MM, PIXELS = 0.85, (640, 480)
ANGLES_DEG = (0.0, 30.0, 45.0, 70.0)
HELD_MM = 40.0
LAID_MM = 0.03
STEP_MM = 0.4


def ridge_mm(excess_mm: float) -> float:
    """Return the ridge height of an excess by the closed form, docs/model.md (5.1)."""
    return 0.5 * excess_mm + 0.43 * THICK_MM


def tube(lines: Sequence[Floats], half_mm: float) -> Surface:
    """Return a squared cosine of the distance from polylines."""
    low, high = (end(np.concatenate(lines), axis=0) for end in (np.min, np.max))

    def height(x: Floats, y: Floats) -> Floats:
        near = (np.abs(x - 0.5 * (low[0] + high[0])) < 0.5 * (high[0] - low[0]) + half_mm) & (
            np.abs(y - 0.5 * (low[1] + high[1])) < 0.5 * (high[1] - low[1]) + half_mm
        )
        at = np.stack([x[near], y[near]], axis=-1)
        away = np.full(len(at), np.inf)
        for line in lines:
            for a, b in pairwise(line):
                share = np.clip((at - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
                away = np.minimum(away, np.linalg.norm(at - a - share[:, None] * (b - a), axis=1))
        out = np.zeros(x.shape)
        out[near] = np.cos(0.5 * np.pi * np.clip(away / half_mm, 0, 1)) ** 2
        return out

    return height


def dome(middle: Floats, half_mm: float) -> Surface:
    """Return (1 - r²)² on a disc."""
    return lambda x, y: (1 - np.clip(np.hypot(x - middle[0], y - middle[1]) / half_mm, 0, 1) ** 2) ** 2


def lines_of(kind: str, long_mm: float) -> list[Floats]:
    """Return the polylines of a kind, round the origin."""
    t = np.linspace(0, 1, 25)
    if kind == "S":
        return [long_mm * np.stack([2 * t - 1, 0.35 * np.sin(2 * np.pi * t)], axis=1)]
    if kind == "C":
        return [0.7 * long_mm * np.stack([np.cos(5 * t), np.sin(5 * t)], axis=1)]
    if kind == "Y":
        return [0.7 * long_mm * np.array([(0, 0), (np.cos(a), np.sin(a))]) for a in (0.0, 2.1, 4.2)]
    if kind == "needle":
        return [long_mm * np.array([(-1.0, 0), (1, 0)])]
    bar = long_mm * np.array([(-0.7, 0), (0.7, 0)])
    if kind == "T":
        return [bar, long_mm * np.array([(0.0, 0), (0, 1)])]
    if kind == "X":
        return [bar, bar[:, ::-1]]
    return [bar, *(long_mm * np.array([(k, 0), (k, 0.8)]) for k in (-0.7, 0.0, 0.7))]  # a comb


KINDS = ("S", "C", "Y", "T", "X", "comb", "needle", "low rider")


def worst_mm(mold: Surface, gap: Surface, angle_deg: float) -> float:
    """Return the largest excess of a straight fibre, held at both ends, over one piece of ply off the mold."""
    reach, most = 0.5 * float(np.hypot(*SIZE_MM)), 0.0
    s, across = np.arange(-reach, reach, STEP_MM), np.arange(-reach, reach, 1.5)[:, None]
    margin = round(HELD_MM / STEP_MM)
    for a in np.radians((angle_deg, angle_deg + 90)):
        x, y = s * np.cos(a) - across * np.sin(a), s * np.sin(a) + across * np.cos(a)
        off, below = gap(x, y), mold(x, y)
        on = (np.abs(x) < 0.5 * SIZE_MM[0]) & (np.abs(y) < 0.5 * SIZE_MM[1])
        longer = np.hypot(np.diff(below + off, axis=1), STEP_MM) - np.hypot(np.diff(below, axis=1), STEP_MM)
        for k in np.flatnonzero((on & (off > LAID_MM)).any(axis=1)):
            change = np.flatnonzero(np.diff(np.concatenate([[0], (off[k] > LAID_MM).view(np.int8), [0]])))
            for first, last in change.reshape(-1, 2):
                if on[k, max(first - margin, 0) : last + margin].all() and first >= margin:
                    most = max(most, float(longer[k, first - 1 : last].sum()))
    return most


def scan_of(surface: Surface, away_mm: float, noise_mm: float, rng: np.random.Generator) -> NDArray[np.float32]:
    """Return the image of a camera that looks straight down, with its frame's z along the view."""
    (nx, ny), f = PIXELS, away_mm / PITCH_MM
    u, v = np.meshgrid((np.arange(nx) - 0.5 * (nx - 1)) / f, (np.arange(ny) - 0.5 * (ny - 1)) / f)
    far = np.full(u.shape, away_mm)
    for _ in range(10):
        far += 0.9 * (away_mm - far - surface(u * far, -v * far))
    far += noise_mm * rng.standard_normal(far.shape)
    return (far[..., None] * np.stack([u, v, np.ones_like(u)], axis=-1)).astype(np.float32)


def drawn(rng: np.random.Generator, kind: str, creases: bool, mold: Surface, angle_deg: float) -> Surface:
    """Draw a shape at random and scale it so that it makes a given ridge."""
    middle, turn = rng.uniform(-35, 35, 2), rng.uniform(0, 6.3)
    wanted = rng.uniform(0.66, 0.9) if creases else rng.uniform(0.3, 0.5)
    if kind == "low rider":
        wide_mm, high_mm = rng.uniform(40, 90), rng.uniform(0.8, 2.6)
        low, narrow = dome(middle, wide_mm), dome(middle + rng.uniform(-0.4, 0.4, 2) * wide_mm, rng.uniform(4, 9))
    else:
        turned = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        low, high_mm = (lambda x, _: 0 * x), 0.0
        lines = [line @ turned + middle for line in lines_of(kind, rng.uniform(50, 100))]
        narrow = tube(lines, rng.uniform(12, 28))
    least, most = 0.0, 8.0
    for _ in range(9):
        times = 0.5 * (least + most)
        fits = ridge_mm(worst_mm(mold, _over(low, high_mm, narrow, times), angle_deg)) < wanted
        least, most = (times, most) if fits else (least, times)
    return _over(low, high_mm, narrow, least)


def _over(low: Surface, high_mm: float, narrow: Surface, times: float) -> Surface:
    return lambda x, y: high_mm * low(x, y) + times * narrow(x, y)


def main() -> None:
    """Inspect all scenes, print the text, and write it to a file if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    half = 0.5 * np.array(SIZE_MM)
    outline = half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    said, wrong = {True: Counter[str](), False: Counter[str]()}, list[str]()
    for number in range(args.scenes):
        rng = np.random.default_rng([args.seed, number])
        kind, creases = KINDS[number % len(KINDS)], bool(rng.random() < 0.5)
        bow, angle_deg = rng.choice([0.0, *rng.uniform(-1e-3, 1e-3, 2)]), float(rng.choice(ANGLES_DEG))

        def mold(x: Floats, y: Floats, bow: float = bow) -> Floats:
            return 0.5 * bow * (x * x + y * y)

        gap = drawn(rng, kind, creases, mold, angle_deg)

        def top(x: Floats, y: Floats, mold: Surface = mold, gap: Surface = gap) -> Floats:
            on = (np.abs(x) < half[0]) & (np.abs(y) < half[1])
            return mold(x, y) + np.where(on, THICK_MM + gap(x, y), 0.0)

        away_mm, noise_mm = rng.uniform(1000, 2400), rng.uniform(0.01, 0.04)
        scan, reference = (scan_of(one, away_mm, noise_mm, rng) for one in (top, mold))
        pose = np.diag([1.0, -1.0, -1.0, 1.0])
        pose[2, 3] = away_mm
        report = debulk.inspect(scan, reference, None, outline, (angle_deg, angle_deg + 90), pose)
        said[creases][report.verdict.value] += 1
        true_mm = ridge_mm(worst_mm(mold, gap, angle_deg))
        if report.passed is creases:
            what = f"{number:4} {kind}, true ridge {true_mm:.2f} mm, said {report.verdict.value}: {report.reason}"
            wrong.append(what[:200])
    text = "\n".join(
        [
            f"{args.scenes} bent, branched and ridden bumps (seed {args.seed}, {PIXELS[0]}x{PIXELS[1]}, points "
            f"{PITCH_MM:g} mm apart, debulk {debulk.__version__}), scaled to true ridges of 0.66 to 0.9 mm, or of "
            f"0.3 to 0.5 mm; the limit is {LIMIT_MM:g} mm",
            "",
            *(
                f"{name:9}{sum(said[which].values()):4}: "
                + ", ".join(f"{n} {v}" for v, n in sorted(said[which].items()))
                for name, which in (("creasing", True), ("good", False))
            ),
            *(["", "creasing and passed, or good and not passed", *wrong] if wrong else []),
        ]
    )
    print(text)
    if args.out:
        args.out.write_text(text + "\n")


if __name__ == "__main__":
    main()
