"""How often the true ridge lies within the stated range: python bench/trust/ranges.py [--layups 20] [--seed 91000].

The layups are of the second family with nothing wrong. For every pocket inside the ply that has an excess, the highest
true ridge in its foot is compared with the range by the excess, and its verdict with the limit. `--out FILE` also
writes the text to a file.
"""

from __future__ import annotations

import argparse
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import debulk
from debulk import Inspector, Recipe, Verdict
from lab.varied import varied_layup
from lab.varied.given import given_right
from lab.varied.polygons import inside

VERDICTS = (Verdict.CEASE, Verdict.UNDECIDED, Verdict.CREASE, Verdict.INVALID)
ROUNDED_MM = 5e-4  # values that the text shows as equal count as equal


@dataclass(frozen=True)
class Held:
    """A pocket's range and its true ridge."""

    seed: int
    kinds: str
    true_mm: float
    low_mm: float
    high_mm: float
    verdict: Verdict

    @property
    def above(self) -> bool:
        """Return whether the truth lies above the upper end of the range."""
        return self.true_mm > self.high_mm + ROUNDED_MM

    @property
    def below(self) -> bool:
        """Return whether the truth lies below the lower end of the range."""
        return self.true_mm < self.low_mm - ROUNDED_MM

    @property
    def text(self) -> str:
        """Return one line of the table."""
        return (
            f"{self.seed:6}  {self.kinds:24}{self.true_mm:7.3f}   {self.low_mm:.3f} to {self.high_mm:.3f}  "
            f"{self.verdict.value}"
        )


@dataclass(frozen=True)
class Layup:
    """A layup's verdict and its highest true ridge."""

    seed: int
    mold: str
    true_mm: float
    verdict: Verdict
    reason: str


def looked_at(seed: int, pixels: tuple[int, int]) -> tuple[Layup, list[Held]]:
    """Inspect one layup."""
    layup = varied_layup(seed, pixels)
    given = given_right(layup)
    inspector = Inspector(
        None, given.reference, given.ply_outline, given.fibre_angles_deg, given.mold_from_scanner, mask=given.mask
    )
    report = inspector.inspect(given.scan)
    standing = (*layup.truth.pockets, *layup.truth.decoys)
    held = []
    for pocket in report.pockets:
        if pocket.excess is None or pocket.touches_ply_edge:
            continue
        in_it = [s for s in standing if inside(pocket.foot_outline_mm, *(np.array(v) for v in s.centre_mm))]
        if in_it:
            true = max(in_it, key=lambda s: s.ridge_mm)
            low, high = pocket.excess.range_mm
            held.append(Held(seed, "+".join(true.kinds), true.ridge_mm, low, high, pocket.verdict))
    return Layup(seed, layup.truth.mold_kind, layup.truth.ridge_mm, report.verdict, report.reason), held


def against(limit_mm: float, of: list[Any]) -> list[str]:
    """Return the counts of verdicts, for those whose true ridge is above the limit and for the others."""
    rows = (("above", [o for o in of if o.true_mm > limit_mm]), ("at most", [o for o in of if o.true_mm <= limit_mm]))
    lines = ["true ridge        " + "".join(f"{v.value:>11}" for v in VERDICTS)]
    for name, some in rows:
        counts = Counter(o.verdict for o in some)
        lines.append(f"{name + f' {limit_mm:g} mm':18}" + "".join(f"{counts[v] or '-':>11}" for v in VERDICTS))
    return lines


def text(layups: list[Layup], held: list[Held], pixels: str) -> str:
    """Return the text: counts first, then the pockets whose truth is outside their range."""
    limit = Recipe().verdict.max_ridge_mm
    above, below = [h for h in held if h.above], [h for h in held if h.below]
    head = "  seed  kind                     true mm  range mm        verdict"
    wrong = [h.text for h in held if h.verdict is Verdict.CEASE and h.true_mm > limit]
    passed = [
        f"layup {p.seed} on {p.mold}, true ridge {p.true_mm:.3f} mm: {p.reason}"
        for p in layups
        if p.verdict is Verdict.CEASE and p.true_mm > limit
    ]
    return "\n".join(
        [
            f"{len(layups)} layups of the second family (seeds {layups[0].seed} to {layups[-1].seed}, {pixels}, debulk "
            f"{debulk.__version__}): {len(held)} pockets inside the ply with an excess",
            "",
            f"true ridge at or below the upper end  {len(held) - len(above):4} of {len(held)}",
            f"within the range                      {len(held) - len(above) - len(below):4} of {len(held)}",
            "",
            "above the upper end",
            *([head, *(h.text for h in above)] if above else ["none"]),
            "",
            "below the lower end",
            *([head, *(h.text for h in below)] if below else ["none"]),
            "",
            "these pockets",
            *against(limit, held),
            "",
            "all layups, by their highest true ridge, at the ply's edge as well",
            *against(limit, layups),
            "",
            "CEASE though the truth is above the limit",
            *([*wrong, *passed] or ["none"]),
        ]
    )


def main() -> None:
    """Inspect all layups, print the text, and write it to a file if asked to."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--layups", type=int, default=20)
    parser.add_argument("--seed", type=int, default=91000, help="of the first layup")
    parser.add_argument("--pixels", default="1280x960")
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    width, height = map(int, args.pixels.split("x"))
    layups, held = list[Layup](), list[Held]()
    for seed in range(args.seed, args.seed + args.layups):
        layup, some = looked_at(seed, (width, height))
        layups.append(layup)
        held += some
    said = text(layups, held, args.pixels)
    print(said)
    if args.out:
        args.out.write_text(said + "\n")


if __name__ == "__main__":
    main()
