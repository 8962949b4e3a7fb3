"""How friction is distributed at the ply's edge, and its effect: python bench/referee/edge.py [--starts 2].

A net's free nodes represent the ply between them and its edge, so the length of ply that holds each of them must be
chosen. Each pocket of the table that the edge cuts is solved with five choices, which shows how much its outcome
depends on the choice. With --laid names, MuJoCo simulates these pockets with the ply around them laid out and each of
its nodes rubbing on the mold; then nothing has to be chosen. Rows go to edge.csv, the ranges to edge.txt.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from textwrap import fill

import mujoco_ply
import mujoco_runs
import numpy as np
import own
from figures import settled
from folds import worst_fold
from members import span
from pockets import LIMIT_EXCESS_MM, Pocket, all_pockets
from tables import HERE, Table, build

from debulk import _core, net, sheet, solve
from debulk.pocket import distance_to_outline
from debulk.recipe import Recipe

FIRM_MM = 200.0  # length of ply that no fibre's force can move: practically pinned
LAID_MM = 22.0  # width of ply laid out round the foot: 17 to 21 mm hold the end force of a fold near the limit
COLUMNS = ["pocket", "start", "sharing", "spacing_mm", "nodes", "free", "certified", "gathered_mm", "slip_mm", "build"]
SHARINGS = ("none", "nearest", "mean", "along", "held")
ABOUT = {
    "none": "no friction",
    "nearest": "each free node's way to the nearest point of the edge (the recipe's default)",
    "mean": "the mean of these ways for every free node",
    "along": "each node's way to the edge along the fibre that ends there",
    "held": "no free node slips but those within two spacings of the edge",
}
LAID = "laid"


def table() -> Table:
    """Return the table of all solves so far."""
    return Table("edge.csv", COLUMNS, ["pocket", "start", "sharing"])


def ways(pocket: Pocket, laid: net.Net, sharing: str) -> np.ndarray:
    """Return (N,) length of ply that holds each node, mm."""
    nearest = distance_to_outline(pocket.ply_outline_mm, laid.nodes_mm[:, :2])
    if sharing == "none":
        return np.zeros_like(nearest)
    if sharing == "mean":
        return np.full_like(nearest, nearest[laid.kinds == 2].mean())
    if sharing == "along":
        return along_fibres(pocket.ply_outline_mm, laid)
    if sharing == "held":
        return np.where(nearest > 2 * laid.spacing_mm, FIRM_MM, nearest)
    return nearest


def along_fibres(ply_outline_mm: np.ndarray, laid: net.Net) -> np.ndarray:
    """Return (N,) distance straight on from a fibre's end to the ply's edge, mm; the longer if two fibres end there."""
    xy, found = laid.nodes_mm[:, :2], np.zeros(len(laid.nodes_mm))
    for ahead, back in ((0, 1), (1, 0), (2, 3), (3, 2)):
        ends = np.flatnonzero((laid.neighbours[:, ahead] < 0) & (laid.neighbours[:, back] >= 0))
        for i in ends:
            step = xy[i] - xy[laid.neighbours[i, back]]
            found[i] = max(found[i], _to_outline(xy[i], step / np.linalg.norm(step), ply_outline_mm))
    return np.minimum(found, FIRM_MM)


def _to_outline(start: np.ndarray, along: np.ndarray, outline: np.ndarray) -> float:
    """Return the distance from a point in a direction to the first side of a polygon, mm; 0 from outside."""
    a, side = outline, np.roll(outline, -1, axis=0) - outline
    cross = along[0] * side[:, 1] - along[1] * side[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        way = ((a - start)[:, 0] * side[:, 1] - (a - start)[:, 1] * side[:, 0]) / cross
        at = ((a - start)[:, 0] * along[1] - (a - start)[:, 1] * along[0]) / cross
    hit = way[(way > 0) & (at >= 0) & (at < 1)]
    return float(hit.min()) if len(hit) % 2 else 0.0


def run(pocket: Pocket, start: int, sharing: str) -> dict[str, object]:
    """Solve once and return a row."""
    laid = pocket.lay(own.spacing_for(pocket))
    ply = sheet.Sheet(
        laid.nodes_mm,
        laid.neighbours,
        laid.kinds,
        laid.spacing_mm,
        laid.area_mm2,
        pocket.reference,
        Recipe(),
        ways(pocket, laid, sharing),
    )
    found = solve.minimise(ply, starts=start + 1, first_start=start, seed=12, deadline_s=own.DEADLINE_S)
    return _row(pocket, start, sharing, laid, found.nodes_mm, found.certified)


def run_laid(pocket: Pocket, member: int) -> dict[str, object]:
    """Run MuJoCo once on a pocket on a flat mold, with the ply around the pocket laid out, and return a row."""
    out = pocket.outline_mm - pocket.centre_mm
    laid = net.fibre_net(
        pocket.surface,
        pocket.reference,
        pocket.centre_mm,
        pocket.angles_deg,
        mujoco_runs.SPACING_MM,
        outline_mm=pocket.centre_mm + out * (1 + LAID_MM / np.linalg.norm(out, axis=1, keepdims=True)),
        ply_outline=pocket.ply_outline_mm,
        edge_tol_mm=2 * mujoco_runs.SPACING_MM,
        mold_tol_mm=pocket.mold_tol_mm,
    )
    no_lumps = replace(pocket, ply_outline_mm=np.empty((0, 2)))
    end = mujoco_ply.simulate(no_lumps, laid, member, mujoco_ply.Physics())
    print(f"{pocket.name} {member} laid: strain {end.strain:.1e}, {end.steps} steps, {end.cpu_s:.0f} s", flush=True)
    return _row(pocket, member, LAID, laid, end.nodes_mm, end.accepted)


def _row(
    pocket: Pocket, member: int, sharing: str, laid: net.Net, nodes: np.ndarray, certified: bool
) -> dict[str, object]:
    free = laid.kinds == 2
    return {
        "pocket": pocket.name,
        "start": member,
        "sharing": sharing,
        "spacing_mm": laid.spacing_mm,
        "nodes": len(nodes),
        "free": int(free.sum()),
        "certified": int(certified),
        "gathered_mm": worst_fold(nodes, laid.neighbours, laid.kinds, pocket.reference).gathered_mm,
        "slip_mm": float(np.linalg.norm((nodes - laid.nodes_mm)[free], axis=1).max(initial=0.0)),
        "build": build(),
    }


def _both_ends(pocket: Pocket) -> tuple[net.Net, net.Net]:
    """Return the default nets that an inspection solves if a pocket would cease: slipping, and with its rim held."""
    laid = pocket.lay()
    return laid, net.from_core(_core.net.with_rim_held(laid._core))


def text(pockets: list[Pocket]) -> str:
    """Return the ranges as text."""
    rows = [row for row in table().rows() if row["certified"] == "1"]
    lines = [
        f"  {'pocket':<8} "
        + " ".join(f"{s:>14}" for s in (*SHARINGS, LAID))
        + f" {'sides':>6} {'default net':>14} {'its rim held':>14}",
    ]
    for pocket in pockets:
        mine = [row for row in rows if row["pocket"] == pocket.name]
        if not mine:
            continue
        ends = {s: [float(r["gathered_mm"]) for r in mine if r["sharing"] == s] for s in (*SHARINGS, LAID)}
        above = [g > LIMIT_EXCESS_MM for sharing in SHARINGS for g in ends[sharing]]
        lines.append(
            f"  {pocket.name:<8} "
            + " ".join(f"{span(gathered):>14}" for gathered in ends.values())
            + f" {'above' if all(above) else 'both' if any(above) else 'below':>6}"
            + "".join(f" {span(list(settled(pocket, rim, Recipe()).ridge_mm)):>14}" for rim in _both_ends(pocket))
        )
    said = "; ".join(f"{name}: {what}" for name, what in ABOUT.items())
    about = (
        f"Gathered by the worst fold of the fine net over its starts, mm; the limit's excess is {LIMIT_EXCESS_MM:.3f} "
        f"mm. {said}; {LAID}: MuJoCo with {LAID_MM:.0f} mm of ply laid out round the foot, each of its nodes rubbing "
        "on the mold, so that nothing is shared out. Sides: of that limit, over a row's fine nets. Default net: range "
        "of its ridge over its starts, mm, as it slips and with its rim held; the limit is 0.60 mm. An elastic sheet "
        "with E = 360 MPa; no part was tested."
    )
    return "\n".join(["FRICTION AT THE PLY'S EDGE", "", fill(about, 110), "", *lines]) + "\n"


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--starts", type=int, default=2)
    parser.add_argument("--most", type=int, default=16, help="pockets, small ones first")
    parser.add_argument("--laid", nargs="*", default=[], help="pockets whose ply is laid out to its edge, in MuJoCo")
    options = parser.parse_args()
    pockets = sorted((p for p in all_pockets() if p.at_edge), key=lambda p: p.foot_area_mm2)[: options.most]
    kept = table()
    for start in range(1, options.starts + 1):
        for pocket in pockets:
            for sharing in SHARINGS:
                if not kept.has(pocket.name, start, sharing):
                    kept.add(run(pocket, start, sharing))
        for pocket in pockets:
            if pocket.name in options.laid and not kept.has(pocket.name, start, LAID):
                kept.add(run_laid(pocket, start))
    report = text(pockets)
    (HERE / "edge.txt").write_text(report, encoding="utf-8")
    print(report)


if __name__ == "__main__":
    main()
