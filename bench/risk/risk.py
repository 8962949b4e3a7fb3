"""How well probabilities of creasing hold: python bench/risk/risk.py. Writes risk.txt.

Against the referee's members (bench/referee): the share of the excess that one fold gathers is taken from nine tenths
of the pockets, and the Brier score from the last tenth, in turn. Against layups that nothing was fitted to
(held_out.csv): the scatter of the reading is taken from the layups of even seeds, and probabilities are compared with
what was true on those of odd seeds, and the other way round. As few ridges lie at the limit, limits up to 0.1 mm round
each ridge are asked.
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

from debulk.risk import place  # noqa: E402
from debulk.risk.layup import _DRAWN as DRAWN  # noqa: E402

FOOT_MM = place.FOOT * 0.3
LIMITS_MM = np.array([-0.1, -0.05, -0.03, -0.02, -0.01, -0.005, 0, 0.005, 0.01, 0.02, 0.03, 0.05, 0.1])
FRESH = 93000  # seeds from here on were inspected after it was chosen that what joins is drawn evenly
MARGIN_MM, NET_SD_MM = 0.02, 0.01  # of the ridge by the referee's rule, and of the excess of its nets as a ridge


def parts(values: np.ndarray, weights: np.ndarray, count: int) -> np.ndarray:
    """Return the values in the middle of each of so many equal parts of the weights."""
    order = np.argsort(values)
    middles = (np.arange(count) + 0.5) / count
    at = (np.cumsum(weights[order]) - 0.5 * weights[order]) / weights.sum()
    return np.asarray(np.interp(middles, at, values[order]))


def drawn_again(sums: np.ndarray, counts: np.ndarray) -> tuple[float, float]:
    """Return the 95 % interval of the mean if other pockets had come: (N,) sums over each, of so many cases."""
    which = np.random.default_rng(0).integers(len(sums), size=(4000, len(sums)))
    low, high = np.percentile(sums[which].sum(axis=1) / np.maximum(counts[which].sum(axis=1), 1), (2.5, 97.5))
    return float(low), float(high)


def shares(of: list[Truth]) -> np.ndarray:
    """Return the share of the excess that folds gather; both engines and all pockets have the same weight."""
    groups = [np.array(g) / extrapolated_excess(t) for t in of for g in t.gathered.values() if g]
    weights = np.concatenate([np.full(len(g), 1 / len(g)) for g in groups])
    return parts(np.concatenate(groups), weights, 8)


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
    missed = (said - of) ** 2
    low, high = drawn_again(missed, np.ones(len(of)))
    names, theirs = " and ".join(name for _, name in worst), sum(m for m, _ in worst) / len(of)
    theirs_too = sum(m for m, t in zip(missed, inner, strict=True) if t.name in names) / len(of)
    return [
        f"The referee's {len(inner)} pockets inside the ply, both engines: Brier {np.mean((rule - of) ** 2):.4f} by "
        f"the rule with its margin (of it {theirs:.4f} by {names}, which share their excess among folds), "
        f"{missed.mean():.4f} by the probability (each tenth by the others; {theirs_too:.4f} of it by the same two; "
        f"95 % interval if other pockets had come: {low:.3f} to {high:.3f})",
        f"share of the excess in one fold, by eighths, all pockets: {', '.join(f'{v:.3f}' for v in shares(inner))}",
    ]


def held_out() -> list[str]:
    """Compare with the truth of the second family's layups."""
    with (HERE / "held_out.csv").open(encoding="utf-8", newline="") as file:
        rows = [{k: float(v) for k, v in row.items() if k not in ("kinds", "verdict")} for row in csv.DictReader(file)]
    rows = [row for row in rows if row["length_mm"] > 0.3 and row["true_mm"] > FOOT_MM + 0.07]
    even = np.array([row["seed"] % 2 == 0 for row in rows])
    read = np.array([row["length_mm"] / 2 + FOOT_MM for row in rows])
    true_mm = np.array([row["true_mm"] for row in rows])
    missed, more, sd_mm = np.array(
        [place.reading_of(row["noise_mm"], row["missed_mm"], row["high_mm"] - row["alone_mm"]) for row in rows]
    ).T
    # One fold draws what joins evenly between none and all of it: the residual is that from the middle.
    off = (true_mm - read - missed - more / 2) / np.hypot(sd_mm, more / np.sqrt(12))
    said, was, ruled = [], [], []
    for k, row in enumerate(rows):
        others = parts(off[even != even[k]], np.ones((even != even[k]).sum()), 16)
        heights = np.add.outer(read[k] + missed[k] + more[k] * DRAWN, sd_mm[k] * others)
        for limit in read[k] + LIMITS_MM:
            near = norm.cdf((heights - limit) / (place._BETWEEN * sd_mm[k])).mean()
            stray = norm.cdf((heights.mean() - limit) / (place.STRAY_SHARE * row["length_mm"] / 2))
            said.append((1 - place.STRAYS) * near + place.STRAYS * stray)
            was.append(float(row["true_mm"] > limit))
            ruled.append(1.0 if row["low_mm"] > limit else 0.0 if row["high_mm"] <= limit else 0.5)
    p, true, rule = np.array(said), np.array(was), np.array(ruled)
    lines = [
        f"Layups of the second family, seeds {int(rows[0]['seed'])} to {int(rows[-1]['seed'])}: {len(rows)} pockets, "
        f"each with {len(LIMITS_MM)} limits round its ridge; odd and even seeds are held out in turn",
        "true ridge less the one that is read, in standard deviations, by sixteenths of all: "
        f"{', '.join(f'{v:.3f}' for v in parts(off, np.ones(len(off)), 16))}",
        f"Brier, held out: {np.mean((rule - true) ** 2):.4f} by the verdicts (UNDECIDED as 0.5), "
        f"{np.mean((p - true) ** 2):.4f} by the probability; UNDECIDED {100 * np.mean(rule == 0.5):.0f} %",
        "", f"{'said':>12}{'number':>9}{'pockets':>9}{'mean said':>11}{'exceeded':>10}{'less what was said':>20}",
    ]  # fmt: skip
    tenth = np.minimum((10 * p).astype(int), 9)
    by_pocket = (len(rows), len(LIMITS_MM))
    fresh = np.repeat([row["seed"] >= FRESH for row in rows], len(LIMITS_MM))
    apart, theirs = (100 * sum(abs((p - true)[here & (tenth == k)].sum()) for k in range(10)) / here.sum()
                     for here in (fresh | True, fresh))  # fmt: skip
    lines.insert(3, f"said less what came true, in the mean over the tenths below: {apart:.1f} points")
    lines.insert(4, f"of the {fresh.sum() // len(LIMITS_MM)} pockets of seeds from {FRESH} on, made after the rule: "
                    f"Brier {np.mean((p - true)[fresh] ** 2):.4f}, {theirs:.1f} points")  # fmt: skip
    for k in range(10):
        if (here := tenth == k).any():
            range_of = f"{k / 10:.1f} to {k / 10 + 0.1:.1f}"
            counts = here.reshape(by_pocket).sum(axis=1)
            low, high = drawn_again(np.where(here, true - p, 0.0).reshape(by_pocket).sum(axis=1), counts)
            lines.append(
                f"{range_of:>12}{here.sum():9d}{(counts > 0).sum():9d}{p[here].mean():11.3f}{true[here].mean():10.3f}"
                f"{f'{low:+.3f} to {high:+.3f}':>20}"
            )
    return [
        *lines,
        "",
        "less what was said: 95 % interval if other pockets had come; limits of one pocket are not independent",
    ]


def main() -> None:
    """Write the text."""
    said = "\n".join(["PROBABILITIES OF CREASING", "", *referee(), "", *held_out()]) + "\n"
    (HERE / "risk.txt").write_text(said, encoding="utf-8")
    print(said)


if __name__ == "__main__":
    main()
