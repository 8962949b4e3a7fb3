"""From how far does a fold gather its excess? python bench/referee/wide.py. Rows go to wide.csv, a table to wide.txt.

A fibre over a bell of some width, pinned on a flat mold at the bell's feet, is simulated in MuJoCo from noisy starts,
with and without Coulomb friction. The results are the share of its excess that the largest fold gathers, and the number
of folds.
"""

from __future__ import annotations

import mujoco
import mujoco_ply
import numpy as np
from folds import worst_fold
from pockets import LIMIT_EXCESS_MM
from strip import strip
from tables import HERE, Table

WIDTHS_MM = (30.0, 45.0, 60.0, 90.0, 120.0, 160.0, 200.0)
RATIOS = (0.7, 1.3, 3.0)  # excess over the limit's
FRICTIONS = (0.0, 0.4)
MEMBERS = 10
SPACING_MM = 1.0
COLUMNS = [
    "width_mm", "excess_mm", "friction", "member", "accepted", "strain", "speed_mm_per_step", "steps", "cpu_s",
    "height_mm", "gathered_mm", "folds", "build",
]  # fmt: skip


def table() -> Table:
    """Return the table of all runs so far."""
    return Table("wide.csv", COLUMNS, ["width_mm", "excess_mm", "friction", "member"])


def run(width: float, excess_mm: float, friction: float, member: int) -> dict[str, object]:
    """Return one row."""
    mold, laid = strip(SPACING_MM, excess_mm, span_mm=width, bell_mm=width)
    end = mujoco_ply.simulate(mold, laid, member, mujoco_ply.Physics(friction=friction))
    fold = worst_fold(end.nodes_mm, laid.neighbours, laid.kinds, mold.reference)
    return {
        "width_mm": width,
        "excess_mm": excess_mm,
        "friction": friction,
        "member": member,
        "accepted": int(end.accepted),
        "strain": end.strain,
        "speed_mm_per_step": end.speed_mm,
        "steps": end.steps,
        "cpu_s": end.cpu_s,
        "height_mm": fold.height_mm,
        "gathered_mm": fold.gathered_mm,
        "folds": fold.folds,
        "build": f"mujoco {mujoco.__version__}",
    }


def text(rows: list[dict[str, str]]) -> str:
    """Return the mean share gathered by the largest fold, by width, excess and friction."""
    lines = [
        "SHARE OF A FIBRE'S EXCESS THAT ITS LARGEST FOLD GATHERS (least to most of the members; folds in the mean)",
        "",
    ]
    heads = [f"friction {f:g}, excess {r * LIMIT_EXCESS_MM:.2f} mm" for f in FRICTIONS for r in RATIOS]
    lines.append("  width mm  " + "  ".join(f"{h:>28}" for h in heads))
    for width in WIDTHS_MM:
        cells = []
        for friction in FRICTIONS:
            for ratio in RATIOS:
                key = (f"{width:g}", f"{ratio * LIMIT_EXCESS_MM:.6g}", f"{friction:g}")
                mine = [
                    r for r in rows if (r["width_mm"], r["excess_mm"], r["friction"]) == key and r["accepted"] == "1"
                ]
                share = np.array([float(r["gathered_mm"]) / float(r["excess_mm"]) for r in mine])
                count = np.mean([float(r["folds"]) for r in mine]) if mine else 0
                cells.append(f"{share.min():.2f} to {share.max():.2f}, {count:.1f}" if mine else "none accepted")
        lines.append(f"  {width:>8.0f}  " + "  ".join(f"{c:>28}" for c in cells))
    return "\n".join(lines) + "\n"


def main() -> None:
    """Compute the missing rows and write the table."""
    kept = table()
    for member in range(1, MEMBERS + 1):
        for width in WIDTHS_MM:
            for ratio in RATIOS:
                for friction in FRICTIONS:
                    excess_mm = float(f"{ratio * LIMIT_EXCESS_MM:.6g}")
                    if not kept.has(f"{width:g}", f"{excess_mm:.6g}", f"{friction:g}", member):
                        kept.add(run(width, excess_mm, friction, member))
    report = text(kept.rows())
    (HERE / "wide.txt").write_text(report, encoding="utf-8")
    print(report)


if __name__ == "__main__":
    main()
