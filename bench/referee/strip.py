"""Compare MuJoCo's ply with a closed form: python bench/referee/strip.py. Writes strip.txt.

The case is one fibre of a strip, pinned at both ends on a flat mold without friction and longer than the mold by an
excess. The exact height of its fold under a dead load, from the elastica, is given in docs. The same code simulates the
pockets.
"""

from __future__ import annotations

import mujoco
import mujoco_ply
import numpy as np
from folds import worst_fold
from pockets import Pocket
from tables import HERE

from debulk import net, verdict

LENGTH_MM = verdict.natural_length(360.0, 0.3, 0.1)
EXACT = {0.5: 0.8622, 1.0: 1.2444}  # height by excess, both over the natural length
SPACINGS_MM = (0.5, 1.0, 1.25, 1.5)
SPAN_MM, BELL_MM = 40.0, 24.0


def strip(
    spacing: float, excess_mm: float, span_mm: float = SPAN_MM, bell_mm: float = BELL_MM
) -> tuple[Pocket, net.Net]:
    """Return the flat mold, and a fibre laid on it over a bell of that excess."""
    count = round((span_mm + excess_mm) / spacing)
    length = count * spacing
    x = np.linspace(0, length - excess_mm, 20001)
    bell = np.cos(np.pi * np.clip((x - x[-1] / 2) / bell_mm, -0.5, 0.5)) ** 2
    low, high = 0.0, bell_mm / 2
    for _ in range(60):
        arc = np.concatenate([[0], np.cumsum(np.hypot(np.diff(x), np.diff((low + high) / 2 * bell)))])
        low, high = ((low + high) / 2, high) if arc[-1] < length else (low, (low + high) / 2)
    at = np.interp(np.linspace(0, arc[-1], count + 1), arc, x)
    nodes = np.column_stack([at, np.zeros(count + 1), low * np.interp(at, x, bell)])
    number = np.arange(count + 1)
    neighbours = np.full((count + 1, 4), -1, dtype=np.int32)
    neighbours[:-1, 0], neighbours[1:, 1] = number[1:], number[:-1]
    kinds = np.where((number == 0) | (number == count), 1, 0).astype(np.int8)
    laid = net.Net(
        nodes_mm=nodes,
        neighbours=neighbours,
        kinds=kinds,
        edges=np.column_stack([number[:-1], number[1:]]).astype(np.int32),
        inside=kinds == 0,
        spacing_mm=spacing,
        area_mm2=length * spacing,
        shear_deg=np.zeros(count + 1),
        open_ends=np.empty(0, dtype=np.int32),
        lattice=np.column_stack([number, 0 * number]).astype(np.int32),
        _core=None,
    )
    flat, empty = np.zeros((4, 4)), np.empty((0, 2))
    mold = Pocket("strip", "strip", flat, flat, np.array([-50.0, -150.0]), 100.0, nodes[0, :2], np.array([0.0, 90.0]),
                  empty, empty, empty, 0.0, False, 0.0)  # fmt: skip
    return mold, laid


def main() -> None:
    """Write the table."""
    lines = [
        f"MUJOCO {mujoco.__version__} AGAINST THE CLOSED FORM OF A STRIP (natural length {LENGTH_MM:.4f} mm)",
        "",
        "  excess mm spacing mm height mm exact mm   error   strain  steps",
    ]
    for ratio, exact in EXACT.items():
        for spacing in SPACINGS_MM:
            mold, laid = strip(spacing, ratio * LENGTH_MM)
            physics = mujoco_ply.Physics(friction=0.0)
            end = mujoco_ply.simulate(mold, laid, 1, physics)
            height = worst_fold(end.nodes_mm, laid.neighbours, laid.kinds, mold.reference).height_mm
            right = exact * LENGTH_MM
            lines.append(
                f"  {ratio * LENGTH_MM:>9.3f} {spacing:>10.2f} {height:>9.3f} {right:>8.3f} "
                f"{height / right - 1:>+7.1%} {end.strain:>8.1e} {end.steps:>6}"
                f"{'' if end.accepted else '  not accepted'}"
            )
    (HERE / "strip.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


if __name__ == "__main__":
    main()
