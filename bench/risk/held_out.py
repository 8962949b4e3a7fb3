"""Excess of pockets as read and as it is: python bench/risk/held_out.py [--family second] [--layups 60] [--seed N].

Families: `second`, the layups of `bench/trust/ranges.py` of other seeds; `open`, the scenes of the open benchmark by
number, in three families of shapes. Each pocket inside the ply adds a row to held_out.csv, from which risk.py computes
how well the probabilities hold. `held_mm` is the true excess of the fibres over its foot that are held for certain, and
`any_mm` that of all: where they differ, the question has no one answer, and risk.py leaves the pocket out.
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from debulk import Inspector, Recipe, inspect
from debulk.results.report import PocketReport
from debulk.risk.place import FOOT
from lab.varied import VariedLayup, varied_layup
from lab.varied.fibres import excess
from lab.varied.given import given_right
from lab.varied.polygons import inside
from lab.varied.regions import label_regions

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "open"))

FILE = HERE / "held_out.csv"
LAID_MM = 3e-3  # a ply that is lower lies on the mold
PIXELS = (1280, 960)
COLUMNS = (
    "family", "seed", "pocket", "kinds", "thickness_mm", "held_mm", "any_mm", "verdict", "length_mm", "noise_mm",
    "missed_mm", "low_mm", "high_mm", "alone_mm",
)  # fmt: skip
Row = tuple[object, ...]


def row_of(family: str, seed: int, number: int, kinds: str, thickness_mm: float, true: Row, read: PocketReport) -> Row:
    """Return a row; `true` has the excess of the fibres that are held, and of all."""
    known = read.excess
    assert known is not None
    return (
        family, seed, number, kinds, thickness_mm, *true, read.verdict.value, known.length_mm, known.noise_mm,
        known.missed_mm, *known.range_mm, known.alone_mm,
    )  # fmt: skip


def over_foot(layup: VariedLayup, centre_mm: tuple[float, float], angles_deg: tuple[float, float]) -> Row:
    """Return the largest excess of the fibres over the foot that contains a place: of those held, and of all."""
    ply, thickness = layup.truth.ply, layup.truth.thickness_mm

    def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return thickness + (ply.gap_in_image(x, y) if np.ndim(x) == 2 else ply.gap(x, y))

    feet = label_regions(height, ply.outline, thickness + LAID_MM)
    label = int(feet.at(*(np.array(v) for v in centre_mm)))
    if label == 0:
        return (0.0, 0.0)
    mold, box = ply.mold.smooth_height, feet.box(label)
    found = excess(height, mold, ply.outline, thickness, angles_deg, feet, label, box)
    return (found.held_mm, found.any_mm)


def second(seed: int) -> Iterator[Row]:
    """Inspect one layup of the second family."""
    layup = varied_layup(seed, PIXELS)
    given = given_right(layup)
    inspector = Inspector(
        None, given.reference, given.ply_outline, given.fibre_angles_deg, given.mold_from_scanner, mask=given.mask
    )
    standing = (*layup.truth.pockets, *layup.truth.decoys)
    for pocket in inspector.inspect(given.scan).pockets:
        if pocket.excess is None or pocket.touches_ply_edge or pocket.foot_outline_mm is None:
            continue
        in_it = [s for s in standing if inside(pocket.foot_outline_mm, *(np.array(v) for v in s.centre_mm))]
        if in_it:
            highest = max(in_it, key=lambda s: s.ridge_mm)
            true = over_foot(layup, highest.centre_mm, given.fibre_angles_deg)
            yield row_of(
                "second", seed, pocket.id, "+".join(highest.kinds), layup.truth.thickness_mm, true, pocket
            )  # fmt: skip


def of_open(number: int) -> Iterator[Row]:
    """Inspect one scene of the open benchmark."""
    from open_scenes import Lift, clouds, draw

    from lab.third.ply import truth

    if not (scene := draw(number)).ply.bells:
        return
    made, thickness = clouds(scene), scene.ply.thickness_mm
    report = inspect(
        made["scan"], made["reference"], Recipe(material={"thickness_mm": thickness}), scene.ply.outline,
        (scene.fibre_deg, scene.fibre_deg + 90), scene.camera.mold_from_scanner,
    )  # fmt: skip
    for k, lift in enumerate(scene.ply.bells):
        assert isinstance(lift, Lift)
        near = [
            p for p in report.pockets
            if p.excess and np.hypot(*(p.outline_mm.mean(axis=0) - (lift.x, lift.y))) <= lift.a
        ]  # fmt: skip
        if near:
            ridges = truth(replace(scene.ply, bells=(lift,)), scene.fibre_deg)
            true = tuple(max(0.0, 2 * (h - FOOT * thickness)) for h in (ridges.held_mm, ridges.any_mm))
            worst = max(near, key=lambda p: p.verdict)
            yield row_of(scene.family, number, k, lift.kind, thickness, true, worst)


FAMILIES: dict[str, tuple[Callable[[int], Iterator[Row]], int]] = {"second": (second, 92000), "open": (of_open, 0)}


def main() -> None:
    """Inspect what is missing; an interrupted run goes on where it stopped."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--family", default="second", choices=list(FAMILIES))
    parser.add_argument("--layups", type=int, default=60)
    parser.add_argument("--seed", type=int, help="of the first layup")
    options = parser.parse_args()
    rows_of, first = FAMILIES[options.family]
    first = first if options.seed is None else options.seed
    if not FILE.exists():
        FILE.write_text(",".join(COLUMNS) + "\n", encoding="utf-8")
    with FILE.open(encoding="utf-8", newline="") as file:
        done = {int(row["seed"]) for row in csv.DictReader(file)}
    for seed in sorted(set(range(first, first + options.layups)) - done):
        found = list(rows_of(seed))
        with FILE.open("a", encoding="utf-8", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            writer.writerows([f"{v:.6g}" if isinstance(v, float) else v for v in row] for row in found)


if __name__ == "__main__":
    main()
