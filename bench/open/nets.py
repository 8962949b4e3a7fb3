"""The truth of the open benchmark, by fine nets and MuJoCo: python bench/open/nets.py. Completes pockets.csv.

Each pocket's ply, without noise, is laid as a net and minimised from two perturbed starts. The spacing follows the
thickness, 1.25 to 2 mm, fine enough that the lattice pins no fold (docs/referee.md). Pockets whose folds gather within
15 % of the limit are minimised once more at four fifths of that spacing. MuJoCo simulates the small ones of them whose
ply is 0.3 mm thick. Each of these members says whether the worst fold gathers more excess than a ridge at the limit
holds, and a pocket creases if any says so. Minima that are not certified and runs that are not accepted do not count.
"""

from __future__ import annotations

import csv
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "referee"))

import tables
from folds import worst_fold
from open_scenes import Floats, Scene, draw, excess_mm, limit_excess_mm
from pockets import Pocket

from debulk import sheet, solve
from debulk.recipe import Recipe

STARTS, MORE = (1, 2), (3, 4, 5)  # the second where no minimum of the first is certified
SPACING, FINER = 5.0, 4.0  # spacings in thicknesses of the ply
CLOSE = 0.15  # to the limit, as a share of it
SIMULATED, SIMULATED_MM = 0.3, 1.5  # the thickness that MuJoCo's model has, and its spacing (bench/referee)
SIMULATED_MM2 = 1000.0  # largest foot that it simulates
REACH_MM = 25.0  # of mold round a foot
DEADLINE_S = 20.0
COLUMNS = ["scene", "pocket", "kind", "x_mm", "y_mm", "radius_mm", "high_mm", "excess_mm", "limit_excess_mm", "nodes",
           "certified", "gathered_low_mm", "gathered_high_mm", "finer_mm", "mujoco_mm", "share", "cpu_s"]  # fmt: skip


def foot(scene: Scene, number: int, grid_mm: float = 0.5) -> Floats:
    """Return (K, 2) the convex hull of a pocket's foot, and 1 mm round it."""
    lift = scene.ply.bells[number]
    x, y = np.meshgrid(*2 * (np.arange(-lift.a - 3, lift.a + 3, grid_mm),))
    on = lift.gap(x + lift.x, y + lift.y) > 0.01
    hull = cv2.convexHull(np.column_stack([x[on], y[on]]).astype(np.float32))[:, 0].astype(float)
    return np.asarray(hull * (1 + 1 / np.linalg.norm(hull, axis=1, keepdims=True)) + (lift.x, lift.y))


def pocket(scene: Scene, number: int) -> Pocket:
    """Return one pocket as the referee's nets take it."""
    lift = scene.ply.bells[number]
    outline = foot(scene, number)
    half, middle = np.ceil(lift.a + REACH_MM), np.array([lift.x, lift.y])
    x, y = np.meshgrid(*(np.arange(-half, half + 1) + c for c in middle))
    px, py = outline.T
    within = cv2.pointPolygonTest(outline.astype(np.float32), middle, False) >= 0  # not so in a crescent's circle
    return Pocket(
        name=f"{scene.number}_{number}", family=scene.family,
        ply_mm=replace(scene.ply, bells=(lift,)).lower_height(x, y), mold_mm=scene.ply.mold(x, y),
        origin_mm=middle - half, grid_mm=1.0, centre_mm=middle if within else outline.mean(axis=0),
        angles_deg=np.array([scene.fibre_deg, scene.fibre_deg + 90]), outline_mm=outline, rms_outline_mm=outline,
        ply_outline_mm=np.empty((0, 2)), at_edge=False, mold_tol_mm=0.05,
        foot_area_mm2=0.5 * abs(float(np.sum(px * np.roll(py, -1) - py * np.roll(px, -1)))),
    )  # fmt: skip


def gathered(made: Pocket, thickness_mm: float, spacing: float, starts: tuple[int, ...]) -> tuple[list[float], int]:
    """Return what the worst folds of the certified minima gather, and the number of the net's nodes."""
    laid = made.lay(spacing * thickness_mm)
    ply = sheet.Sheet.of_net(laid, made.reference, Recipe(material={"thickness_mm": thickness_mm}))
    found = [solve.minimise(ply, starts=k + 1, first_start=k, seed=12, deadline_s=DEADLINE_S) for k in starts]
    folds = [worst_fold(f.nodes_mm, laid.neighbours, laid.kinds, made.reference) for f in found if f.certified]
    return [fold.gathered_mm for fold in folds], len(laid.nodes_mm)


