"""MuJoCo's ensembles: python bench/referee/mujoco_runs.py [--members 5] [--names A B ...].

Five noisy members a pocket, small ones all round the limit first; rows go to mujoco.csv. sensitivities.py runs the
variants.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict, fields, replace

import excess
import mujoco
import mujoco_ply
from folds import Fold, worst_fold
from mujoco_ply import Physics
from pockets import Pocket, all_pockets, spread
from tables import Table, build

SPACING_MM = 1.5
VARIANTS: dict[str, dict[str, float | bool]] = {
    "half speed": {"ramp_steps": 2 * Physics.ramp_steps},
    "E x 0.5": {"young_mpa": 180.0},
    "E x 2": {"young_mpa": 720.0},
    "mu 0.2": {"friction": 0.2},
    "mu 0.6": {"friction": 0.6},
    "following load": {"following": True},
    "margin of 40 mm": {"margin_mm": 40.0},
}
COLUMNS = [
    "pocket", "member", "variant", "spacing_mm", "nodes", "accepted", "strain", "most_strain", "speed_mm_per_step",
    "steps", "cpu_s", *(f.name for f in fields(Fold)), "fibre_excess_mm", *(f.name for f in fields(Physics)), "build",
]  # fmt: skip


def table() -> Table:
    """All runs so far."""
    return Table("mujoco.csv", COLUMNS, ["pocket", "member", "variant"])


def run(pocket: Pocket, member: int, variant: str = "") -> dict[str, object]:
    """One run: a row."""
    physics = replace(Physics(), **VARIANTS.get(variant, {}))  # type: ignore[arg-type]
    laid = pocket.lay(SPACING_MM)
    end = mujoco_ply.simulate(pocket, laid, member, physics)
    fold = worst_fold(end.nodes_mm, laid.neighbours, laid.kinds, pocket.reference)
    return {
        "pocket": pocket.name,
        "member": member,
        "variant": variant,
        "spacing_mm": laid.spacing_mm,
        "nodes": len(laid.nodes_mm),
        "accepted": int(end.accepted),
        "strain": end.strain,
        "most_strain": end.most_strain,
        "speed_mm_per_step": end.speed_mm,
        "steps": end.steps,
        "cpu_s": end.cpu_s,
        **asdict(fold),
        "fibre_excess_mm": excess.largest(laid, pocket.reference),
        **asdict(physics),
        "build": f"mujoco {mujoco.__version__}, net by {build()}",
    }


def keep(kept: Table, pocket: Pocket, member: int, variant: str = "") -> None:
    """Make a row unless it is there."""
    if kept.has(pocket.name, member, variant):
        return
    row = run(pocket, member, variant)
    kept.add(row)
    print(
        f"{pocket.name} member {member} {variant}: {'accepted' if row['accepted'] else 'REFUSED'}, height "
        f"{row['height_mm']:.3f} mm, gathered {row['gathered_mm']:.3f} of {row['fibre_excess_mm']:.3f} mm, strain "
        f"{row['strain']:.1e}, {row['steps']} steps, {row['cpu_s']:.0f} s",
        flush=True,
    )


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--members", type=int, default=5)
    parser.add_argument("--most", type=int, default=30, help="pockets")
    parser.add_argument("--names", nargs="*", help="of pockets")
    options = parser.parse_args()
    kept = table()
    chosen = [p for p in spread(all_pockets()) if not options.names or p.name in options.names][: options.most]
    for member in range(1, options.members + 1):
        for pocket in chosen:
            keep(kept, pocket, member)


if __name__ == "__main__":
    main()
