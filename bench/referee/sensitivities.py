"""The effect of changes of the physics: python bench/referee/sensitivities.py. Adds rows with a variant to both tables.

Our own nets, the faster engine, run with E halved and doubled and with friction 0.2 and 0.6; in them friction acts at
the ply's edge only. MuJoCo runs, on fewer pockets, the variants listed in OF_MUJOCO: E and friction changed likewise, a
following load, a rim that a margin of 40 mm holds by friction alone, and half the speed of the ramp. Half of the
pockets have an excess near the limit's.
"""

from __future__ import annotations

import mujoco_runs
import own
from case import Case
from pockets import LIMIT_EXCESS_MM, Pocket, all_pockets, excess

OWN, MUJOCO = 20, 10  # pockets
CLOSE = 0.2  # distance that counts as near the limit, in units of its excess
OF_MUJOCO = ("half speed", "margin of 40 mm", "mu 0.2", "mu 0.6", "following load", "E x 0.5", "E x 2")


def small(pockets: list[Pocket], count: int) -> list[Pocket]:
    """Return the smallest pockets, in turn one that is close to the limit and one that is not."""
    ordered = sorted(pockets, key=lambda p: p.foot_area_mm2)
    close = [p for p in ordered if abs(excess(p) / LIMIT_EXCESS_MM - 1) <= CLOSE]
    far = [p for p in ordered if p not in close]
    half = count // 2
    return [p for pair in zip(close[:half], far[:half], strict=False) for p in pair]


def main() -> None:
    """Compute the missing rows."""
    every = all_pockets()
    inner, edge = [p for p in every if not p.at_edge], [p for p in every if p.at_edge]
    for chosen, variants in ((small(inner, OWN), ("E x 0.5", "E x 2")), (small(edge, OWN), ("mu 0.2", "mu 0.6"))):
        own.complete(Case(pocket, 1, variant) for variant in variants for pocket in chosen)
    mujoco_runs.complete(Case(pocket, 1, variant) for variant in OF_MUJOCO for pocket in small(inner, MUJOCO))


if __name__ == "__main__":
    main()
