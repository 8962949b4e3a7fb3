"""The effect of a second scan: python bench/study/scans.py [--layups 110 119] [--repeats 3] [--out bench/study].

Each virtual layup is scanned several times: the same ply before the same scanner, with other noise, flying points and
drop-outs. A verdict is only as reliable as two scans agree on it. Writes scans.txt and scans.csv.
"""

from __future__ import annotations

import argparse
import itertools
import time
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from debulk import Inspector, scenes
from debulk.recipe import Recipe
from debulk.results.report import PocketReport
from lab.study import Plan
from lab.study.summary import write_csv

PAPER = {"criterion": "paper"}
RULES: dict[str, dict[str, dict[str, Any]]] = {
    "the recipe": {},
    "paper": {"verdict": PAPER},
    "paper, 1 start": {"solve": {"starts": 1, "most_starts": 1}, "verdict": PAPER},
}
DECIDED = ("cease", "crease")
NEAR_MM = 40.0  # the ply's edge cuts off up to half of a bump, which moves the middle of its outline
NOWHERE = -1


@dataclass
class Seen:
    """A pocket in a scan."""

    rule: str
    layup: int
    repeat: int
    pocket: int  # number of the nearest true bump, because numbers by area may swap from scan to scan
    verdict: str
    rms_mm: float
    ridge_mm: float
    starts: int
    seconds: float  # of the whole inspection
    excess_mm: float = np.nan  # the ridge by the excess; only for a pocket inside the ply


def scan_all(layups: range, repeats: int, pixels: tuple[int, int]) -> list[Seen]:
    """Inspect every scan by every rule."""
    seen = []
    for seed in layups:
        scans = [scenes.layup(seed, pixels, repeat=k) for k in range(repeats)]
        first = scans[0]
        prepared = None
        for rule, changed in RULES.items():
            recipe = Recipe().model_copy(update=changed)
            inspector = Inspector(
                recipe, prepared or first.reference, first.ply_outline, mold_from_scanner=first.mold_from_scanner
            )
            prepared = inspector.prepared
            for repeat, layup in enumerate(scans):
                began = time.perf_counter()
                report = inspector.inspect(layup.scan)
                seconds = time.perf_counter() - began
                for p in report.pockets:
                    if p.solve is not None and p.rms_mm is not None and p.ridge_height_mm is not None:
                        seen.append(
                            Seen(rule, seed, repeat, _bump(layup, p), p.verdict.value, p.rms_mm, p.ridge_height_mm,
                                 p.solve.starts, seconds, p.excess.height_mm if p.excess else np.nan)
                        )  # fmt: skip
    return seen


def _bump(layup: scenes.Layup, p: PocketReport) -> int:
    """Return the number of the true bump, pocket or decoy, whose top is nearest to the middle of a pocket's outline."""
    tops = np.array([bump.centre_mm for bump in (*layup.truth.pockets, *layup.truth.decoys)])
    away_mm = np.hypot(*(tops - p.outline_mm.mean(axis=0)).T)
    return int(np.argmin(away_mm)) if away_mm.min() < NEAR_MM else NOWHERE


def table(seen: list[Seen], layups: int, repeats: int) -> str:
    """Return the results as text."""
    about = (
        f"{layups} virtual layups, {repeats} scans of each: the same ply and scanner, other noise, flying points and "
        "drop-outs. Pairs: of scans of one pocket. Opposite: CEASE in one, CREASE in the other. Differ: any other "
        "difference. RMS, ridge and excess differ: mean absolute difference in a pair, mm, of the RMS and the ridge of "
        "the minimum, and of the ridge by the excess of pockets inside the ply."
    )
    head = f"  {'rule':<30} {'pockets':>7} {'starts':>6} {'UNDECIDED':>9} {'pairs':>6} {'opposite':>8} {'differ':>7}"
    lines = [
        "WHAT A SECOND SCAN CHANGES",
        "",
        fill(about, 110),
        "",
        head + f" {'RMS differ':>10} {'ridge differ':>12} {'excess differ':>13}",
    ]
    for rule in RULES:
        mine = [s for s in seen if s.rule == rule and s.pocket != NOWHERE]
        if not mine:
            continue
        pockets: dict[tuple[int, int], list[Seen]] = {}
        for s in mine:
            pockets.setdefault((s.layup, s.pocket), []).append(s)
        pairs = [pair for of in pockets.values() for pair in itertools.combinations(of, 2)]
        opposite = [a.verdict in DECIDED and b.verdict in DECIDED and a.verdict != b.verdict for a, b in pairs]
        differ = [a.verdict != b.verdict for a, b in pairs]
        rms, ridge, excess = (
            np.array([abs(getattr(a, n) - getattr(b, n)) for a, b in pairs])
            for n in ("rms_mm", "ridge_mm", "excess_mm")
        )
        excess = excess[np.isfinite(excess)]
        lines.append(
            f"  {rule:<30} {len(pockets):>7} {np.mean([s.starts for s in mine]):>6.1f} "
            f"{np.mean([s.verdict == 'undecided' for s in mine]):>9.1%} {len(pairs):>6} {np.mean(opposite):>8.2%} "
            f"{np.mean(differ) - np.mean(opposite):>7.2%} {np.mean(rms):>10.4f} "
            f"{np.mean(ridge):>12.3f} " + (f"{np.mean(excess):>13.4f}" if excess.size else f"{'–':>13}")
        )
    for s in seen:
        if s.pocket == NOWHERE and s.rule == next(iter(RULES)):
            lines.append(f"  where no bump is, scan {s.repeat} of layup {s.layup}: {s.verdict.upper()}, by {s.rule}")
    return "\n".join(lines) + "\n"


def main(arguments: list[str] | None = None) -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--layups", type=int, nargs=2, default=(110, 119), help="first and last seed")
    parser.add_argument("--repeats", type=int, default=3, help="scans of each")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder")
    options = parser.parse_args(arguments)
    layups = range(options.layups[0], options.layups[1] + 1)
    seen = scan_all(layups, options.repeats, Plan().pixels)
    options.out.mkdir(parents=True, exist_ok=True)
    text = table(seen, len(layups), options.repeats)
    (options.out / "scans.txt").write_text(text, encoding="utf-8")
    write_csv(options.out / "scans.csv", seen)
    print(text)


if __name__ == "__main__":
    main()
