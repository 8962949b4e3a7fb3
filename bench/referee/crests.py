"""Compare the crest by the excess with the folds of converged simulations: python bench/referee/crests.py.

Lays the default net of every pocket inside the ply, and compares the place, direction and length of its crest with the
worst folds of own.csv and of the accepted runs of mujoco.csv. The same is done for the highest ridge of the net itself
at a minimum. Writes crests.txt.
"""

from __future__ import annotations

from dataclasses import dataclass
from textwrap import fill

import numpy as np
import own
from pockets import Pocket, all_pockets
from tables import HERE, Table

from debulk import _core, net, ridge, sheet, solve
from debulk.inspection.minima.ridges import HELD_SPREAD
from debulk.inspection.ply import polyline
from debulk.recipe import Recipe
from lab.net_crests import distance_mm, net_crests


@dataclass(frozen=True)
class Compared:
    """One fold compared with the crest of its pocket, which comes from the excess or from the net's minimum."""

    engine: str
    crest: str
    half: str  # half of the set of pockets: "layup", or "synthetic"
    off: float  # distance of the fold's highest point from the nearer line, in radii of the foot
    turned_deg: float  # angle of the fold to the nearer line
    length: float  # length of the crest over that of the fold
    single: bool  # no other fold is higher than half of this one
    mirrored: bool


def compare() -> list[Compared]:
    """Compare every fold of a pocket inside the ply."""
    folds = [("own", row) for row in own.table().rows() if row["certified"] == "1" and not row["variant"]]
    folds += [
        ("MuJoCo", row)
        for row in Table("mujoco.csv", [], ["pocket"]).rows()
        if row["accepted"] == "1" and not row["variant"]
    ]
    found = []
    for pocket in all_pockets():
        mine = [(engine, row) for engine, row in folds if row["pocket"] == pocket.name]
        laid = pocket.lay()
        if not mine or pocket.at_edge or (laid.kinds == 2).any():
            continue
        crest = _core.ridge.excess_crest(laid._core.net, pocket.reference)
        if crest is None:
            continue
        crests = {"excess": [line for line in (crest.line_mm, crest.mirrored_mm) if len(line)]}
        shown = _of_net(laid, pocket)
        if shown is not None:
            crests["net"] = [shown]
        radius_mm = float(np.sqrt(pocket.foot_area_mm2 / np.pi))
        for engine, row in mine:
            peak, fold_deg = np.array([float(row["x_mm"]), float(row["y_mm"])]), float(row["direction_deg"])
            for name, lines in crests.items():
                directions = [polyline.direction_deg(polyline.axis(line)) for line in lines]
                found.append(
                    Compared(
                        engine,
                        name,
                        "layup" if pocket.family == "layup" else "synthetic",
                        min(float(distance_mm(line, peak)) for line in lines) / radius_mm,
                        min(abs((direction - fold_deg + 90) % 180 - 90) for direction in directions),
                        polyline.length_mm(lines[0]) / max(float(row["length_mm"]), 1e-9),
                        row["folds"] == "1",
                        len(crest.mirrored_mm) > 0,
                    )
                )
    return found


def _of_net(laid: net.Net, pocket: Pocket) -> np.ndarray | None:
    """Return (K, 2) the highest ridge of a minimum."""
    recipe = Recipe()
    found = solve.minimise(sheet.Sheet.of_net(laid, pocket.reference, recipe), starts=2, first_start=1)
    if not found.certified:
        return None
    ply = recipe.material
    ridges = ridge.post_process(
        found.nodes_mm,
        laid.neighbours,
        laid.inside,
        pocket.reference,
        thickness_mm=ply.thickness_mm,
        bulk_factor=ply.bulk_factor,
    )
    crests = net_crests(ridges, laid.neighbours, found.nodes_mm)
    return crests[0].points_mm[:, :2] if crests else None


def table(found: list[Compared]) -> str:
    """Return the results as text: the median, and the value that nine in ten do not exceed."""
    lines = [
        fill(
            "The crest that the excess of a default net's fibres makes, against the worst folds of converged "
            "simulations, pockets inside the ply. Off: distance of the fold's highest point from the crest, in radii "
            "of a disc of the foot's area. Turned: between the directions. Length: the crest's over the fold's. Each: "
            "median and 90 %, of the length 10 and 90 %. Two lines: pockets for which a mirrored crest is given too; "
            "the nearer one counts. Net: the highest ridge of the default net's minimum, in place of that crest. In "
            "the band: folds whose highest point lies within the band that a report gives.",
            116,
        ),
        "",
        "engine  pockets            folds      off            turned, deg         length          in the band",
    ]
    kinds = {
        "all": lambda c: c.crest == "excess",
        "layup": lambda c: c.crest == "excess" and c.half == "layup",
        "synthetic": lambda c: c.crest == "excess" and c.half == "synthetic",
        "one fold": lambda c: c.crest == "excess" and c.single,
        "one line": lambda c: c.crest == "excess" and not c.mirrored,
        "two lines": lambda c: c.crest == "excess" and c.mirrored,
        "net": lambda c: c.crest == "net",
    }
    for engine in ("own", "MuJoCo"):
        for name, of_kind in kinds.items():
            chosen = [c for c in found if c.engine == engine and of_kind(c)]
            if not chosen:
                continue
            off, turned, length = (
                np.array([getattr(c, key) for c in chosen]) for key in ("off", "turned_deg", "length")
            )
            lines.append(
                f"{engine:<8}{name:<16}{len(chosen):8d}{np.median(off):9.3f}{np.quantile(off, 0.9):7.3f}"
                f"{np.median(turned):12.1f}{np.quantile(turned, 0.9):7.1f}"
                f"{np.median(length):12.2f}{np.quantile(length, 0.1):6.2f}{np.quantile(length, 0.9):6.2f}"
                f"{100 * np.mean(off <= HELD_SPREAD):9.0f} %"
            )
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run from the command line."""
    text = table(compare())
    (HERE / "crests.txt").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
