"""Pockets whose true ridges lie uniformly round the limit: python bench/study/limit.py [--layups 120] [--first 5000].

The virtual layups are of the second family with white noise only, and each is inspected as a whole. Only pockets inside
the ply count whose true held excess makes a ridge of 0.3 to 0.9 mm. Each twelfth of that range has the same weight,
however many pockets fall into it. A pocket over which the true ply bridges a hollow above the limit creases whatever
its ridge. Writes limit.txt, limit.csv and limit.png.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill

import numpy as np

from debulk import Inspector
from debulk.recipe import Recipe
from debulk.results.report import PocketReport
from lab.study.pictures import STYLE, pyplot
from lab.study.summary import write_csv
from lab.varied import Given, VariedLayup, given_right, varied_layup
from lab.varied.bridges import sections
from lab.varied.polygons import inside

LOW_MM, HIGH_MM, BINS = 0.3, 0.9, 12
SHOWN_MM = 0.1
DECIDED = ("cease", "crease")


@dataclass
class Row:
    """The judgement of a pocket."""

    layup: int
    kinds: str
    truth_mm: float
    verdict: str
    height_mm: float
    uncertainty_mm: float
    decided_by: str
    reason: str
    bridge_mm: float = 0.0
    """Height of the highest bridge of the true ply over a pocket that is decided; 0: it has none."""


def prepared(seed: int, pixels: tuple[int, int], recipe: Recipe) -> tuple[VariedLayup, Given, Inspector]:
    """Return a layup with white noise only, the input as it should be, and an inspector for it."""
    layup = varied_layup(
        seed, pixels, pockets=10, severity="any", noise=(), holes_mm=0, clamp=False, borders=0
    )  # fmt: skip
    given = given_right(layup)
    inspector = Inspector(
        recipe, given.reference, given.ply_outline, given.fibre_angles_deg, given.mold_from_scanner, mask=given.mask
    )
    return layup, given, inspector


def rows_of(seed: int, pixels: tuple[int, int]) -> Iterator[Row]:
    """Inspect a layup and yield the rows."""
    layup, given, inspector = prepared(seed, pixels, Recipe())
    report = inspector.inspect(given.scan)
    for truth in layup.truth.pockets:
        if truth.touches_ply_edge or not LOW_MM <= truth.ridge_mm <= HIGH_MM:
            continue
        x, y = (np.array(v) for v in truth.centre_mm)
        said = next((p for p in report.pockets if bool(inside(p.outline_mm, x, y))), None)
        kinds = "+".join(truth.kinds)
        if said is None or said.excess is None:
            verdict, why = ("not found", "") if said is None else (said.verdict.value, said.reason)
            yield Row(seed, kinds, truth.ridge_mm, verdict, np.nan, np.nan, "minima", why)
            continue
        known = said.excess
        yield Row(
            seed, kinds, truth.ridge_mm, said.verdict.value, known.height_mm, known.uncertainty_mm, said.decided_by,
            said.reason, _bridge_mm(layup, said) if said.verdict.value in DECIDED else 0.0,
        )  # fmt: skip


def _bridge_mm(layup: VariedLayup, said: PocketReport) -> float:
    return max((one.bridge_mm for one in sections(layup, said.foot_outline_mm, Recipe())), default=0.0)


def share(rows: list[Row], said: tuple[str, ...]) -> tuple[float, float]:
    """Return the share of pockets with these verdicts and its standard error; all parts of the range weigh the same."""
    shares, errors = [], []
    for k in range(BINS):
        mine = [r.verdict in said for r in rows if _bin(r.truth_mm) == k]
        if mine:
            p = float(np.mean(mine))
            shares.append(p)
            errors.append(p * (1 - p) / len(mine))
    return float(np.mean(shares)), float(np.sqrt(np.sum(errors)) / len(errors))


def _bin(truth_mm: float) -> int:
    return min(BINS - 1, int((truth_mm - LOW_MM) / (HIGH_MM - LOW_MM) * BINS))


def wrong(row: Row) -> bool:
    """Return whether the pocket was decided but the truth lies on the other side of the limit."""
    limit = Recipe().verdict.max_ridge_mm
    creases = max(row.truth_mm, row.bridge_mm) > limit
    return row.verdict == ("cease" if creases else "crease")


def table(rows: list[Row], layups: int) -> str:
    """Return the results as text."""
    bins = [sum(_bin(r.truth_mm) == k for r in rows) for k in range(BINS)]
    limit = Recipe().verdict.max_ridge_mm
    about = (
        f"{layups} virtual layups of the second family with white noise of the scanner alone, {len(rows)} pockets "
        f"inside the ply whose true ridge, half the held excess and 0.43 of the thickness, is {LOW_MM:g} to "
        f"{HIGH_MM:g} mm; the limit is {limit:g} mm. Shares with a standard error: each of {BINS} parts of the range, "
        f"with {min(bins)} to {max(bins)} pockets, counts the same. Wrong side: CEASE with a true ridge above the "
        "limit, CREASE with one below; a bridge of the true ply above it (lab/varied/bridges.py) counts as one. "
        "Height: measured less true, mm. A ring's true ridge counts each side of its laid middle by itself, the rule "
        "lets one fold draw both together."
    )
    lines = ["POCKETS ROUND THE LIMIT", "", fill(about, 116), ""]
    lines.append(
        f"  {'pockets':>7} {'UNDECIDED':>15} {'INVALID':>7} {'false CEASE':>11} {'false CREASE':>12} "
        f"{'height median':>13} {'90 % within':>11}"
    )
    part, error = share(rows, ("undecided",))
    off = np.array([r.height_mm - r.truth_mm for r in rows if np.isfinite(r.height_mm) and r.height_mm > 0])
    lines.append(
        f"  {len(rows):>7} {f'{100 * part:.1f} ± {100 * error:.1f} %':>15} "
        f"{sum(r.verdict not in (*DECIDED, 'undecided') for r in rows):>7} "
        f"{sum(wrong(r) and r.verdict == 'cease' for r in rows):>11} "
        f"{sum(wrong(r) and r.verdict == 'crease' for r in rows):>12} {np.median(off):>+13.4f} "
        f"{np.quantile(np.abs(off), 0.9, method='higher'):>11.4f}"
    )
    lines += ["", "Height measured less true, mm, by the shapes of the second family: median, least and most"]
    for kinds in sorted({r.kinds for r in rows}):
        off = np.array([r.height_mm - r.truth_mm for r in rows if r.kinds == kinds and r.height_mm > 0])
        if off.size:
            lines.append(f"  {kinds:<26} {off.size:>7} {np.median(off):>+8.4f} {off.min():>+8.3f} {off.max():>+8.3f}")
    lines += ["", "Not decided by the excess, or decided on the wrong side, by the inspection"]
    for r in sorted(rows, key=lambda r: r.truth_mm):
        if r.decided_by != "excess" or wrong(r) or r.verdict not in (*DECIDED, "undecided"):
            lines.append(
                f"  layup {r.layup}, {r.kinds}, true ridge {r.truth_mm:.3f} mm: {r.verdict.upper()}, {r.reason}"
            )
    widest = max((abs(r.truth_mm - limit) for r in rows if r.verdict == "undecided" and r.decided_by == "excess"),
                 default=0.0)  # fmt: skip
    lines.append(f"  UNDECIDED by the excess: true ridges up to {widest:.3f} mm from the limit")
    return "\n".join(lines) + "\n"


def picture(rows: list[Row], path: Path) -> None:
    """Draw the measured ridge over the true ridge, coloured by the verdict."""
    plt = pyplot()
    rows = [r for r in rows if np.isfinite(r.height_mm)]
    limit = Recipe().verdict.max_ridge_mm
    colours = {"cease": "#0072b2", "undecided": "#8a6d00", "crease": "#d55e00", "invalid": "#505050"}
    with plt.rc_context(STYLE):
        figure, (ax, off) = plt.subplots(1, 2, figsize=(13, 6), layout="constrained")
        for verdict, colour in colours.items():
            mine = [r for r in rows if r.verdict == verdict]
            if not mine:
                continue
            label = f"{verdict.upper()} ({len(mine)})"
            for bridge, face in ((False, colour), (True, "white")):
                shown = [r for r in mine if r.reason.startswith("bridge") is bridge]
                x, y = np.array([r.truth_mm for r in shown]), np.array([r.height_mm for r in shown])
                spread = [r.uncertainty_mm for r in shown]
                for panel, values in ((ax, y), (off, y - x)):
                    panel.errorbar(x, values, spread, fmt="o", ms=4, lw=0.8, color=colour, mfc=face)
            ax.errorbar([], [], [], fmt="o", ms=4, lw=0.8, color=colour, label=label)
        ax.plot([LOW_MM, HIGH_MM], [LOW_MM, HIGH_MM], color="black", lw=0.8)
        ax.axhline(limit, color="black", lw=0.8, ls="--")
        off.axhline(0.0, color="black", lw=0.8)
        for panel in (ax, off):
            panel.axvline(limit, color="black", lw=0.8, ls="--")
            panel.set_xlabel("true ridge by the held excess, mm")
        off.set_ylim(-SHOWN_MM, SHOWN_MM)
        beyond = sum(abs(r.height_mm - r.truth_mm) > SHOWN_MM for r in rows)
        ax.set_ylabel("ridge by the measured excess, mm")
        off.set_ylabel("measured less true, mm")
        ax.set_title("Measured and true ridge; dashed: the limit", loc="left", fontweight="bold")
        off.set_title(
            f"The error, with the uncertainty stated ({beyond} pockets beyond)", loc="left", fontweight="bold"
        )
        ax.errorbar(
            [], [], [], fmt="o", ms=4, lw=0.8, color="black", mfc="white", label="for its bridge, not its ridge"
        )
        ax.legend(loc="upper left")
        figure.savefig(path, metadata={"Software": "debulk"})
        plt.close(figure)


def main(arguments: list[str] | None = None) -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--layups", type=int, default=120)
    parser.add_argument("--first", type=int, default=5000, help="seed of the first layup")
    parser.add_argument("--pixels", type=int, nargs=2, default=(1280, 960))
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder")
    wanted = parser.parse_args(arguments)
    rows: list[Row] = []
    for seed in range(wanted.first, wanted.first + wanted.layups):
        rows += rows_of(seed, tuple(wanted.pixels))
        print(f"layup {seed}: {len(rows)} pockets", flush=True)
    wanted.out.mkdir(parents=True, exist_ok=True)
    text = table(rows, wanted.layups)
    (wanted.out / "limit.txt").write_text(text, encoding="utf-8")
    write_csv(wanted.out / "limit.csv", rows)
    picture(rows, wanted.out / "limit.png")
    print(text)


if __name__ == "__main__":
    main()
