"""The effect of loads by the net's own areas: python bench/referee/loads.py [--seconds 3.2]. Writes loads.txt.

The synthetic pockets whose fine nets took no more than this CPU time are solved again as own.py does now. They are
compared with their rows in own.csv, which date from when every node had the load of a whole cell, and every free node
friction over the mean distance to the ply's edge. Also listed are the results of the default nets, by the paper's
lumping and by the net's own areas, because these figures decide at the ply's edge.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from textwrap import fill

import own
from figures import settled
from folds import worst_fold
from pockets import LIMIT_EXCESS_MM, Pocket, shapes, synthetic_pocket

from debulk import solve
from debulk.recipe import Recipe


def line(pocket: Pocket, row: dict[str, str]) -> str:
    """Return the line of one pocket."""
    laid = pocket.lay(float(row["spacing_mm"]))
    start = int(row["start"])
    found = solve.minimise(own.fine_sheet(laid, pocket), starts=start + 1, first_start=start, seed=12)
    now = worst_fold(found.nodes_mm, laid.neighbours, laid.kinds, pocket.reference)
    then = float(row["gathered_mm"])
    same = (then > LIMIT_EXCESS_MM) == (now.gathered_mm > LIMIT_EXCESS_MM)
    default = pocket.lay()
    of_default = [
        "{:.2f} to {:.2f}".format(*settled(pocket, default, Recipe(loads={"lumping": lumping})).ridge_mm)
        for lumping in ("paper", "consistent")
    ]
    return (
        f"  {pocket.name:<12} {then:>7.3f} {now.gathered_mm:>7.3f} {'yes' if found.certified else 'no':>9} "
        f"{'same' if same else 'OTHER':>6}  {of_default[0]:>13} {of_default[1]:>13}"
    )


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=3.2, help="most CPU of a fine net that is solved again")
    most = parser.parse_args().seconds
    rows = {
        row["pocket"]: row
        for row in own.table().rows()
        if row["loads"] != "consistent" and row["variant"] in ("", own.MEAN_WAY)
        if row["certified"] == "1" and float(row["cpu_s"]) <= most
    }
    lines = [line(synthetic_pocket(shape), rows[shape.name]) for shape in shapes() if shape.name in rows]
    about = (
        "Gathered by the worst fold of the fine net, mm: as own.csv has it, and with loads of the net's own areas; "
        f"whether that is certified, and on the same side of the limit's {LIMIT_EXCESS_MM:.3f} mm. Ridge of the "
        "default net over its starts, mm: with the paper's lumping and with the net's own areas; its limit is 0.60 mm."
    )
    head = f"  {'pocket':<12} {'then':>7} {'now':>7} {'certified':>9} {'side':>6}"
    head += f"  {'ridge, paper':>13} {'own areas':>13}"
    text = "\n".join(["LOADS OF THE NET'S OWN AREAS", "", fill(about, 110), "", head, *lines]) + "\n"
    Path(__file__).with_name("loads.txt").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
