"""Do finer nets settle a bridge that the fibres' sections deny? python bench/study/bridge_nets.py [--out FILE].

Takes the pockets of limit.csv that are UNDECIDED because the net stands above the limit as a bridge and the sections do
not, and evaluates each with nets of 100 to 2000 nodes.
"""

from __future__ import annotations

import argparse
import csv
import time
from pathlib import Path
from textwrap import fill

import numpy as np
from limit import prepared

from debulk.inspection.evaluate.evaluation import evaluate_all
from debulk.inspection.running.cycle import Cycle
from debulk.recipe import Recipe
from debulk.results.report import PocketReport
from lab.varied.polygons import inside

NODES = (100, 200, 400, 1000, 2000)
HERE = Path(__file__).parent


def undecided_bridges() -> list[tuple[int, float]]:
    """Return layup and true ridge of each such pocket."""
    with (HERE / "limit.csv").open() as file:
        rows = [r for r in csv.DictReader(file) if r["verdict"] == "undecided"]
    return [(int(r["layup"]), float(r["truth_mm"])) for r in rows if "by its net, but" in r["reason"]]


def evaluated(seed: int, truth_mm: float, nodes: int) -> tuple[PocketReport, float]:
    """Return the pocket's report with a net of this size, and the seconds it took."""
    layup, given, inspector = prepared(seed, (1280, 960), Recipe(net={"node_target": nodes}, solve={"when": "always"}))
    pocket = min(layup.truth.pockets, key=lambda p: abs(p.ridge_mm - truth_mm))
    x, y = (np.array(v) for v in pocket.centre_mm)
    found = [p for p in inspector.find(given.scan).pockets if bool(inside(p.pocket.outline_mm, x, y))]
    began = time.perf_counter()
    (one,) = evaluate_all(found[:1], inspector.ply, Cycle(), 0.0)
    return one.report, time.perf_counter() - began


def main() -> None:
    """Print the table, and write it to a file if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    about = (
        "Pockets of limit.csv whose net bridges above the limit of 0.6 mm while the sections of its fibres do not, "
        "with nets of more nodes. Spacing, bridge and RMS in mm; drawn in: highest bridge that is not counted, because "
        "it pulls with more than friction holds; s: wall time of the pocket."
    )
    lines = ["BRIDGES OF FINER NETS", "", fill(about, 110), ""]
    lines.append(
        f"  {'layup':>6} {'nodes':>6} {'spacing':>8} {'bridge':>7} {'drawn in':>9} {'RMS':>6} {'s':>6}  verdict"
    )
    for seed, truth_mm in undecided_bridges():
        for nodes in NODES:
            p, seconds = evaluated(seed, truth_mm, nodes)
            drawn = "-" if p.drawn_in_mm is None else f"{p.drawn_in_mm:.2f}"
            lines.append(
                f"  {seed:>6} {nodes:>6} {p.spacing_mm or np.nan:>8.2f} {p.bridge_height_mm or 0.0:>7.2f} {drawn:>9} "
                f"{p.rms_mm or np.nan:>6.2f} {seconds:>6.2f}  {p.verdict.name}"
            )
            print(lines[-1], flush=True)
        lines.append("")
    text = "\n".join(lines).rstrip() + "\n"
    if args.out:
        args.out.write_text(text)


if __name__ == "__main__":
    main()
