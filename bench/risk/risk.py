"""How well probabilities of creasing hold: python bench/risk/risk.py. Writes risk.txt.

Against the referee's members (bench/referee): the share of the excess that one fold gathers is taken from nine tenths
of the pockets, and the Brier score from the last tenth, in turn. Against layups that nothing was fitted to
(held_out.csv): the scatter of the reading is taken from the layups of even seeds, and probabilities are compared with
what was true on those of odd seeds, and the other way round; fresh layups are compared with the scatter of all before.
As few ridges lie at the limit, limits up to 0.1 mm round each ridge are asked.
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
FRESH = 97000  # seeds from here on were inspected after the residuals were taken and all was chosen
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


def probabilities(read_mm: float, length_mm: float, missed: tuple[float, float], residuals: np.ndarray) -> np.ndarray:
    """Return the probability that a ridge exceeds each of LIMITS_MM round it, if one fold gathers all of the excess.

    `missed` is what joins it and its standard deviation, as `place.reading_of` returns them.
    """
    more_mm, sd_mm = missed
    heights = np.add.outer(read_mm + more_mm * DRAWN, sd_mm * residuals).ravel()
    limits = read_mm + LIMITS_MM
    near = norm.cdf(np.subtract.outer(heights, limits) / (place._BETWEEN * sd_mm)).mean(axis=0)
    stray = norm.cdf((heights.mean() - limits) / (place.STRAY_SHARE * length_mm / 2))
    return np.asarray((1 - place.STRAYS) * near + place.STRAYS * stray)


def apart(p: np.ndarray, true: np.ndarray) -> str:
    """Return Brier score and what was said less what came true, in the mean over the tenths; (N, limits) of pockets."""
    tenth = np.minimum((10 * p).astype(int), 9)
    points = 100 * sum(abs((p - true)[tenth == k].sum()) for k in range(10)) / p.size
    return f"{len(p)} pockets: Brier {np.mean((p - true) ** 2):.4f}, {points:.1f} points"


def tenths(p: np.ndarray, true: np.ndarray) -> list[str]:
    """Return the table of what was said and what came true; (N, limits) of pockets."""
    out = [f"{'said':>12}{'number':>9}{'pockets':>9}{'mean said':>11}{'exceeded':>10}{'less what was said':>20}"]
    for k in range(10):
        if (here := np.minimum((10 * p).astype(int), 9) == k).any():
            counts = here.sum(axis=1)
            low, high = drawn_again(np.where(here, true - p, 0.0).sum(axis=1), counts)
            out.append(
                f"{f'{k / 10:.1f} to {k / 10 + 0.1:.1f}':>12}{here.sum():9d}{(counts > 0).sum():9d}"
                f"{p[here].mean():11.3f}{true[here].mean():10.3f}{f'{low:+.3f} to {high:+.3f}':>20}"
            )
    return out


def held_out() -> list[str]:
    """Compare with the truth of the second family's layups."""
    with (HERE / "held_out.csv").open(encoding="utf-8", newline="") as file:
        rows = [{k: float(v) for k, v in row.items() if k not in ("kinds", "verdict")} for row in csv.DictReader(file)]
    rows = [row for row in rows if row["length_mm"] > 0.3 and row["true_mm"] > FOOT_MM + 0.07]
    seed, length, true_mm, low_mm, high_mm = (
        np.array([row[name] for row in rows]) for name in ("seed", "length_mm", "true_mm", "low_mm", "high_mm")
    )
    read, even, fresh = length / 2 + FOOT_MM, seed % 2 == 0, seed >= FRESH
    more, sd_mm = missed = np.array(
        [place.reading_of(row["noise_mm"], row["missed_mm"], row["high_mm"] - row["alone_mm"]) for row in rows]
    ).T
    # One fold draws what joins evenly between none and all of it: the residual is that from the middle.
    off = (true_mm - read - more / 2) / np.hypot(sd_mm, more / np.sqrt(12))
    p = np.empty((len(rows), len(LIMITS_MM)))
    for k in range(len(rows)):
        others = ~fresh & (even != even[k]) if not fresh[k] else ~fresh
        residuals = parts(off[others], np.ones(others.sum()), 16)
        p[k] = probabilities(read[k], length[k], (missed[0, k], missed[1, k]), residuals)
    limits = read[:, None] + LIMITS_MM
    true = (true_mm[:, None] > limits).astype(float)
    rule = np.where(low_mm[:, None] > limits, 1.0, np.where(high_mm[:, None] <= limits, 0.0, 0.5))
    return [
        f"Layups of the second family, {len(rows)} pockets, each with {len(LIMITS_MM)} limits round its ridge; odd and "
        f"even seeds below {FRESH} are held out in turn, those from there on were inspected after all was chosen",
        "true ridge less the one that is read, in standard deviations, by sixteenths of all before: "
        f"{', '.join(f'{v:.3f}' for v in parts(off[~fresh], np.ones((~fresh).sum()), 16))}",
        f"Brier, held out: {np.mean((rule - true) ** 2):.4f} by the verdicts (UNDECIDED as 0.5), "
        f"{np.mean((p - true) ** 2):.4f} by the probability; UNDECIDED {100 * np.mean(rule == 0.5):.0f} %",
        f"said less what came true, in the mean over the tenths, before: {apart(p[~fresh], true[~fresh])}",
        f"fresh: {apart(p[fresh], true[fresh])}",
        *(line for title, some in (("all", fresh | True), ("fresh", fresh))
          for line in ("", title, *tenths(p[some], true[some]))),
        "",
        "less what was said: 95 % interval if other pockets had come; limits of one pocket are not independent",
    ]  # fmt: skip


def main() -> None:
    """Write the text."""
    said = "\n".join(["PROBABILITIES OF CREASING", "", *referee(), "", *held_out()]) + "\n"
    (HERE / "risk.txt").write_text(said, encoding="utf-8")
    print(said)


if __name__ == "__main__":
    main()
