"""Own nets, far finer than the default: python bench/referee/own.py [--members 3] [--names A B ...].

Spacing 1 mm, more for large pockets, never above 1.5 mm (the lattice pins folds between 1.5 and 3.5 mm). Loads and
friction are those of the net's own areas, the recipe's default. Rows whose column `loads` says "P dx^2 a node" are from
before that default: there every node had a whole cell, and every free node's friction the mean way to the ply's edge;
at the edge, where that matters, they stand as a variant.
Every start is perturbed: from the laid net itself a smooth, symmetric pocket keeps its symmetry, and ends with
four equal folds of higher energy. A row a solve goes to own.csv; only certified ones count.
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

NODES = 1700  # at most so many, while the spacing is below 1.5 mm
SPACINGS_MM = (1.0, 1.25, 1.5)
DEADLINE_S = 600.0
MEAN_WAY = "mean way"  # variant of the rows at the edge from before
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


def fine_sheet(laid: net.Net, pocket: Pocket, variant: str = "") -> sheet.Sheet:
    """The sheet."""
    return sheet.Sheet.of_net(laid, pocket.reference, Recipe(material=MATERIAL[variant]))


def run(one: Case) -> dict[str, object]:
    """One solve: a row."""
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
    """Make the rows that are missing."""
    case.complete(table(), cases, run, "certified")


def main() -> None:
    """Command line."""
    complete(case.asked(__doc__, members=3, most=1000))


if __name__ == "__main__":
    main()
