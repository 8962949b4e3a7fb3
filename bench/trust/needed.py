"""What each check is worth: python bench/trust/needed.py build/trust/*.csv [--out bench/trust/needed.txt].

From the scenes that trust.py has inspected: how often a check made the verdict worse than CEASE, how often it was the
only one that did so where the layup must not pass (without it that layup would have passed), and how often it was the
only one where nothing was wrong. A check that never stands alone on fresh scenes is a candidate for going; one of the
scan's place stops those after it, so what it hides is only seen without it.
"""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path

from cases import Outcome

from debulk.inspection.checks.listed import CHECKS
from trust import read


def table(outcomes: list[Outcome]) -> str:
    """Return a row for each check of the list, those that never spoke last."""
    spoke, alone, needless = Counter[str](), Counter[str](), Counter[str]()
    for outcome in outcomes:
        names = {said.split(":")[0] for said in outcome.checks.split()}
        spoke.update(names)
        if len(names) == 1:
            if outcome.creases or outcome.blind:
                alone.update(names)
            elif outcome.closes:
                needless.update(names)
    rows = [f"{'check':<22}{'spoke':>8}{'alone, rightly':>16}{'alone, needlessly':>19}"]
    listed = sorted((check.name for check in CHECKS), key=lambda name: (-alone[name], -spoke[name], name))
    rows += [f"{name:<22}{spoke[name]:>8}{alone[name]:>16}{needless[name]:>19}" for name in listed]
    return "\n".join(rows) + "\n"


def main() -> None:
    """Write the table of all given runs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("csv", type=Path, nargs="+")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("needed.txt"))
    args = parser.parse_args()
    outcomes = [outcome for path in args.csv for outcome in read(path)]
    text = f"{len(outcomes)} scenes of {len(args.csv)} runs\n\n{table(outcomes)}"
    args.out.write_text(text)
    print(text)


if __name__ == "__main__":
    main()
