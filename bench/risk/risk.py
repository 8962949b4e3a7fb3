"""How well probabilities of creasing hold: python bench/risk/risk.py. Writes risk.txt.

Two laws are measured: how far the ridge that is read lies from the true one (held_out.csv), and which share of the
excess one fold gathers (the members of bench/referee, and the fine nets of the open benchmark, bench/open/pockets.csv).
Four families of shapes made the readings, and each is asked by the laws of the others: nothing is fitted to what is
asked. As few ridges lie at the limit, limits up to 0.1 mm round each ridge are asked. `by chance` is what a forecaster
who knows all would differ by, with so many pockets.
"""

from __future__ import annotations

import csv
import math
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import norm

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "referee"))

from pockets import LIMIT_EXCESS_MM  # noqa: E402
from truth import Truth, extrapolated_excess, ridge, truths  # noqa: E402

from debulk.risk import place  # noqa: E402
from debulk.risk.layup import _DRAWN as DRAWN  # noqa: E402

Floats = np.ndarray
LIMITS_MM = np.array([-0.1, -0.05, -0.03, -0.02, -0.01, -0.005, 0, 0.005, 0.01, 0.02, 0.03, 0.05, 0.1])
BENCHMARK = 200  # scenes of the open benchmark; nets were laid for these
LEAST_MM = 0.3  # of excess: what is less makes no ridge
SAME_MM = 1e-3  # of excess, within which all fibres over a foot are held if the largest is
MARGIN_MM, NET_SD_MM = 0.02, 0.01  # of the ridge by the referee's rule, and of the excess of its nets as a ridge
DRAWS = 2000


@dataclass(frozen=True, eq=False)
class Pocket:
    """A pocket as it is read, and as it is."""

    family: str
    scene: int
    read_mm: float
    length_mm: float
    more_mm: float
    sd_mm: float
    """`more_mm`, `sd_mm`: what joins it, and its standard deviation (`place.reading_of`)."""
    thickness_mm: float
    true_mm: float
    """Its ridge, if one fold gathers all of the excess."""
    folds_mm: Floats
    """Ridges of its worst fold, by the members that judged it; none: it was not asked."""
    verdict: Floats
    """1 CREASE, 0 CEASE, 0.5 UNDECIDED, for each limit round its ridge, (L,)."""

    @property
    def limits_mm(self) -> Floats:
        """Limits round its ridge, (L,)."""
        return self.read_mm + LIMITS_MM

    @property
    def residual(self) -> float:
        """The true ridge less the one that is read, in standard deviations; one fold draws half of what joins."""
        off_mm = self.true_mm - self.read_mm - self.more_mm / 2
        return off_mm / math.hypot(self.sd_mm, self.more_mm / math.sqrt(12))


