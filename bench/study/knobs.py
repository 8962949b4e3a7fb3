"""Error against run time for every knob: python bench/study/knobs.py [--layups 11] [--only KNOB]. Writes knobs.*.

The virtual layups are those of limit.py: second family, white noise, pockets round the limit. Each setting inspects the
same scans. The error is that of the ridge by the excess against the true ridge, half the held excess and 0.43 of the
thickness; the time is the processor time of a whole cycle, of all threads, and its wall time, the best of several.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from textwrap import fill
from time import perf_counter, process_time
from typing import Any
from unittest.mock import patch

import numpy as np
from limit import HIGH_MM, LOW_MM, prepared

from debulk import Inspector
from debulk.recipe import Recipe, options
from lab.study.pictures import STYLE, pyplot
from lab.varied.polygons import inside

DEFAULT = "default"
LINES = "lines apart"
CYCLES = 3  # of each setting and scan, of which the fastest counts
# What all settings share but those of `minima`: without it the default makes no net of a pocket inside the ply, and the
# starts, the tolerance and the nodes have nothing to act on.
ALL_MINIMA = {"solve": {"when": "always"}}
# Each knob with its other values; the default is inspected once for all of them.
KNOBS: dict[str, dict[str, dict[str, dict[str, Any]]]] = {
    "heights apart": {f"{mm:g} mm": {"clean": {"grid_spacing_mm": mm}} for mm in (0.7, 1.5, 2.0, 3.0)},
    "filters": {
        "no median": {"clean": {"median_cells": 1}},
        "median of 5": {"clean": {"median_cells": 5}},
        "2 neighbours": {"clean": {"neighbours": 2}},
    },
    "minima": {"if needed (default)": {"solve": {"when": "needed"}}},
    "starts": {f"{n}": {"solve": {"starts": n, "most_starts": n}} for n in (1, 16)},
    "tolerance": {"1e-4": {"solve": {"tolerance": 1e-4}}},
    "nodes of a net": {f"{n}": {"net": {"node_target": n}} for n in (50, 200, 400)},
    "criterion": {"the paper's": {"verdict": {"criterion": "paper"}}},
    "threads": {"1": {"run": {"threads": 1}}},
}
LINES_MM = (1.0, 4.0, 8.0)  # no setting of a recipe, but of debulk.fibre.measure
DEADLINES_S = (0.05, 0.1, 0.2)
# What the picture calls the default of each knob; None: no value to name.
DEFAULTS = {
    "heights apart": "as scanned", LINES: "2 mm", "filters": "median of 3, 4 neighbours", "minima": "always",
    "starts": "2 to 8", "tolerance": "1e-8", "nodes of a net": "100", "criterion": "excess",
    "threads": "all", "deadline": "none",
}  # fmt: skip


@dataclass
class Result:
    """What a setting gives on all layups."""

    knob: str
    setting: str
    pockets: int = 0  # whose ridge was measured
    median_mm: float = np.nan  # of the absolute errors of the ridge, and below it nine of ten
    ninety_mm: float = np.nan
    wrong: int = 0  # CEASE above the limit, CREASE below it
    undecided: int = 0  # UNDECIDED, INVALID or not found
    all_pockets: int = 0
    cpu_ms: float = 0.0  # of a cycle, mean over the layups
    wall_ms: float = 0.0

    @property
    def not_right(self) -> float:
        """Return the share of pockets that are not decided, or wrongly."""
        return (self.wrong + self.undecided) / self.all_pockets


def settings() -> Iterator[tuple[str, str, Recipe, float | None, float | None]]:
    """Yield knob, setting, recipe, deadline in seconds, and the distance of the lines in mm if not the default."""
    base = Recipe(**ALL_MINIMA)
    yield DEFAULT, DEFAULT, base, None, None
    for knob, others in KNOBS.items():
        for name, sections in others.items():
            solving = {**ALL_MINIMA["solve"], **sections.get("solve", {})}
            yield knob, name, Recipe(**{**sections, "solve": solving}), None, None
    for mm in LINES_MM:
        yield LINES, f"{mm:g} mm", base, None, mm
    for seconds in DEADLINES_S:
        yield "deadline", f"{seconds:g} s", base, seconds, None


def measured(layups: range, pixels: tuple[int, int], only: str | None = None) -> list[Result]:
    """Inspect all layups with all settings; the settings of one layup follow one another, so that noise is shared."""
    chosen = [s for s in settings() if only in (None, s[0]) or s[0] == DEFAULT]
    results = [Result(knob, name) for knob, name, *_ in chosen]
    off_mm: list[list[float]] = [[] for _ in chosen]
    for seed in layups:
        layup, given, usual = prepared(seed, pixels, Recipe(**ALL_MINIMA))
        for result, off, (_, _, recipe, deadline_s, lines_mm) in zip(results, off_mm, chosen, strict=True):
            with ExitStack() as patches:
                for name in ("_APART_MM", "_NEAREST_MM") if lines_mm else ():
                    patches.enter_context(patch.object(options, name, lines_mm))
                inspector = usual if recipe == Recipe(**ALL_MINIMA) and not lines_mm else Inspector(
                    recipe, given.reference, given.ply_outline, given.fibre_angles_deg, given.mold_from_scanner,
                    mask=given.mask,
                )  # fmt: skip
                times = []
                for _ in range(CYCLES):
                    wall, cpu = perf_counter(), process_time()
                    report = inspector.inspect(given.scan, deadline_s=deadline_s)
                    times.append((process_time() - cpu, perf_counter() - wall))
            cpu_s, wall_s = np.min(times, axis=0)
            result.cpu_ms += 1e3 * cpu_s / len(layups)
            result.wall_ms += 1e3 * wall_s / len(layups)
            off += _compared(result, layup, report)
    for result, off in zip(results, off_mm, strict=True):
        if off:
            result.pockets = len(off)
            result.median_mm, result.ninety_mm = np.quantile(np.abs(off), (0.5, 0.9), method="higher").tolist()
    return results


def _compared(result: Result, layup: Any, report: Any) -> list[float]:
    """Count right and wrong verdicts; return the errors of the ridges that were measured, mm."""
    limit, off_mm = Recipe().verdict.max_ridge_mm, []
    for truth in layup.truth.pockets:
        if truth.touches_ply_edge or not LOW_MM <= truth.ridge_mm <= HIGH_MM:
            continue
        x, y = (np.array(v) for v in truth.centre_mm)
        said = next((p for p in report.pockets if bool(inside(p.outline_mm, x, y))), None)
        verdict = "" if said is None else said.verdict.value
        result.all_pockets += 1
        if verdict not in ("cease", "crease"):
            result.undecided += 1
        elif verdict == ("cease" if truth.ridge_mm > limit else "crease"):
            result.wrong += 1
        if said is not None and said.excess is not None and said.excess.height_mm > 0:
            off_mm.append(said.excess.height_mm - truth.ridge_mm)
    return off_mm


def table(results: list[Result], layups: range, pixels: tuple[int, int]) -> str:
    """Return the results as text."""
    about = (
        f"{len(layups)} virtual layups of limit.py at {pixels[0]} x {pixels[1]} pixels, all {results[0].all_pockets} "
        f"pockets inside the ply with a true ridge of {LOW_MM:g} to {HIGH_MM:g} mm, limit "
        f"{Recipe().verdict.max_ridge_mm:g} mm. Error: ridge by the excess less the true one, mm. Open: UNDECIDED, "
        f"INVALID or not found. Times of a whole cycle, best of {CYCLES}, mean over the layups. The default here makes "
        'all minima (solve.when = "always"); without those that no verdict needs it is the row of that knob.'
    )
    lines = ["ERROR AGAINST RUN TIME", "", fill(about, 116), ""]
    lines.append(
        f"  {'knob':<16} {'setting':<24} {'pockets':>7} {'median':>7} {'90 %':>6} {'wrong':>5} {'open':>4} "
        f"{'CPU ms':>6} {'wall ms':>7}"
    )
    for r in results:
        lines.append(
            f"  {r.knob:<16} {r.setting:<24} {r.pockets:>7} {r.median_mm:>7.3f} {r.ninety_mm:>6.3f} "
            f"{r.wrong:>5} {r.undecided:>4} {r.cpu_ms:>6.0f} {r.wall_ms:>7.0f}"
        )
    return "\n".join(lines) + "\n"


def picture(results: list[Result], path: Path) -> None:
    """Draw verdicts that are not right over the cycle's time, one panel a knob, with the default in each of them."""
    plt = pyplot()
    default, others = results[0], results[1:]
    knobs = list(DEFAULTS)
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(3, 4, figsize=(12, 8.4), sharex=True, sharey=True, layout="constrained")
        for axis, knob in zip(axes.flat, knobs, strict=False):
            axis.set_title(knob, loc="left", fontweight="bold", fontsize=10)
            axis.scatter([r.cpu_ms for r in others], [100 * r.not_right for r in others], s=12, c="0.85", zorder=1)
            of = [r for r in others if r.knob == knob]
            colours = ["#d55e00" if r.wrong else "#0072b2" for r in of]
            axis.scatter([r.cpu_ms for r in of], [100 * r.not_right for r in of], s=44, c=colours, zorder=3)
            axis.scatter(default.cpu_ms, 100 * default.not_right, s=110, marker="*", c="black", zorder=4)
            named = [(default.cpu_ms, 100 * default.not_right, DEFAULTS[knob], "black")]
            named += [(r.cpu_ms, 100 * r.not_right, r.setting, colour) for r, colour in zip(of, colours, strict=True)]
            _name(axis, named)
        axes.flat[0].set(xscale="log", xlim=(55, 900), ylim=(-4, 112), yticks=range(0, 101, 25))
        axes.flat[0].set_xticks([60, 100, 200, 400, 800], ["60", "100", "200", "400", "800"])
        axes.flat[0].minorticks_off()
        legend = axes.flat[-1]
        legend.axis("off")
        says = (
            ("*", "black", "the default, with all minima"),
            ("o", "#0072b2", "another value: none decided wrongly"),
            ("o", "#d55e00", "another value: some decided wrongly"),
            ("o", "0.85", "all values of all knobs"),
        )
        for k, (marker, colour, text) in enumerate(says):
            legend.scatter(0.06, 0.8 - 0.16 * k, marker=marker, c=colour, s=60, transform=legend.transAxes)
            legend.text(0.14, 0.8 - 0.16 * k, text, transform=legend.transAxes, va="center")
        figure.supxlabel("processor time of a cycle of 1.2 million points, ms")
        figure.supylabel(f"pockets near the limit that are left open or decided wrongly, % of {default.all_pockets}")
        figure.suptitle("Left is faster, down is better: what each knob does to the verdict and to the time")
        figure.savefig(path, dpi=110)
        plt.close(figure)