def simulated(made: Pocket) -> list[float]:
    """Return what the worst fold of a run of MuJoCo gathers; nothing if the run is not accepted."""
    import mujoco_ply

    laid = made.lay(SIMULATED_MM)
    end = mujoco_ply.simulate(made, laid, 1, mujoco_ply.Physics())
    fold = worst_fold(end.nodes_mm, laid.neighbours, laid.kinds, made.reference)
    return [fold.gathered_mm] if end.accepted else []


def rows_of(scene: Scene) -> Iterator[dict[str, object]]:
    """Yield a row for each pocket of a scene."""
    thickness = scene.ply.thickness_mm
    limit = limit_excess_mm(thickness)
    for number, lift in enumerate(scene.ply.bells):
        began, made = time.process_time(), pocket(scene, number)
        members, nodes = gathered(made, thickness, SPACING, STARTS)
        if not members:
            members, _ = gathered(made, thickness, SPACING, MORE)
        finer: list[float] = []
        run: list[float] = []
        if members and abs(max(members) / limit - 1) < CLOSE:
            finer, _ = gathered(made, thickness, FINER, STARTS[:1])
            run = simulated(made) if thickness == SIMULATED and made.foot_area_mm2 < SIMULATED_MM2 else []
        every = np.array([*members, *finer, *run])
        yield {
            "scene": scene.number, "pocket": number, "kind": lift.kind, "x_mm": lift.x, "y_mm": lift.y,
            "radius_mm": lift.a, "high_mm": lift.high, "excess_mm": excess_mm(scene.ply, lift, scene.fibre_deg),
            "limit_excess_mm": limit, "nodes": nodes, "certified": len(members),
            "gathered_low_mm": min(members, default=np.nan), "gathered_high_mm": max(members, default=np.nan),
            "finer_mm": finer[0] if finer else "", "mujoco_mm": run[0] if run else "",
            "share": float((every > limit).mean()), "cpu_s": time.process_time() - began,
        }  # fmt: skip


def summary(rows: list[dict[str, str]]) -> str:
    """Return what the members say of each other and of the excess."""
    limit, excess, high, finer, run, share = (
        np.array([float(row[name] or "nan") for row in rows])
        for name in ("limit_excess_mm", "excess_mm", "gathered_high_mm", "finer_mm", "mujoco_mm", "share")
    )
    creases, known, simulated = share > 0, np.isfinite(finer), np.isfinite(run)
    return (
        f"{len(rows)} pockets, {np.sum((excess > 0.75 * limit) & (excess < 1.3 * limit))} with 0.75 to 1.3 of the "
        f"limit's excess; {creases.sum()} crease, {np.sum(creases & (share < 1))} of them not in every member\n"
        f"excess above the limit and ceases: {np.sum(~creases & (excess > limit))}; "
        f"not above it and creases: {np.sum(creases & (excess <= limit))}\n"
        f"finer nets: {known.sum()}, on the other side than the worse of the starts: "
        f"{np.sum(known & ((finer > limit) != (high > limit)))}; MuJoCo: {simulated.sum()}, on the other side: "
        f"{np.sum(simulated & ((run > limit) != (high > limit)))}\n"
        f"{sum(float(row['cpu_s']) for row in rows):.0f} s of processor time"
    )


def main() -> None:
    """Compute the rows that are missing, and print what all say."""
    tables.HERE = Path(__file__).parent
    kept = tables.Table("pockets.csv", COLUMNS, ["scene", "pocket"])
    with (tables.HERE / "scenes.csv").open(newline="") as file:
        pockets = {int(row["scene"]): int(row["pockets"]) for row in csv.DictReader(file)}
    for number, count in pockets.items():
        if not all(kept.has(number, k) for k in range(count)):
            for row in rows_of(draw(number)):
                if not kept.has(number, row["pocket"]):
                    kept.add(row)
    print(summary(kept.rows()))


if __name__ == "__main__":
    main()
