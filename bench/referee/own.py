"""Own nets, far finer than the default: python bench/referee/own.py [--starts 3] [--names A B ...].

Spacing 1 mm, more for large pockets, never above 1.5 mm (the lattice pins folds between 1.5 and 3.5 mm). Loads and
friction are those of the net's own areas, the recipe's default. Rows whose column `loads` says "P dx^2 a node" are from
before that default: there every node had a whole cell, and every free node's friction the mean way to the ply's edge.
Every start is perturbed: from the laid net itself a smooth, symmetric pocket keeps its symmetry, and ends with
four equal folds of higher energy. A row a solve goes to own.csv; only certified ones count.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import asdict, fields

import excess
from folds import Fold, worst_fold
from pockets import Pocket, all_pockets, spread
from tables import Table, build

from debulk import net, sheet, solve
from debulk.recipe import Recipe

NODES = 1700  # at most so many, while the spacing is below 1.5 mm
SPACINGS_MM = (1.0, 1.25, 1.5)
COLUMNS = [
    "pocket", "spacing_mm", "start", "variant", "nodes", "status", "certified", "compliant", "kkt_error",
    "length_error", "energy_mj", *(f.name for f in fields(Fold)), "fibre_excess_mm", "iterations", "cpu_s", "loads",
    "build",
]  # fmt: skip


def table() -> Table:
    """All solves so far."""
    return Table("own.csv", COLUMNS, ["pocket", "start", "variant"])


def spacing_for(pocket: Pocket) -> float:
    """The finest that keeps the work in bounds."""
    return next((d for d in SPACINGS_MM if pocket.foot_area_mm2 / d**2 < NODES), SPACINGS_MM[-1])


def fine_sheet(laid: net.Net, pocket: Pocket, young: float = 1.0, friction: float | None = None) -> sheet.Sheet:
    """The sheet; E times `young`."""
    material = Recipe().material
    changed = {"young_mpa": young * material.young_mpa, "friction": material.friction if friction is None else friction}
    return sheet.Sheet.of_net(laid, pocket.reference, Recipe(material=changed))


def run(
    pocket: Pocket, start: int, deadline_s: float, variant: str = "", young: float = 1.0, friction: float | None = None
) -> dict[str, object]:
    """One solve: a row."""
    spacing = spacing_for(pocket)
    laid = pocket.lay(spacing)
    ply = fine_sheet(laid, pocket, young, friction)
    began = time.process_time()
    found = solve.minimise(ply, starts=start + 1, first_start=start, seed=12, deadline_s=deadline_s)
    cpu = time.process_time() - began
    fold = worst_fold(found.nodes_mm, laid.neighbours, laid.kinds, pocket.reference)
    certificate = found.certificate
    return {
        "pocket": pocket.name,
        "spacing_mm": spacing,
        "start": start,
        "variant": variant,
        "nodes": len(laid.nodes_mm),
        "status": found.status,
        "certified": int(found.certified),
        "compliant": int(certificate.compliant),
        "kkt_error": certificate.kkt_error,
        "length_error": certificate.length_error,
        "energy_mj": found.energy_mj,
        **asdict(fold),
        "fibre_excess_mm": excess.largest(laid, pocket.reference),
        "iterations": found.iterations,
        "cpu_s": cpu,
        "loads": ply.ply["lumping"],
        "build": build(),
    }


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--starts", type=int, default=3)
    parser.add_argument("--deadline", type=float, default=600.0, help="seconds a solve")
    parser.add_argument("--most", type=int, default=1000, help="pockets")
    parser.add_argument("--names", nargs="*", help="of pockets; default: all, small ones all round the limit first")
    options = parser.parse_args()
    kept = table()
    chosen = [p for p in spread(all_pockets()) if not options.names or p.name in options.names][: options.most]
    for start in range(1, options.starts + 1):
        for pocket in chosen:
            if kept.has(pocket.name, start, ""):
                continue
            row = run(pocket, start, options.deadline)
            if row["status"] != "deadline":  # a faster machine may try again
                kept.add(row)
            print(
                f"{pocket.name} start {start}: {row['status']}, height {row['height_mm']:.3f} mm, gathered "
                f"{row['gathered_mm']:.3f} of {row['fibre_excess_mm']:.3f} mm, {row['cpu_s']:.1f} s",
                flush=True,
            )


if __name__ == "__main__":
    main()
