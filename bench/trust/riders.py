"""Narrow bumps that ride on a wide pocket: python bench/trust/riders.py [--bells 60] [--seed 0] [--out FILE].

Each scan has one bell 6 to 12 mm wide and 1.5 to 3 mm high at a random place on a pocket that would cease without it.
Each bell must be found, and no layup may pass. In the same number of scans without a bell, but with flying pixels,
nothing may be found.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import debulk
from debulk import Inspector, Recipe, Verdict, _core, pocket, scenes
from debulk.inspection.rawscan.lost_places import lost
from debulk.inspection.rawscan.narrow import Narrow

Floats = NDArray[np.float64]
Cloud = NDArray[np.float32]
Shape = Callable[[Floats, Floats], Floats]  # height above the laid ply from x and y, mold frame, mm

THICKNESS_MM = 0.3
POCKET_MM = (260.0, 6.5)  # width and height
BELL_WIDE_MM, BELL_HIGH_MM = (6.0, 12.0), (1.5, 3.0)
ON_MM = 1.0  # a place where the wide pocket is at least this high is on the pocket
NOISE_MM = 0.02
FLYING_SHARE, FLYING_MM = 2e-3, (0.5, 5.0)


def bell(x0: float, y0: float, wide_mm: float, high_mm: float) -> Shape:
    """Return a product of squared cosines along x and y."""

    def height(x: Floats, y: Floats) -> Floats:
        u, v = (np.clip((w - w0) / wide_mm, -0.5, 0.5) for w, w0 in ((x, x0), (y, y0)))
        return high_mm * (np.cos(np.pi * u) * np.cos(np.pi * v)) ** 2

    return height


@dataclass(frozen=True)
class Bell:
    """A bell, given by its place and size."""

    x: float
    y: float
    wide_mm: float
    high_mm: float

    @property
    def shape(self) -> Shape:
        """Return the bell's height over the pocket."""
        return bell(self.x, self.y, self.wide_mm, self.high_mm)


class Ply:
    """A ply with a wide pocket on a virtual layup's mold, seen by the layup's camera."""

    def __init__(self, pixels: tuple[int, int]) -> None:
        self.layup = scenes.layup(3, pixels)
        self.wide = bell(0.0, 0.0, *POCKET_MM)
        self._pose = self.layup.mold_from_scanner
        cloud = self.layup.reference.astype(np.float64) @ self._pose[:3, :3].T + self._pose[:3, 3]
        self._seen = np.isfinite(cloud).all(axis=-1)
        self._at = cloud[self._seen]
        self._rays = self._at - self._pose[:3, 3]
        self._rays /= np.linalg.norm(self._rays, axis=1)[:, None]
        self._raise(np.flatnonzero(pocket.inside(self.layup.ply_outline, self._at[:, :2])), self._at, self.wide)

    def _raise(self, which: NDArray[np.int64], at: Floats, gap: Shape) -> None:
        """Move points along their rays to the surface of the ply."""
        for _ in range(12):
            x, y = at[which, 0], at[which, 1]
            off = self.layup.truth.mold_height(at[which, :2]) + THICKNESS_MM + gap(x, y) - at[which, 2]
            at[which] += self._rays[which] * (off / self._rays[which, 2])[:, None]

    def scan(self, rng: np.random.Generator, rider: Bell | None = None) -> Cloud:
        """Scan the ply, with or without a bell on the pocket."""
        at = self._at.copy()
        if rider is not None:
            near = np.abs(at[:, :2] - (rider.x, rider.y)).max(axis=1) < rider.wide_mm + rider.high_mm
            self._raise(np.flatnonzero(near), at, lambda x, y: self.wide(x, y) + rider.shape(x, y))
        at += self._rays * rng.normal(0.0, NOISE_MM, len(at))[:, None]
        cloud = np.full((*self._seen.shape, 3), np.nan, dtype=np.float32)
        cloud[self._seen] = (at - self._pose[:3, 3]) @ self._pose[:3, :3]
        return cloud

    def true_ridge_mm(self, rider: Bell) -> float:
        """Return the ridge by the straight fibre with most excess near the bell's top, docs/model.md, eq. (5.1)."""
        s = np.arange(-0.5 * POCKET_MM[0], 0.5 * POCKET_MM[0], 0.05)
        most = 0.0
        for across in np.arange(-2.0, 2.5, 0.5):
            for x, y in ((s, np.full_like(s, rider.y + across)), (np.full_like(s, rider.x + across), s)):
                below = self.layup.truth.mold_height(np.stack([x, y], axis=-1))
                gap = self.wide(x, y) + rider.shape(x, y)
                longer = np.hypot(np.diff(below + gap), np.diff(s)) - np.hypot(np.diff(below), np.diff(s))
                most = max(most, float(longer.sum()))
        return 0.5 * most + 0.43 * THICKNESS_MM


