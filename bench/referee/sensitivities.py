"""What changes when the physics does: python bench/referee/sensitivities.py. Rows with a variant in both tables.

E halved and doubled, friction 0.2 and 0.6, a following load, and a rim that a margin of 40 mm holds by friction alone,
each on a few small pockets, in MuJoCo; E and friction in own nets too, where friction acts at the ply's edge only.
"""

from __future__ import annotations

import mujoco_runs
import own
from pockets import all_pockets

POCKETS = 2
OWN_VARIANTS = {"E x 0.5": {"young": 0.5}, "E x 2": {"young": 2.0}}
OWN_EDGE_VARIANTS = {"mu 0.2": {"friction": 0.2}, "mu 0.6": {"friction": 0.6}}


def main() -> None:
    """Make the rows that are missing."""
    small = sorted(all_pockets(), key=lambda p: p.foot_area_mm2)
    inner = [p for p in small if not p.at_edge and p.name.startswith("S")][:POCKETS]
    edge = [p for p in small if p.at_edge][:POCKETS]
    kept = own.table()
    for chosen, variants in ((inner, OWN_VARIANTS), (edge, OWN_EDGE_VARIANTS)):
        for variant, change in variants.items():
            for pocket in chosen:
                if not kept.has(pocket.name, 1, variant):
                    kept.add(own.run(pocket, 1, 600.0, variant, **change))
    runs = mujoco_runs.table()
    for variant in mujoco_runs.VARIANTS:
        for pocket in inner:
            mujoco_runs.keep(runs, pocket, 1, variant)


if __name__ == "__main__":
    main()