def rows(path: Path) -> list[dict[str, str]]:
    """Return the rows of a table."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def pockets() -> list[Pocket]:
    """Return the pockets whose true ridge is beyond question."""
    nets = {(int(row["scene"]), row["pocket"]): row for row in rows(HERE.parent / "open" / "pockets.csv")}
    found = []
    for row in rows(HERE / "held_out.csv"):
        names = ("length_mm", "held_mm", "any_mm", "noise_mm", "missed_mm", "low_mm", "high_mm", "alone_mm")
        length, held, largest, noise, missed, low, high, alone = (float(row[name]) for name in names)
        thickness = float(row["thickness_mm"])
        if min(length, held) < LEAST_MM or largest - held > SAME_MM:
            continue
        foot, scene = place.FOOT * thickness, int(row["seed"])
        read = length / 2 + foot
        limits = read + LIMITS_MM
        net = nets.get((scene, row["pocket"])) if row["family"] != "second" else None
        more, sd = place.reading_of(noise, missed, high - alone)
        rule = np.where(low > limits, 1.0, np.where(high <= limits, 0.0, 0.5))
        folds = np.array(gathered(net)) / 2 + foot if net else np.zeros(0)
        found.append(Pocket(row["family"], scene, read, length, more, sd, thickness, held / 2 + foot, folds, rule))
    return found


def gathered(net: dict[str, str]) -> list[float]:
    """Return the excess that the worst fold gathers by each member of the open benchmark."""
    names = ("gathered_low_mm", "gathered_high_mm", "finer_mm", "mujoco_mm")
    return [float(net[name]) for name in names if net[name]]


def parts(values: Floats, weights: Floats, count: int) -> Floats:
    """Return the values in the middle of each of so many equal parts of the weights."""
    order = np.argsort(values)
    middles = (np.arange(count) + 0.5) / count
    at = (np.cumsum(weights[order]) - 0.5 * weights[order]) / weights.sum()
    return np.asarray(np.interp(middles, at, values[order]))


def evenly(groups: Iterable[Sequence[float] | Floats], count: int) -> Floats:
    """Return the parts of all values; each group has the same weight."""
    some = [np.asarray(group) for group in groups if len(group)]
    return parts(np.concatenate(some), np.concatenate([np.full(len(g), 1 / len(g)) for g in some]), count)


def residuals(of: list[Pocket]) -> Floats:
    """Return how far readings are off; each family has the same weight."""
    return evenly(([p.residual for p in of if p.family == f] for f in {p.family for p in of}), 16)


def shares(of: list[Truth], nets: list[Pocket]) -> Floats:
    """Return the share of the excess that folds gather; each engine of a pocket has the same weight."""
    groups = [np.array(g) / extrapolated_excess(t) for t in of for g in t.gathered.values() if g]
    for p in nets:
        if len(p.folds_mm):
            foot = place.FOOT * p.thickness_mm
            groups.append((p.folds_mm - foot) / (p.true_mm - foot))
    return evenly(groups, 8)


def said_of(p: Pocket, law: Floats, gathers: Floats, limits: Floats) -> Floats:
    """Return the probability that a ridge exceeds each limit, as `debulk.risk.risk` does."""
    foot = place.FOOT * p.thickness_mm
    whole = np.add.outer(p.length_mm / 2 + p.more_mm * DRAWN, p.sd_mm * law).ravel()
    heights = np.outer(gathers, whole).ravel() + foot
    near_mm = place._BETWEEN * p.sd_mm
    near = norm.cdf(np.subtract.outer(heights, limits) / near_mm).mean(axis=0)
    far = norm.cdf((heights.mean() - limits) / np.hypot(near_mm, place.STRAY_SHARE * p.length_mm / 2))
    return np.asarray((1 - place.STRAYS) * near + place.STRAYS * far)


def tenth_of(p: Floats) -> Floats:
    """Return the tenths in which probabilities lie."""
    return np.asarray(np.minimum((10 * p).astype(int), 9))


def less(p: Floats, true: Floats) -> tuple[Floats, Floats]:
    """Return the sum of what came true less what was said in each tenth, and its cases."""
    tenth = tenth_of(p)
    return np.array([(true - p)[tenth == k].sum() for k in range(10)]), np.bincount(tenth.ravel(), minlength=10)


def chance(p: Floats) -> tuple[Floats, Floats]:
    """Return what a perfect forecaster differs by: (10,) in the mean of each tenth, and (DRAWS,) over all tenths.

    The limits of one pocket have one truth: its ridge is drawn once.
    """
    rng = np.random.default_rng(0)
    found = [less(p, rng.random((len(p), 1)) < p) for _ in range(DRAWS)]
    off = np.array([np.abs(sums) for sums, _ in found])
    counts = np.maximum(found[0][1], 1)
    return off.mean(axis=0) / counts, off.sum(axis=1) / p.size


def drawn_again(sums: Floats, counts: Floats) -> tuple[float, float]:
    """Return the 95 % interval of the mean if other pockets had come: (N,) sums over each, of so many cases."""
    which = np.random.default_rng(0).integers(len(sums), size=(4000, len(sums)))
    low, high = np.percentile(sums[which].sum(axis=1) / np.maximum(counts[which].sum(axis=1), 1), (2.5, 97.5))
    return float(low), float(high)


def apart(p: Floats, true: Floats) -> str:
    """Return Brier score and what was said less what came true, in the mean over the tenths; (N, limits) of pockets."""
    _, of_chance = chance(p)
    points = 100 * np.abs(less(p, true)[0]).sum() / p.size
    return (
        f"{len(p)} pockets: Brier {np.mean((p - true) ** 2):.4f}, {points:.1f} points "
        f"(by chance {100 * of_chance.mean():.1f}, at most {100 * np.percentile(of_chance, 95):.1f} in 95 %)"
    )


def table(p: Floats, true: Floats) -> list[str]:
    """Return what was said and what came true by tenths; (N, limits) of pockets."""
    head = ("said", "cases", "pockets", "mean said", "came true", "less what was said", "by chance")
    out = ["".join(f"{cell:>{width}}" for cell, width in zip(head, (12, 7, 9, 11, 11, 20, 11), strict=True))]
    by_chance, _ = chance(p)
    for k in range(10):
        if (here := tenth_of(p) == k).any():
            counts = here.sum(axis=1)
            low, high = drawn_again(np.where(here, true - p, 0.0).sum(axis=1), counts)
            out.append(
                f"{f'{k / 10:.1f} to {k / 10 + 0.1:.1f}':>12}{here.sum():7d}{(counts > 0).sum():9d}"
                f"{p[here].mean():11.3f}{true[here].mean():11.3f}{f'{low:+.3f} to {high:+.3f}':>20}{by_chance[k]:11.3f}"
            )
    return out


def referee(inner: list[Truth], nets: list[Pocket]) -> str:
    """Compare with the share of the referee's members that crease."""
    fold = np.random.default_rng(0).permutation(len(inner)) % 10
    of = np.array([t.share("both") for t in inner])
    excess = np.array([extrapolated_excess(t) for t in inner])
    said = np.zeros(len(inner))
    for k in range(10):
        law = shares([t for t, f in zip(inner, fold, strict=True) if f != k], nets)
        here = fold == k
        said[here] = norm.cdf((np.outer(excess[here], law) - LIMIT_EXCESS_MM) / 2 / NET_SD_MM).mean(axis=1)
    off = (excess - LIMIT_EXCESS_MM) / 2
    rule = np.where(off > MARGIN_MM, 1.0, np.where(off <= -MARGIN_MM, 0.0, 0.5))
    worst = np.argsort((rule - of) ** 2)[-2:]
    missed = (said - of) ** 2
    low, high = drawn_again(missed, np.ones(len(of)))
    return (
        f"The referee's {len(inner)} pockets inside the ply, both engines: Brier {np.mean((rule - of) ** 2):.4f} by "
        f"the rule with its margin, {missed.mean():.4f} by the probability, each tenth by the others (95 % interval if "
        f"other pockets had come: {low:.3f} to {high:.3f}; {(said * (1 - said)).mean():.4f} if what is said holds); "
        f"{missed[worst].sum() / len(of):.4f} of it by {' and '.join(inner[k].name for k in worst)}, which share their "
        "excess among folds"
    )


