"""How well probabilities of creasing hold: python bench/risk/risk.py. Writes risk.txt.

Against the referee's members (bench/referee): the share of the excess that one fold gathers is taken from nine tenths
of the pockets, and the Brier score from the last tenth, in turn. Against layups that nothing was fitted to
(held_out.csv): the scatter of the reading is taken from the layups of even seeds, and probabilities are compared with
what was true on those of odd seeds. As few ridges lie at the limit, limits up to 0.1 mm round each ridge are asked.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np
from scipy.stats import norm

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "referee"))

from pockets import LIMIT_EXCESS_MM  # noqa: E402
from truth import Truth, extrapolated_excess, truths  # noqa: E402

from debulk.risk.place import EIGHTHS, FOOT, Place  # noqa: E402

FOOT_MM = FOOT * 0.3
LIMITS_MM = np.array([-0.1, -0.05, -0.03, -0.02, -0.01, -0.005, 0, 0.005, 0.01, 0.02, 0.03, 0.05, 0.1])
MARGIN_MM, NET_SD_MM = 0.02, 0.01  # of the ridge by the referee's rule, and of the excess of its nets as a ridge


def eighths(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the values in the middle of each eighth of the weights."""
    order = np.argsort(values)
    return np.interp(EIGHTHS, (np.cumsum(weights[order]) - 0.5 * weights[order]) / weights.sum(), values[order])


def shares(of: list[Truth]) -> np.ndarray:
    """Return the share of the excess that folds gather; both engines and all pockets have the same weight."""
    groups = [np.array(g) / extrapolated_excess(t) for t in of for g in t.gathered.values() if g]
    weights = np.concatenate([np.full(len(g), 1 / len(g)) for g in groups])
    return eighths(np.concatenate(groups), weights)


def referee() -> list[str]:
    """Compare with the share of the referee's members that crease."""
    inner = [t for t in truths() if not t.at_edge and t.share("both") is not None]
    fold = np.random.default_rng(0).permutation(len(inner)) % 10
    of = np.array([t.share("both") for t in inner])
    excess = np.array([extrapolated_excess(t) for t in inner])
    said = np.zeros(len(inner))
    for k in range(10):
        gathered = shares([t for t, f in zip(inner, fold, strict=True) if f != k])
        here = fold == k
        said[here] = norm.cdf((np.outer(excess[here], gathered) - LIMIT_EXCESS_MM) / 2 / NET_SD_MM).mean(axis=1)
    off = (excess - LIMIT_EXCESS_MM) / 2
    rule = np.where(off > MARGIN_MM, 1.0, np.where(off <= -MARGIN_MM, 0.0, 0.5))
    worst = sorted(zip((rule - of) ** 2, (t.name for t in inner), strict=True))[-2:]
    names, theirs = " and ".join(name for _, name in worst), sum(missed for missed, _ in worst) / len(of)
    return [
        f"The referee's {len(inner)} pockets inside the ply, both engines: Brier {np.mean((rule - of) ** 2):.4f} by "
        f"the rule with its margin (of it {theirs:.4f} by {names}, which share their excess among folds), "
        f"{np.mean((said - of) ** 2):.4f} by the probability (each tenth by the others)",
        f"share of the excess in one fold, by eighths, all pockets: {', '.join(f'{v:.3f}' for v in shares(inner))}",
    ]


def held_out() -> list[str]:
    """Compare with the truth of the second family's layups."""
    with (HERE / "held_out.csv").open(encoding="utf-8", newline="") as file:
        rows = [{k: float(v) for k, v in row.items() if k not in ("kinds", "verdict")} for row in csv.DictReader(file)]
    rows = [row for row in rows if row["length_mm"] > 0.3 and row["true_mm"] > FOOT_MM + 0.07]
    even = np.array([row["seed"] % 2 == 0 for row in rows])
    ratio = np.array([2 * (row["true_mm"] - FOOT_MM) / row["length_mm"] for row in rows])
    reading = eighths(ratio[even], np.ones(even.sum()))
    said, was, ruled = [], [], []
    for row in (row for row, fit in zip(rows, even, strict=True) if not fit):
        sd_mm = Place.sd_of(row["noise_mm"], row["missed_mm"] - max(0.0, row["high_mm"] - row["alone_mm"]))
        for limit in row["length_mm"] / 2 + FOOT_MM + LIMITS_MM:
            said.append(norm.cdf((reading * row["length_mm"] / 2 + FOOT_MM - limit) / sd_mm).mean())
            was.append(float(row["true_mm"] > limit))
            ruled.append(1.0 if row["low_mm"] > limit else 0.0 if row["high_mm"] <= limit else 0.5)
    p, true, rule = np.array(said), np.array(was), np.array(ruled)
    lines = [
        f"Layups of the second family, seeds {int(rows[0]['seed'])} to {int(rows[-1]['seed'])}: {even.sum()} pockets "
        f"to fit, {(~even).sum()} held out, each with {len(LIMITS_MM)} limits round its ridge",
        f"reading of the excess over its truth, by eighths of those fitted: {', '.join(f'{v:.4f}' for v in reading)}",
        f"Brier, held out: {np.mean((rule - true) ** 2):.4f} by the verdicts (UNDECIDED as 0.5), "
        f"{np.mean((p - true) ** 2):.4f} by the probability; UNDECIDED {100 * np.mean(rule == 0.5):.0f} %",
        "", f"{'said':>12}{'number':>9}{'mean said':>11}{'exceeded':>10}",
    ]  # fmt: skip
    tenth = np.minimum((10 * p).astype(int), 9)
    for k in range(10):
        if (here := tenth == k).any():
            range_of = f"{k / 10:.1f} to {k / 10 + 0.1:.1f}"
            lines.append(f"{range_of:>12}{here.sum():9d}{p[here].mean():11.3f}{true[here].mean():10.3f}")
    return lines


def main() -> None:
    """Write the text."""
    said = "\n".join(["PROBABILITIES OF CREASING", "", *referee(), "", *held_out()]) + "\n"
    (HERE / "risk.txt").write_text(said, encoding="utf-8")
    print(said)


if __name__ == "__main__":
    main()
