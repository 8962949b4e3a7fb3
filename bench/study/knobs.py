"""Error against run time for every knob of a recipe: python bench/study/knobs.py [--layups 8]. Writes knobs.txt, .png.

The virtual layups are those of limit.py: second family, white noise, pockets round the limit. Each setting inspects the
same scans. The error is that of the ridge by the excess against the true ridge, half the held excess and 0.43 of the
thickness; the time is the processor time of a whole cycle, of all threads, and its wall time, the best of several.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
from limit import HIGH_MM, LOW_MM, prepared

from debulk import Inspector
from debulk.recipe import Recipe
from lab.study.pictures import STYLE, pyplot
from lab.varied.polygons import inside

DEFAULT = "default"
CYCLES = 3  # of each setting and scan, of which the fastest counts
# Each knob with its other values; the default is inspected once for all of them.
KNOBS: dict[str, dict[str, dict[str, dict[str, Any]]]] = {
    "heights apart": {f"{mm:g} mm": {"clean": {"grid_spacing_mm": mm}} for mm in (0.7, 1.5, 2.0, 3.0)},
    "filters": {
        "no median": {"clean": {"median_cells": 1}},
        "median of 5": {"clean": {"median_cells": 5}},
        "outliers by 2 neighbours": {"clean": {"neighbours": 2}},
    },
    "regions": {"whole scan": {"segmentation": {"regions": False}}},
    "minima": {
        "none that the verdict does not need": {"solve": {"when": "needed"}},
        "one start": {"solve": {"starts": 1, "most_starts": 1}},
        "16 starts": {"solve": {"starts": 16, "most_starts": 16}},
        "tolerance 1e-4": {"solve": {"tolerance": 1e-4}},
    },
    "nodes of a net": {f"{n}": {"net": {"node_target": n}} for n in (50, 200, 400)},
    "criterion": {"the paper's": {"verdict": {"criterion": "paper"}}},
    "threads": {"one": {"run": {"threads": 1}}},
}
DEADLINES_S = (0.05, 0.1, 0.2)


@dataclass
class Result:
    """What a setting gives on all layups."""

    knob: str
    setting: str
    off_mm: list[float]  # of each pocket whose ridge was measured: measured less true
    wrong: int  # CEASE above the limit, CREASE below it
    undecided: int  # UNDECIDED, INVALID or not found
    cpu_ms: float  # of a cycle, mean over the layups
    wall_ms: float

    def quantile(self, share: float) -> float:
        """Return the absolute error within which this share of the pockets lies."""
        return float(np.quantile(np.abs(self.off_mm), share, method="higher")) if self.off_mm else float("nan")


def settings() -> Iterator[tuple[str, str, Recipe, float | None]]:
    """Yield knob, setting, recipe and deadline."""
    yield DEFAULT, DEFAULT, Recipe(), None
    for knob, others in KNOBS.items():
        for name, sections in others.items():
            yield knob, name, Recipe(**sections), None
    for seconds in DEADLINES_S:
        yield "deadline", f"{seconds:g} s", Recipe(), seconds


def measured(layups: range, pixels: tuple[int, int]) -> list[Result]:
    """Inspect all layups with all settings; the settings of one layup follow one another, so that noise is shared."""
    results = [Result(knob, name, [], 0, 0, 0.0, 0.0) for knob, name, _, _ in settings()]
    for seed in layups:
        layup, given, usual = prepared(seed, pixels, Recipe())
        for result, (_, _, recipe, deadline_s) in zip(results, settings(), strict=True):
            inspector = usual if recipe == Recipe() else Inspector(
                recipe, given.reference, given.ply_outline, given.fibre_angles_deg, given.mold_from_scanner,
                mask=given.mask,
            )  # fmt: skip
            times = []
            for _ in range(CYCLES):
                wall, cpu = time.perf_counter(), time.process_time()
                report = inspector.inspect(given.scan, deadline_s=deadline_s)
                times.append((time.process_time() - cpu, time.perf_counter() - wall))
            cpu_s, wall_s = np.min(times, axis=0)
            result.cpu_ms += 1e3 * cpu_s / len(layups)
            result.wall_ms += 1e3 * wall_s / len(layups)
            _compare(result, layup, report)
    return results


def _compare(result: Result, layup: Any, report: Any) -> None:
    limit = Recipe().verdict.max_ridge_mm
    for truth in layup.truth.pockets:
        if truth.touches_ply_edge or not LOW_MM <= truth.ridge_mm <= HIGH_MM:
            continue
        x, y = (np.array(v) for v in truth.centre_mm)
        said = next((p for p in report.pockets if bool(inside(p.outline_mm, x, y))), None)
        verdict = "" if said is None else said.verdict.value
        if verdict not in ("cease", "crease"):
            result.undecided += 1
        elif verdict == ("cease" if truth.ridge_mm > limit else "crease"):
            result.wrong += 1
        if said is not None and said.excess is not None and said.excess.height_mm > 0:
            result.off_mm.append(said.excess.height_mm - truth.ridge_mm)


def table(results: list[Result], layups: range, pixels: tuple[int, int]) -> str:
    """Return the results as text."""
    about = (
        f"{len(layups)} virtual layups of limit.py at {pixels[0]} x {pixels[1]} pixels, all pockets inside the ply "
        f"with a true ridge of {LOW_MM:g} to {HIGH_MM:g} mm, limit {Recipe().verdict.max_ridge_mm:g} mm. Error: ridge "
        "by the excess less the true one, mm. Open: UNDECIDED, INVALID or not found. Times of a whole cycle, best of "
        f"{CYCLES}, mean over the layups."
    )
    lines = ["ERROR AGAINST RUN TIME", "", fill(about, 116), ""]
    lines.append(
        f"  {'knob':<16} {'setting':<36} {'pockets':>7} {'median':>7} {'90 %':>6} {'wrong':>5} {'open':>4} "
        f"{'CPU ms':>6} {'wall ms':>7}"
    )
    for r in results:
        lines.append(
            f"  {r.knob:<16} {r.setting:<36} {len(r.off_mm):>7} {r.quantile(0.5):>7.3f} {r.quantile(0.9):>6.3f} "
            f"{r.wrong:>5} {r.undecided:>4} {r.cpu_ms:>6.0f} {r.wall_ms:>7.0f}"
        )
    return "\n".join(lines) + "\n"


def picture(results: list[Result], path: Path) -> None:
    """Draw a row for each setting: the error of nine pockets in ten, and the processor time; lines are the default."""
    plt = pyplot()
    with plt.rc_context(STYLE):
        figure, (error, cost) = plt.subplots(1, 2, figsize=(11, 0.32 * len(results) + 1.6), sharey=True,
                                             layout="constrained")  # fmt: skip
        rows = range(len(results))
        colours = ["black" if r.knob == DEFAULT else "#0072b2" for r in results]
        error.scatter([r.quantile(0.9) for r in results], rows, c=colours)
        cost.scatter([r.cpu_ms for r in results], rows, c=colours)
        error.axvline(results[0].quantile(0.9), color="0.7", zorder=0)
        cost.axvline(results[0].cpu_ms, color="0.7", zorder=0)
        error.set_yticks(rows, [r.setting if r.knob == DEFAULT else f"{r.knob}: {r.setting}" for r in results])
        error.invert_yaxis()
        error.set(xlim=(0, None), xlabel="error of the ridge, mm: nine of ten pockets lie below")
        cost.set(xlim=(0, None), xlabel="processor time of a cycle, ms")
        figure.suptitle("What each setting costs, and how well it measures")
        figure.savefig(path, dpi=110)


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--layups", type=int, default=8)
    parser.add_argument("--first", type=int, default=5000)
    parser.add_argument("--pixels", type=int, nargs=2, default=(1280, 960))
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("knobs.txt"))
    args = parser.parse_args()
    layups, pixels = range(args.first, args.first + args.layups), (args.pixels[0], args.pixels[1])
    results = measured(layups, pixels)
    args.out.write_text(table(results, layups, pixels))
    picture(results, args.out.with_suffix(".png"))


if __name__ == "__main__":
    main()
