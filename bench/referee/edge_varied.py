"""Second-family pockets at the ply's edge, against fine nets: python bench/referee/edge_varied.py [--layups 14].

The layups are of the second family, with pockets that the edge cuts. For those pockets that would cease with a slipping
rim but keep some excess with more friction, fine nets are solved with three distributions of the friction, as in
edge.py. Writes edge_varied.txt.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from textwrap import fill

import numpy as np
import own
from edge import along_fibres
from folds import worst_fold
from tables import HERE

from debulk import Inspector, Recipe, _core, net, ridge, sheet, solve
from debulk.inspection.evaluate.evaluation import evaluate
from debulk.inspection.find.found import FoundPocket
from debulk.inspection.minima import starts
from debulk.inspection.minima.laid_pocket import lay_net, lay_pocket
from debulk.inspection.ply.excess import ridge_of
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.pocket import distance_to_outline
from debulk.verdict import Verdict
from lab.varied import given_right, varied_layup

FIRST, LARGEST_FOOT_MM2, LEAST_MM, KEPT_MM = 7000, 3800.0, 0.25, 0.4
KINDS = ("edge", "corner", "edge", "edge", "corner", "edge to edge")
FIRM_MM, DEADLINE_S = 200.0, 300.0


def kept_mm(found: FoundPocket, ply: PlyOnMold) -> float:
    """Return the largest fibre excess that the default net keeps with a held rim or friction along the fibres, mm."""
    laid = lay_pocket(found, ply)
    net_, kept = laid.net, 0.0
    along = sheet.Sheet(
        net_.nodes_mm, net_.neighbours, net_.kinds, net_.spacing_mm, net_.area_mm2, ply.reference, ply.recipe,
        along_fibres(np.asarray(ply.outline), net_),
    )  # fmt: skip
    rim = net.from_core(_core.net.with_rim_held(net_._core))
    for one in (along, sheet.Sheet.of_net(rim, ply.reference, ply.recipe)):
        for end in starts.settle(one, ply.recipe, laid.post_process, _core.Stop()).counted:
            kept = max(kept, ridge.largest_fibre_excess(end.nodes_mm, net_.neighbours, ply.reference))
    return kept


def fine_ridges(found: FoundPocket, ply: PlyOnMold) -> dict[str, float]:
    """Return the ridge of the worst fold of a certified fine net, mm, for each distribution of the friction."""
    spacing = next((d for d in own.SPACINGS_MM if found.foot.area_mm2 / d**2 < own.NODES), own.SPACINGS_MM[-1])
    nets = ply.recipe.net.model_copy(update={"spacing_mm": spacing})
    laid = lay_net(replace(found, net=None), replace(ply, recipe=ply.recipe.model_copy(update={"net": nets})))
    nearest = distance_to_outline(ply.outline, laid.nodes_mm[:, :2])
    ways = {
        "nearest": nearest,
        "along": along_fibres(np.asarray(ply.outline), laid),
        "held": np.where(nearest > 2 * spacing, FIRM_MM, nearest),
    }
    ridges = {}
    for sharing, way in ways.items():
        fine = sheet.Sheet(
            laid.nodes_mm, laid.neighbours, laid.kinds, spacing, laid.area_mm2, ply.reference, ply.recipe, way
        )  # fmt: skip
        end = solve.minimise(fine, starts=2, first_start=1, seed=12, deadline_s=DEADLINE_S)
        if end.certified:
            fold = worst_fold(end.nodes_mm, laid.neighbours, laid.kinds, ply.reference)
            height_mm = ridge_of(fold.gathered_mm, ply.recipe)
            ridges[sharing] = height_mm if height_mm > LEAST_MM else 0.0
    return ridges


def rows(seed: int) -> list[str]:
    """Return one row for each pocket of a layup."""
    layup = varied_layup(
        seed, pockets=KINDS, severity="any", noise=(), holes_mm=0, clamp=False, borders=seed % 2
    )  # fmt: skip
    given = given_right(layup)
    inspector = Inspector(
        Recipe(), given.reference, given.ply_outline, given.fibre_angles_deg, given.mold_from_scanner, mask=given.mask
    )
    lines = []
    for found in inspector.find(given.scan).pockets:
        if found.foot.area_mm2 > LARGEST_FOOT_MM2:
            continue
        one = evaluate(found, inspector.ply, _core.Stop()).report
        both = one.edge_friction
        if both is None or both.slipping.verdict is not Verdict.CEASE or both.held.ridge_range_mm is None:
            continue
        if kept_mm(found, inspector.ply) < KEPT_MM:
            continue
        fine = fine_ridges(found, inspector.ply)
        cells = " ".join(f"{f'{fine[s]:.2f}' if s in fine else '–':>8}" for s in ("nearest", "along", "held"))
        ranges = (both.slipping.ridge_range_mm, both.held.ridge_range_mm)
        ends = " ".join(f"{f'{low:.2f} to {high:.2f}':>13}" for low, high in ranges)
        lines.append(f"  {f'{seed}/{found.number}':<8} {ends} {one.verdict.name:>10} {cells}")
        print(lines[-1], flush=True)
    return lines


def text(lines: list[str]) -> str:
    """Return the table as text."""
    about = (
        "Pockets of the second family's layups that the ply's edge cuts, that would cease as their rim slips and keep "
        f"{KEPT_MM:g} mm of excess or more with a held rim or friction along the fibres: range of the default net's "
        "ridge with the rim slipping and held, mm, what an inspection says of both, and the ridge of the worst fold of "
        "fine nets by the sharings of edge.txt (–: not certified). The limit is 0.60 mm. An elastic sheet with E = 360 "
        "MPa; no part was tested."
    )
    head = f"  {'pocket':<8} {'slipping':>13} {'rim held':>13} {'said':>10} {'nearest':>8} {'along':>8} {'held':>8}"
    return "\n".join(["FRICTION AT THE PLY'S EDGE, OTHER POCKETS", "", fill(about, 110), "", head, *lines]) + "\n"


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--layups", type=int, default=14)
    seeds = range(FIRST, FIRST + parser.parse_args().layups)
    (HERE / "edge_varied.txt").write_text(text([line for seed in seeds for line in rows(seed)]), encoding="utf-8")


if __name__ == "__main__":
    main()
