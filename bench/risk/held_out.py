"""Excess and true ridge of pockets of layups that nothing was fitted to: python bench/risk/held_out.py [--layups 60].

Layups are those of `bench/trust/ranges.py`, of other seeds. Each pocket inside the ply adds a row to held_out.csv, from
which risk.py computes how well the probabilities hold.
"""

from __future__ import annotations

import argparse
import csv
from pathlib import Path

import numpy as np

from debulk import Inspector
from lab.varied import varied_layup
from lab.varied.given import given_right
from lab.varied.polygons import inside

FILE = Path(__file__).with_name("held_out.csv")
COLUMNS = (
    "seed", "pocket", "kinds", "true_mm", "verdict", "length_mm", "noise_mm", "uncertainty_mm", "missed_mm", "low_mm",
    "high_mm", "alone_mm",
)  # fmt: skip


def rows_of(seed: int, pixels: tuple[int, int]) -> list[tuple[object, ...]]:
    """Inspect one layup, and return a row for each pocket whose ridge is known on both sides."""
    layup = varied_layup(seed, pixels)
    given = given_right(layup)
    inspector = Inspector(
        None, given.reference, given.ply_outline, given.fibre_angles_deg, given.mold_from_scanner, mask=given.mask
    )
    standing = (*layup.truth.pockets, *layup.truth.decoys)
    rows: list[tuple[object, ...]] = []
    for pocket in inspector.inspect(given.scan).pockets:
        known = pocket.excess
        if known is None or pocket.touches_ply_edge or pocket.foot_outline_mm is None:
            continue
        in_it = [s for s in standing if inside(pocket.foot_outline_mm, *(np.array(v) for v in s.centre_mm))]
        if in_it:
            true = max(in_it, key=lambda s: s.ridge_mm)
            rows.append((
                seed, pocket.id, "+".join(true.kinds), true.ridge_mm, pocket.verdict.value, known.length_mm,
                known.noise_mm, known.uncertainty_mm, known.missed_mm, *known.range_mm, known.alone_mm,
            ))  # fmt: skip
    return rows


def main() -> None:
    """Inspect what is missing; an interrupted run goes on where it stopped."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--layups", type=int, default=60)
    parser.add_argument("--seed", type=int, default=92000, help="of the first layup")
    parser.add_argument("--pixels", default="1280x960")
    options = parser.parse_args()
    width, height = map(int, options.pixels.split("x"))
    if not FILE.exists():
        FILE.write_text(",".join(COLUMNS) + "\n", encoding="utf-8")
    with FILE.open(encoding="utf-8", newline="") as file:
        done = {int(row["seed"]) for row in csv.DictReader(file)}
    for seed in range(options.seed, options.seed + options.layups):
        if seed in done:
            continue
        found = rows_of(seed, (width, height))
        with FILE.open("a", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerows([f"{v:.6g}" if isinstance(v, float) else v for v in row] for row in found)


if __name__ == "__main__":
    main()