def _name(axis: Any, points: list[tuple[float, float, str, str]]) -> None:
    """Write the names of the points of a panel above them, so that none hides another."""
    taken: list[tuple[float, float]] = []
    for x, y, name, colour in sorted(points):
        at = np.log(x)
        level = 0
        while any(abs(at - a) < 0.9 and abs(y + 9 * level - b) < 8 for a, b in taken):
            level += 1
        taken.append((at, y + 9 * level))
        axis.annotate(
            name, (x, y), xytext=(0, 7 + 11 * level), textcoords="offset points", ha="center", color=colour, fontsize=8,
            arrowprops={"arrowstyle": "-", "color": "0.7", "shrinkB": 2} if level else None,
        )  # fmt: skip


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--layups", type=int, default=11)
    parser.add_argument("--first", type=int, default=5000)
    parser.add_argument("--pixels", type=int, nargs=2, default=(1280, 960))
    parser.add_argument("--only", help="measure the default and this knob alone, and add it to knobs.csv")
    parser.add_argument("--out", type=Path, default=Path(__file__).with_name("knobs.txt"))
    args = parser.parse_args()
    layups, pixels = range(args.first, args.first + args.layups), (args.pixels[0], args.pixels[1])
    results = measured(layups, pixels, args.only)
    kept = args.out.with_suffix(".csv")
    if args.only:
        results = joined(_read(kept, args.only), results)
    with kept.open("w", newline="") as file:
        writer = csv.DictWriter(file, [f.name for f in fields(Result)])
        writer.writeheader()
        writer.writerows(asdict(r) for r in results)
    args.out.write_text(table(results, layups, pixels))
    picture(results, args.out.with_suffix(".png"))


def joined(before: list[Result], now: list[Result]) -> list[Result]:
    """Add a knob to what was measured before, its times as shares of the default's, then and now."""
    for r in now[1:]:
        r.cpu_ms *= before[0].cpu_ms / now[0].cpu_ms
        r.wall_ms *= before[0].wall_ms / now[0].wall_ms
    return before + now[1:]


def _read(path: Path, without: str) -> list[Result]:
    """Return the results that were measured before of all other knobs."""
    with path.open(newline="") as file:
        rows = [r for r in csv.DictReader(file) if r["knob"] != without]
    texts = ("knob", "setting")
    whole = ("pockets", "wrong", "undecided", "all_pockets")
    return [Result(**{k: v if k in texts else int(v) if k in whole else float(v) for k, v in r.items()}) for r in rows]


if __name__ == "__main__":
    main()
