"""What changes when the physics does: python bench/referee/sensitivities.py. Rows with a variant in both tables.

E halved and doubled, and friction 0.2 and 0.6, by the faster engine that has them: own nets, in which friction acts at
the ply's edge only; in MuJoCo, on fewer pockets, friction, a following load, a rim that a margin of 40 mm holds by
friction alone, and half the speed of the ramp. Half of the pockets have an excess near the limit's.
"""

from __future__ import annotations

import mujoco_runs
import own
from case import Case
from pockets import LIMIT_EXCESS_MM, Pocket, all_pockets, excess

OWN, MUJOCO = 20, 10  # pockets
CLOSE = 0.2  # near the limit, in units of its excess
OF_MUJOCO = ("half speed", "margin of 40 mm", "mu 0.2", "mu 0.6", "following load", "E x 0.5", "E x 2")


def small(pockets: list[Pocket], count: int) -> list[Pocket]:
    """The smallest: half of them close to the limit, half of them not, in turn."""
    ordered = sorted(pockets, key=lambda p: p.foot_area_mm2)
    close = [p for p in ordered if abs(excess(p) / LIMIT_EXCESS_MM - 1) <= CLOSE]
    far = [p for p in ordered if p not in close]
    half = count // 2
    return [p for pair in zip(close[:half], far[:half], strict=False) for p in pair]


def main() -> None:
    """Make the rows that are missing."""
    every = all_pockets()
    inner, edge = [p for p in every if not p.at_edge], [p for p in every if p.at_edge]
    for chosen, variants in ((small(inner, OWN), ("E x 0.5", "E x 2")), (small(edge, OWN), ("mu 0.2", "mu 0.6"))):
        own.complete(Case(pocket, 1, variant) for variant in variants for pocket in chosen)
    mujoco_runs.complete(Case(pocket, 1, variant) for variant in OF_MUJOCO for pocket in small(inner, MUJOCO))


if __name__ == "__main__":
    main()
