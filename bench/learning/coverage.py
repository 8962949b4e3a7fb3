"""Recovers hidden limits from virtual outcomes, and counts how often the stated intervals hold them.

    python bench/learning/coverage.py --out bench/learning/coverage.txt

Each repetition hides a limit between 0.40 and 0.90 mm and a spread between 0.03 and 0.08 mm, draws ridges between 0.2
and 1.1 mm with a noise of 0.005 mm, and lets each crease where it exceeds its own pocket's limit. Those limits scatter
by the logistic law of the model, or by a normal or uniform one, which the model does not know.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np

from debulk import InputError
from debulk.learning import Outcomes, pod, posterior
from debulk.learning.calibration import Costs, cost_limit_mm

NOISE_MM = 0.005
LAWS = {
    "logistic": lambda rng, n: rng.logistic(0, math.sqrt(3) / math.pi, n),
    "normal": lambda rng, n: rng.normal(0, 1, n),
    "uniform": lambda rng, n: rng.uniform(-math.sqrt(3), math.sqrt(3), n),
}


def virtual(rng: np.random.Generator, law: str, count: int) -> tuple[float, float, Outcomes]:
    """Hide a limit and a spread, and let pockets crease."""
    limit, spread = rng.uniform(0.4, 0.9), rng.uniform(0.03, 0.08)
    ridge = rng.uniform(0.2, 1.1, count)
    creased = ridge > limit + spread * LAWS[law](rng, count)
    return limit, spread, Outcomes(ridge + NOISE_MM * rng.normal(size=count), np.full(count, NOISE_MM), creased)


def recovered(law: str, count: int, repetitions: int, seed: int = 1) -> dict[str, float]:
    """Count how often limit and spread lie in their intervals, and how near the limit comes."""
    rng = np.random.default_rng(seed)
    rows = []
    for _ in range(repetitions):
        limit, spread, known = virtual(rng, law, count)
        found = posterior(known)
        (low, high), (first, last) = found.interval_mm(), found.spread_interval_mm()
        rows.append((found.limit_mm - limit, low <= limit <= high, first <= spread <= last, high - low))
    error, holds, holds_spread, width = np.array(rows, dtype=float).T
    return {
        "within": int((np.abs(error) <= 0.05).sum()),
        "sd": float(error.std()),
        "bias": float(error.mean()),
        "holds": int(holds.sum()),
        "holds_spread": int(holds_spread.sum()),
        "width": float(width.mean()),
    }


def detected(count: int, repetitions: int, seed: int = 2) -> tuple[int, int, float, float, float]:
    """Count how often a90/95 is above the true a90, and how often no curve could be fitted; and the sizes."""
    rng, b0, b1 = np.random.default_rng(seed), 4.0, 7.0
    true = math.exp((math.log(9) - b0) / b1)
    found, refused = [], 0
    for _ in range(repetitions):
        size = rng.uniform(0.2, 1.4, count)
        hit = rng.random(count) < 1 / (1 + np.exp(-(b0 + b1 * np.log(size))))
        try:
            curve = pod(size, hit)
            found.append((curve.a90_mm, curve.a90_95_mm))
        except InputError:
            refused += 1
    a90, bound = np.array(found).T
    return int((bound >= true).sum()), refused, true, float(np.median(a90)), float(np.median(bound))


def regret(count: int, repetitions: int, seed: int = 3) -> tuple[float, float, float]:
    """Return the cost per pocket of the proposed limit, of the best limit of all, and of 0.60 mm."""
    rng, costs, total = np.random.default_rng(seed), Costs(), np.zeros(3)
    tried = np.linspace(0.2, 1.1, 181)
    for _ in range(repetitions):
        limit, spread, known = virtual(rng, "logistic", count)
        ridge = rng.uniform(0.2, 1.1, 20_000)
        creased = ridge > limit + spread * LAWS["logistic"](rng, len(ridge))

        def cost(at, ridge=ridge, creased=creased):
            passed = ridge <= at
            return (costs.missed * (passed & creased).sum() + costs.needless * (~passed & ~creased).sum()) / len(ridge)

        total += [cost(cost_limit_mm(posterior(known), costs)), min(cost(at) for at in tried), cost(0.60)]
    return tuple(total / repetitions)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repetitions", type=int, default=200)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    n = given.repetitions
    lines = [f"{n} repetitions each"]
    for law in LAWS:
        for count in (30, 60, 120):
            r = recovered(law, count, n)
            lines.append(
                f"{law:>8}, {count:3} outcomes: limit within 0.05 mm {r['within']}, error {r['bias']:+.3f} ± "
                f"{r['sd']:.3f} mm; in the 95 % interval {r['holds']} (mean width {r['width']:.3f} mm); spread in its "
                f"interval {r['holds_spread']}"
            )
    for count in (60, 120, 240):
        above, refused, true, a90, bound = detected(count, n)
        lines.append(
            f"POD, {count} sizes: a90/95 at or above the true a90 of {true:.3f} mm {above} of {n - refused} "
            f"({refused} refused: no overlap); medians: a90 {a90:.3f}, a90/95 {bound:.3f} mm"
        )
    own, best, present = regret(60, max(1, n // 4))
    lines.append(
        f"cost per pocket, missed 20 and needless 1, 60 outcomes, {max(1, n // 4)} hidden limits: proposed limit "
        f"{own:.3f}, the best limit of all {best:.3f}, 0.60 mm {present:.3f}"
    )
    text = "\n".join(lines) + "\n"
    print(text, end="")
    if given.out:
        given.out.write_text(text)


if __name__ == "__main__":
    main()
