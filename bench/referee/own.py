"""Our own nets, far finer than the default: python bench/referee/own.py [--members 3] [--names A B ...].

The spacing is 1 mm, larger for large pockets, but never above 1.5 mm (the lattice pins folds between 1.5 and 3.5 mm).
Loads and friction are those of the net's own areas, the recipe's default. Rows whose column `loads` says
"P dx^2 a node" are older than that default: in them every node had the load of a whole cell, and every free node
friction over the mean distance to the ply's edge. At the edge, where this matters, these rows are kept as a variant.
Every start is perturbed: from the laid net itself, a smooth, symmetric pocket keeps its symmetry and ends with four
equal folds of higher energy. Each solve adds a row to own.csv; only certified ones count.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import asdict, fields

import case
import excess
from case import MATERIAL, Case
from folds import Fold, worst_fold
from pockets import Pocket
from tables import Table, build

from debulk import net, sheet, solve
from debulk.recipe import Recipe

NODES = 1700  # most nodes while the spacing is below 1.5 mm
SPACINGS_MM = (1.0, 1.25, 1.5)
DEADLINE_S = 600.0
MEAN_WAY = "mean way"  # variant of the older rows at the edge
COLUMNS = [
    "pocket", "spacing_mm", "start", "variant", "nodes", "status", "certified", "compliant", "kkt_error",
    "length_error", "energy_mj", *(f.name for f in fields(Fold)), "fibre_excess_mm", "iterations", "cpu_s", "loads",
    "build",
]  # fmt: skip


def table() -> Table:
    """Return the table of all solves so far."""
    return Table("own.csv", COLUMNS, ["pocket", "start", "variant"])


def spacing_for(pocket: Pocket) -> float:
    """Return the finest spacing that keeps the work within bounds."""
    return next((d for d in SPACINGS_MM if pocket.foot_area_mm2 / d**2 < NODES), SPACINGS_MM[-1])


def fine_sheet(laid: net.Net, pocket: Pocket, variant: str = "") -> sheet.Sheet:
    """Return the sheet of a fine net."""
    return sheet.Sheet.of_net(laid, pocket.reference, Recipe(material=MATERIAL[variant]))


def run(one: Case) -> dict[str, object]:
    """Solve once and return a row."""
    pocket, start = one.pocket, one.member
    spacing = spacing_for(pocket)
    laid = pocket.lay(spacing)
    ply = fine_sheet(laid, pocket, one.variant)
    began = time.process_time()
    found = solve.minimise(ply, starts=start + 1, first_start=start, seed=12, deadline_s=DEADLINE_S)
    cpu = time.process_time() - began
    fold = worst_fold(found.nodes_mm, laid.neighbours, laid.kinds, pocket.reference)
    certificate = found.certificate
    return {
        "pocket": pocket.name,
        "spacing_mm": spacing,
        "start": start,
        "variant": one.variant,
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


def complete(cases: Iterable[Case]) -> None:
    """Compute the missing rows."""
    case.complete(table(), cases, run, "certified")


def main() -> None:
    """Run from the command line."""
    complete(case.asked(__doc__, members=3, most=1000))


if __name__ == "__main__":
    main()
