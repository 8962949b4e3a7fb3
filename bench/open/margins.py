"""The range of the excess against the true ridge, and what leaves pockets UNDECIDED: python bench/open/margins.py.

[--folder build/open] [--out FILE]. For the pockets of the open benchmark with 0.75 to 1.35 of the limit's excess: lower
end, estimate and upper end of the ridge by the excess less the true ridge, which is that of the excess by quadrature
(`pockets.csv`). Then the UNDECIDED pockets, by what takes most of their range from the estimate to its end beyond the
limit. `contenders.py --only clouds` makes the clouds.
"""

from __future__ import annotations

import argparse
import csv
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from open_scenes import LIMIT_MM

import debulk
from debulk.results.report import PocketReport

HERE = Path(__file__).parent
NEAR = (0.75, 1.35)  # of the limit's excess


@dataclass(frozen=True)
class Read:
    """A pocket as it was read, with its true ridge, and the excess that makes it, in that of the limit."""

    shape: str
    pocket: PocketReport
    true_mm: float
    of_limit: float

    @property
    def errors_mm(self) -> tuple[float, float, float]:
        """Return lower end, estimate and upper end less the true ridge."""
        known = self.pocket.excess
        assert known is not None
        low, high = known.range_mm
        return low - self.true_mm, known.height_mm - self.true_mm, high - self.true_mm


def read(folder: Path, truths: list[dict[str, str]]) -> Iterator[Read]:
    """Inspect all scenes, and yield the worst pocket of the report at each place that has one with an excess."""
    for number in sorted({row["scene"] for row in truths}, key=int):
        with np.load(folder / f"{int(number):03d}.npz") as given:
            thickness_mm = float(given["thickness_mm"])
            names = ("outline_mm", "fibre_deg", "mold_from_scanner")
            recipe = debulk.Recipe(material={"thickness_mm": thickness_mm})
            report = debulk.inspect(given["scan"], given["reference"], recipe, *(given[name] for name in names))
        for row in (row for row in truths if row["scene"] == number):
            place, radius = np.array([float(row["x_mm"]), float(row["y_mm"])]), float(row["radius_mm"])
            near = [p for p in report.pockets if np.hypot(*(p.outline_mm.mean(axis=0) - place)) <= radius and p.excess]
            if near:
                excess_mm, limit_mm = float(row["excess_mm"]), float(row["limit_excess_mm"])
                true_mm = excess_mm / 2 + (2 - np.pi / 2) * thickness_mm
                yield Read(row["kind"], max(near, key=lambda p: p.verdict), true_mm, excess_mm / limit_mm)


def cause(p: PocketReport) -> tuple[str, float]:
    """Return what takes most of a range from its estimate to its end beyond the limit, and how much it takes, mm."""
    known = p.excess
    assert known is not None
    low, high = known.range_mm
    if known.height_mm > LIMIT_MM:
        shares = {"share of one fold, and filters": known.height_mm - low - known.uncertainty_mm}
    else:
        shares = {
            "filters, upper end": known.alone_mm - known.height_mm - known.uncertainty_mm,
            "one fold over several places": high - known.alone_mm,
        }
    shares["noise and reading"] = known.uncertainty_mm
    return max(shares.items(), key=lambda one: one[1])


def table(found: list[Read], pockets: int) -> str:
    """Return all tables."""
    by_shape, by_cause = defaultdict[str, list[Read]](list), defaultdict[str, list[tuple[float, float]]](list)
    for one in found:
        if NEAR[0] < one.of_limit < NEAR[1]:
            by_shape[one.shape].append(one)
        if one.pocket.verdict is debulk.Verdict.UNDECIDED:
            why, takes_mm = cause(one.pocket)
            by_cause[why].append((takes_mm, abs(one.errors_mm[1])))
    lines = [
        f"Pockets with {NEAR[0]} to {NEAR[1]} of the limit's excess, open benchmark, debulk {debulk.__version__}:",
        "ridge by the excess less the true ridge, mm: median (least, most)",
        "",
        f"{'shape':14}{'pockets':>8}{'lower end':>27}{'estimate':>27}{'upper end':>27}",
    ]
    every = [one for some in by_shape.values() for one in some]
    for shape, some in [*sorted(by_shape.items()), ("all", every)]:
        errors = np.array([one.errors_mm for one in some]).T
        cells = (f"{np.median(e):+.3f} ({e.min():+.3f}, {e.max():+.3f})" for e in errors)
        lines.append(f"{shape:14}{len(some):8}" + "".join(f"{cell:>27}" for cell in cells))
    lines += [
        "",
        f"{sum(map(len, by_cause.values()))} of {pockets} pockets are UNDECIDED, by what takes most of the range, mm:",
        f"{'':32}{'pockets':>8}{'takes, median':>16}{'true error, median':>20}{'most':>8}",
    ]
    for why, sizes in sorted(by_cause.items(), key=lambda one: -len(one[1])):
        takes, errors = np.array(sizes).T
        lines.append(f"{why:32}{len(sizes):8}{np.median(takes):16.3f}{np.median(errors):20.3f}{errors.max():8.3f}")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--folder", type=Path, default=Path("build/open"))
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    with (HERE / "pockets.csv").open(newline="") as file:
        truths = list(csv.DictReader(file))
    text = table(list(read(args.folder, truths)), len(truths))
    print(text, end="")
    if args.out:
        args.out.write_text(text)


if __name__ == "__main__":
    main()
