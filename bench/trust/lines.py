"""The largest excess of held fibre lines against the true ridge, on right layups of the second family.

python bench/trust/lines.py [--layups 24] [--seed 7] [--out bench/trust/lines.txt]

For each layup: the true ridge of its worst place, and the lower end, the estimate and the upper end of the largest run
whose two ends are held, read from the heights of an inspection of the whole scan (docs/model.md, section 9). Nothing
else of the inspection takes part.
"""

from __future__ import annotations

import argparse
import collections
from pathlib import Path

import numpy as np
from cases import Case, make, truly

import debulk
from debulk.inspection.ply.fibre_runs import draw_length

PIXELS = (1280, 960)
NEAR_MM = 0.05  # a true ridge this near to the limit may fall on either side


def ridge_mm(excess_mm: np.ndarray, thickness_mm: float) -> np.ndarray:
    """Return the ridges of excess lengths (docs/model.md, section 5)."""
    return excess_mm / 2 + (2 - np.pi / 2) * thickness_mm


def measured(given: object, recipe: debulk.Recipe) -> tuple[float, float, float]:
    """Return lower end, estimate and upper end of the ridge of the largest held run, mm."""
    inspector = debulk.Inspector(
        recipe,
        given.reference,
        given.ply_outline,
        given.fibre_angles_deg,
        given.mold_from_scanner,
        given.camera,
        given.mask,
    )
    found = inspector.find(given.scan)
    if found.part is None:
        return (0.0, 0.0, 0.0)
    whole, feet = found.part
    runs = debulk.fibre.measure(
        whole.heights,
        inspector.reference,
        inspector.fibre_angles_deg,
        inspector.ply_outline,
        thickness_mm=recipe.material.thickness_mm,
        mold_tol_mm=feet.mold_tol_mm,
        draw_mm=draw_length(recipe),
        hold_mm=recipe.net.free_edge_mm,
    ).runs
    held = runs[runs.held]
    low, mid, high = (
        ridge_mm(values.max(initial=0.0), recipe.material.thickness_mm)
        for values in (held.low_mm - held.uncertainty_mm, held.excess_mm, held.high_mm + held.uncertainty_mm)
    )
    return float(low), float(mid), float(high)


def main() -> None:
    """Write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--layups", type=int, default=24)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--out", type=Path)
    wanted = parser.parse_args()
    recipe = debulk.Recipe()
    limit = recipe.verdict.max_ridge_mm
    lines, table, off = (
        ["  no  layup  true ridge  lines: low estimate  high  by them    worst place"],
        collections.Counter(),
        [],
    )
    for number in range(wanted.layups):
        layup_seed = int(np.random.default_rng([wanted.seed, number]).integers(1_000_000))
        case = Case(number, wanted.seed, "varied", layup_seed, None)
        layup, given = make(case, PIXELS)
        worst = max(truly(case, layup), key=lambda one: one.ridge_mm)
        low, mid, high = measured(given, recipe)
        said = "CREASE" if low > limit else "CEASE" if high <= limit else "UNDECIDED"
        true = (
            "creases" if worst.ridge_mm > limit + NEAR_MM else "ceases" if worst.ridge_mm < limit - NEAR_MM else "near"
        )
        table[true, said] += 1
        off.append(mid - worst.ridge_mm)
        lines.append(
            f"{number:4} {layup_seed:6}  {worst.ridge_mm:10.2f}  {low:10.2f} {mid:8.2f} {high:5.2f}  {said:9}  "
            f"{layup.truth.mold_kind}, {worst.kinds}"
        )
        print(lines[-1], flush=True)
    away = np.abs(off)
    lines += [
        "",
        *(f"{count:4} layups: {true}, {said} by the largest held run" for (true, said), count in sorted(table.items())),
        f"estimate less true ridge: median {np.median(off):+.3f} mm; within 0.03 mm on {np.mean(away <= 0.03):.0%},",
        f"within 0.10 mm on {np.mean(away <= 0.10):.0%} of all. True ridges are of single places: runs over two",
        "places that so little flat ply parts that one fold may draw both are longer.",
    ]
    text = "\n".join(lines) + "\n"
    print(text[text.index("\n\n") :])
    if wanted.out is not None:
        wanted.out.write_text(text)


if __name__ == "__main__":
    main()
