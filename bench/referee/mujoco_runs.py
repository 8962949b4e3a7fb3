"""MuJoCo's ensembles: python bench/referee/mujoco_runs.py [--members 5] [--most 30] [--names A B ...].

Each pocket has five noisy members; small pockets on both sides of the limit come first. Rows go to mujoco.csv.
sensitivities.py runs the variants.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, fields, replace

import case
import excess
import mujoco
import mujoco_ply
from case import MATERIAL, Case
from folds import Fold, worst_fold
from mujoco_ply import Physics
from tables import Table, build

SPACING_MM = 1.5
VARIANTS: dict[str, dict[str, float | bool]] = {
    **MATERIAL,
    "half speed": {"ramp_steps": 2 * Physics.ramp_steps},
    "following load": {"following": True},
    "margin of 40 mm": {"margin_mm": 40.0},
}
COLUMNS = [
    "pocket", "member", "variant", "spacing_mm", "nodes", "accepted", "strain", "most_strain", "speed_mm_per_step",
    "steps", "cpu_s", *(f.name for f in fields(Fold)), "fibre_excess_mm", *(f.name for f in fields(Physics)), "build",
]  # fmt: skip


def table() -> Table:
    """Return the table of all runs so far."""
    return Table("mujoco.csv", COLUMNS, ["pocket", "member", "variant"])


def run(one: Case) -> dict[str, object]:
    """Run once and return a row."""
    pocket = one.pocket
    physics = replace(Physics(), **VARIANTS[one.variant])  # type: ignore[arg-type]
    laid = pocket.lay(SPACING_MM)
    end = mujoco_ply.simulate(pocket, laid, one.member, physics)
    fold = worst_fold(end.nodes_mm, laid.neighbours, laid.kinds, pocket.reference)
    return {
        "pocket": pocket.name,
        "member": one.member,
        "variant": one.variant,
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


def complete(cases: Iterable[Case]) -> None:
    """Compute the missing rows."""
    case.complete(table(), cases, run, "accepted")


def main() -> None:
    """Run from the command line."""
    complete(case.asked(__doc__, members=5, most=30))


if __name__ == "__main__":
    main()
