"""The figures by which each criterion judges a pocket, from the default net: python bench/referee/figures.py.

They are the excess of the laid net (of whole fibres and in sliding windows, at the default spacing and at half of it)
and the results of the paper's solve with its lumping of the loads: RMS and ridge over the recipe's starts, with the
verdict. One row per pocket goes to figures.csv.
"""

from __future__ import annotations

import excess
import numpy as np
from pockets import LIMIT_EXCESS_MM, Pocket, all_pockets
from tables import Table, build

from debulk import _core, net, ridge, section, sheet, solve, verdict
from debulk.inspection.minima import starts
from debulk.recipe import Recipe

WINDOWS_MM = (34.0, 38.0, 42.0)  # H / (mu P) is 17 to 21 mm on each side of the fold
COLUMNS = [
    "pocket", "family", "at_edge", "foot_area_mm2", "spacing_mm", "nodes", "excess_all_mm", "excess_mm",
    "excess_half_spacing_mm", *(f"excess_window_{w:.0f}_mm" for w in WINDOWS_MM), "elastic_height_mm", "rms_mm",
    "rms_low_mm", "rms_high_mm", "ridge_mm", "ridge_low_mm", "ridge_high_mm", "verdict", "starts", "build",
]  # fmt: skip


def table() -> Table:
    """Return the table of all pockets so far."""
    return Table("figures.csv", COLUMNS, ["pocket"])


def elastic_height(excess_mm: float) -> float:
    """Return the height of the elastic fold that holds an excess, under a dead load, mm."""
    if excess_mm <= 0.005:
        return 0.0
    found = section.fold(excess_mm, 50.0, pressure="vertical", segments=400)
    return found.height_mm if found.certified else float("nan")


def settled(pocket: Pocket, laid: net.Net, recipe: Recipe) -> starts.Settled:
    """Return the combined result of all starts that the recipe asks for."""

    def post_process(solution: solve.Solution) -> ridge.PostProcessed:
        return ridge.post_process(
            solution.nodes_mm,
            laid.neighbours,
            laid.inside,
            pocket.reference,
            thickness_mm=recipe.material.thickness_mm,
            bulk_factor=recipe.material.bulk_factor,
            touch_mm=recipe.ridge.touch_mm,
        )

    ply = sheet.Sheet.of_net(laid, pocket.reference, recipe)
    return starts.settle(ply, recipe, post_process, _core.Stop())


def run(pocket: Pocket) -> dict[str, object]:
    """Return one row."""
    recipe = Recipe(loads={"lumping": "paper"})
    laid = pocket.lay()
    half = pocket.lay(laid.spacing_mm / 2)
    found = settled(pocket, laid, recipe)
    judged = verdict.judge(
        certified=found.solution.certified,
        rms_mm=found.best.rms_mm,
        ridge_height_mm=found.best.ridge_height_mm,
        bridge_height_mm=found.best.bridge_height_mm,
        rms_range_mm=found.rms_mm,
        ridge_range_mm=found.ridge_mm,
        bridge_range_mm=found.bridge_mm,
        compliant=found.solution.certificate.compliant,
        criteria=verdict.criteria_of(recipe),
    )
    held = excess.largest(laid, pocket.reference)
    return {
        "pocket": pocket.name,
        "family": pocket.family,
        "at_edge": int(pocket.at_edge),
        "foot_area_mm2": pocket.foot_area_mm2,
        "spacing_mm": laid.spacing_mm,
        "nodes": len(laid.nodes_mm),
        "excess_all_mm": excess.largest(laid, pocket.reference, held=False),
        "excess_mm": held,
        "excess_half_spacing_mm": excess.largest(half, pocket.reference),
        **{f"excess_window_{w:.0f}_mm": excess.largest(laid, pocket.reference, w) for w in WINDOWS_MM},
        "elastic_height_mm": elastic_height(held),
        "rms_mm": found.best.rms_mm,
        "rms_low_mm": found.rms_mm[0],
        "rms_high_mm": found.rms_mm[1],
        "ridge_mm": found.best.ridge_height_mm,
        "ridge_low_mm": found.ridge_mm[0],
        "ridge_high_mm": found.ridge_mm[1],
        "verdict": judged.verdict.value,
        "starts": len(found.solution.minima),
        "build": build(),
    }


def main() -> None:
    """Compute the missing rows."""
    kept = table()
    for pocket in all_pockets():
        if not kept.has(pocket.name):
            kept.add(run(pocket))
    rows = kept.rows()
    close = np.mean([0.6 <= float(r["excess_all_mm"]) / LIMIT_EXCESS_MM <= 1.4 for r in rows])
    print(f"figures of {len(rows)} pockets, {close:.0%} of them with an excess within 40 % of the limit's")


if __name__ == "__main__":
    main()