def riders_in(scan: Cloud, inspector: Inspector) -> list[Narrow]:
    """Return the narrow places of a scan that its height map has lost, and that could crease."""
    found = inspector._with_runs(inspector.find(scan), inspector.ply, _core.Stop(), inspector.grid_spacing_mm)
    image = inspector._image(scan, inspector._placing.look(scan, _core.Stop()))
    return [one.place for one in lost(inspector._narrow.find(image), found, inspector.ply)]


def drawn(rng: np.random.Generator, wide: Shape, wide_mm: tuple[float, float]) -> Bell:
    """Draw at random a bell that lies on the pocket."""
    while True:
        x, y = rng.uniform(-0.5 * POCKET_MM[0], 0.5 * POCKET_MM[0], 2)
        if wide(x, y) > ON_MM:
            return Bell(float(x), float(y), rng.uniform(*wide_mm), rng.uniform(*BELL_HIGH_MM))


def main() -> None:
    """Scan and inspect all, print the text, and write it to a file if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--bells", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--wide", nargs=2, type=float, default=BELL_WIDE_MM, metavar=("LEAST", "MOST"), help="mm")
    parser.add_argument("--pixels", default="1280x960")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    width, height = map(int, args.pixels.split("x"))
    ply = Ply((width, height))
    inspector = Inspector(
        None, ply.layup.reference, ply.layup.ply_outline, mold_from_scanner=ply.layup.mold_from_scanner
    )
    limit = Recipe().verdict.max_ridge_mm
    rows, said = list[str](), Counter[str]()
    found = kept = false_cease = flown = 0
    for number in range(args.bells):
        rng = np.random.default_rng([args.seed, number])
        one = drawn(rng, ply.wide, tuple(args.wide))
        scan = ply.scan(rng, one)
        report = inspector.inspect(scan)
        near = [
            r
            for r in riders_in(scan, inspector)
            if np.hypot(r.top_mm[0] - one.x, r.top_mm[1] - one.y) < 0.5 * one.wide_mm
        ]
        found += bool(near)
        kept += not report.passed
        true = ply.true_ridge_mm(one)
        false_cease += report.verdict is Verdict.CEASE and true > limit
        said[report.verdict.value] += 1
        seen = f"{2 * near[0].width_mm:5.1f} wide {near[0].height_mm:4.1f} high" if near else "-"
        rows.append(
            f"{number:4}{one.x:7.0f}{one.y:7.0f}{one.wide_mm:7.1f}{one.high_mm:6.1f}{true:9.2f}   {seen:22}"
            f"{report.verdict.value}"
        )
        scan = ply.scan(rng)
        flying = rng.random(scan.shape[:2]) < FLYING_SHARE
        scan[flying, 2] -= rng.uniform(*FLYING_MM, np.count_nonzero(flying)).astype(np.float32)
        flown += len(riders_in(scan, inspector))
    text = "\n".join(
        [
            f"{args.bells} bells {args.wide[0]:g} to {args.wide[1]:g} mm wide and {BELL_HIGH_MM[0]:g} to "
            f"{BELL_HIGH_MM[1]:g} mm high on a pocket {POCKET_MM[0]:g} mm wide and {POCKET_MM[1]:g} mm high, one a "
            f"scan (seed {args.seed}, {args.pixels}, points {inspector.grid_spacing_mm:.2f} mm apart, debulk "
            f"{debulk.__version__})",
            "",
            f"found                                          {found:4} of {args.bells}",
            f"layup kept from passing                        {kept:4} of {args.bells}: "
            + ", ".join(f"{n} {what}" for what, n in sorted(said.items())),
            f"CEASE though the true ridge exceeds {limit:g} mm     {false_cease:4}",
            f"found without a bell, with flying pixels       {flown:4} in {args.bells} scans",
            "",
            "  no   x mm   y mm   wide  high  true mm   found, mm             verdict",
            *rows,
        ]
    )
    print(text)
    if args.out:
        args.out.write_text(text + "\n")


if __name__ == "__main__":
    main()