def benchmark(judged: list[Pocket], laws: dict[str, Floats], gathers: dict[str, Floats]) -> str:
    """Compare with the folds of the open benchmark's nets at its limit; what is not read has less than it by far."""
    count = len(rows(HERE.parent / "open" / "pockets.csv"))
    limit = np.array([ridge(LIMIT_EXCESS_MM)])
    said = np.array([said_of(p, laws[p.family], gathers[p.family], limit)[0] for p in judged])
    missed = (said - [(p.folds_mm > limit).mean() for p in judged]) ** 2
    low, high = drawn_again(np.pad(missed, (0, count - len(judged))), np.ones(count))
    return (
        f"The open benchmark's {count} pockets, folds of the nets, by the laws of the other families: Brier "
        f"{missed.sum() / count:.4f} ({low:.3f} to {high:.3f}; {(said * (1 - said)).sum() / count:.4f} if what is said "
        "holds)"
    )


def main() -> None:
    """Write the text."""
    known = pockets()
    inner = [t for t in truths() if not t.at_edge and t.share("both") is not None]
    families = sorted({p.family for p in known})
    laws = {f: residuals([p for p in known if p.family != f]) for f in families}
    gathers = {f: shares(inner, [p for p in known if p.family != f]) for f in families}
    whole = np.array([said_of(p, laws[p.family], np.ones(1), p.limits_mm) for p in known])
    true = np.array([p.true_mm > p.limits_mm for p in known], dtype=float)
    of_open = np.array([p.family != "second" and p.scene < BENCHMARK for p in known])
    judged = [p for p in known if len(p.folds_mm)]
    folds = np.array([said_of(p, laws[p.family], gathers[p.family], p.limits_mm) for p in judged])
    fold_true = np.array([(p.folds_mm[:, None] > p.limits_mm).mean(axis=0) for p in judged])
    rule = np.array([p.verdict for p in known])
    number = ", ".join(f"{f} {sum(p.family == f for p in known)}" for f in families)
    lines = [
        "PROBABILITIES OF CREASING", "", referee(inner, judged), benchmark(judged, laws, gathers), "",
        f"share of the excess in one fold, by eighths, of all: {listed(shares(inner, judged))}",
        "true ridge less the one that is read, in standard deviations, by sixteenths, of all: "
        f"{listed(residuals(known))}",
        "", f"Pockets, each with {len(LIMITS_MM)} limits round its ridge, by the laws of the other families: {number}",
        f"their verdicts (UNDECIDED as 0.5): Brier {np.mean((rule - true) ** 2):.4f}; UNDECIDED "
        f"{100 * np.mean(rule == 0.5):.0f} %",
        "", f"does the worst fold of the nets exceed the limit: {apart(folds, fold_true)}", *table(folds, fold_true),
        "", f"does the ridge of the whole excess exceed it: {apart(whole, true)}",
        f"the pockets of the open benchmark among them: {apart(whole[of_open], true[of_open])}", *table(whole, true),
        "", "less what was said: 95 % interval if other pockets had come; limits of one pocket are not independent",
    ]  # fmt: skip
    text = "\n".join(lines) + "\n"
    (HERE / "risk.txt").write_text(text, encoding="utf-8")
    print(text)


def listed(values: Floats) -> str:
    """Return figures as text."""
    return ", ".join(f"{v:.3f}" for v in values)


if __name__ == "__main__":
    main()
