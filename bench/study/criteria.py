"""Verdicts and costs of each criterion: python bench/study/criteria.py [--layups 110 119]. Writes criteria.txt.

Every virtual layup is inspected by the excess, by the excess with the solves that it does not need, too, and by the
paper's criterion, with loads of the net's own areas and with the paper's loads. CPU time is that of all threads of the
process, for the whole cycle.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from pathlib import Path
from textwrap import fill

from debulk import Inspector, Recipe, Verdict, scenes

RULES = {
    "excess": Recipe(),
    "excess, all nets": Recipe(solve={"when": "always"}),
    "paper": Recipe(verdict={"criterion": "paper"}),
    "paper, with its lumping": Recipe(verdict={"criterion": "paper"}, loads={"lumping": "paper"}),
}


def table(first: int, last: int) -> str:
    """Inspect the layups and return the results as text."""
    counts: dict[str, Counter[tuple[bool, Verdict]]] = {rule: Counter() for rule in RULES}
    cpu_s, solved = Counter[str](), Counter[str]()
    for seed in range(first, last + 1):
        layup = scenes.layup(seed)
        for rule, recipe in RULES.items():
            inspector = Inspector(recipe, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
            began = time.process_time()
            report = inspector.inspect(layup.scan).as_decided()
            cpu_s[rule] += time.process_time() - began
            for p in report.pockets:
                counts[rule][p.excess is None, p.verdict] += 1
                solved[rule] += p.solve is not None
    about = (
        f"Virtual layups {first} to {last} at 1280 x 960 pixels. Inside the ply / at its edge, where the minima decide "
        "by any criterion; CPU: ms of the whole cycle, all threads, a layup."
    )
    lines = ["WHAT THE CRITERION DECIDES", "", fill(about, 110), ""]
    lines.append(
        f"  {'criterion':<26} {'CEASE':>9} {'UNDECIDED':>9} {'CREASE':>9} {'INVALID':>9} {'solved':>7} {'CPU':>5}"
    )
    for rule, found in counts.items():
        shown = (Verdict.CEASE, Verdict.UNDECIDED, Verdict.CREASE, Verdict.INVALID)
        cells = " ".join(f"{f'{found[False, v]} / {found[True, v]}':>9}" for v in shown)
        lines.append(f"  {rule:<26} {cells} {solved[rule]:>7} {1e3 * cpu_s[rule] / (last - first + 1):>5.0f}")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--layups", type=int, nargs=2, default=(110, 119), help="first and last seed")
    text = table(*parser.parse_args().layups)
    Path(__file__).with_name("criteria.txt").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
