"""Error and time of the excess rule on coarser nets: python bench/study/spacings.py [--layups 110 119].

The nets of the pockets inside the ply are laid at many spacings, and the ridge that their excess makes is compared with
that of the finest net: from the net alone, from the net at half the spacing alone, and extrapolated from both, as in an
inspection. Times are CPU times of the thread that lays the nets. Writes spacings.txt, spacings.csv and spacings.png.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np

from debulk import Inspector, _core, scenes
from debulk.inspection.fibre_angles import angles_at
from debulk.inspection.found import FoundPocket
from debulk.inspection.ply_on_mold import PlyOnMold
from debulk.recipe import Recipe, options
from debulk.study.curves import Mark, note_marks
from debulk.study.pictures import COLOURS, MARKERS, STYLE, pyplot
from debulk.study.summary import write_csv

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "trust"))
from first_family import held_excess_mm

SPACINGS_MM = (12.0, 10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.5)
NODES = (25, 50, 75, 100, 150, 200, 400)
FINEST_MM = (1.0, 1.5, 2.0, 3.0)  # the finest net has the first of these at which a pocket has at most MOST nodes
MOST = 50000
COARSER = 1.4  # a net counts if it is coarser than the finest by at least this factor
READINGS = {
    "one": "the net alone",
    "half": "the net at half the spacing alone",
    "both": "both, extrapolated (the rule)",
}


@dataclass
class Row:
    """A pocket at a spacing: excess lengths without the noise's bias, mm, and CPU times."""

    sweep: str
    setting: float
    layup: int
    pocket: int
    spacing_mm: float
    nodes: int
    finest_mm: float
    one_mm: float
    half_mm: float
    both_mm: float
    reference_mm: float
    truth_mm: float
    one_ms: float
    both_ms: float

    def error_mm(self, reading: str) -> float:
        """Return the error of the ridge's height, which is half the excess plus 0.43 of the thickness."""
        return abs(getattr(self, f"{reading}_mm") - self.reference_mm) / 2

    def ms(self, reading: str) -> float:
        """Return the time to lay the nets that a reading needs."""
        return self.one_ms if reading == "one" else self.both_ms


@dataclass(frozen=True)
class Nets:
    """A pocket's net, the net at half its spacing, and their excess lengths."""

    spacing_mm: float
    nodes: int
    one_mm: float
    half_mm: float
    both_mm: float
    one_ms: float
    both_ms: float


def lay(
    found: FoundPocket, ply: PlyOnMold, spacing_mm: float | None, node_target: int = 100, timed: bool = True
) -> Nets | None:
    """Lay both nets, and the first also by itself if it is `timed`.

    Returns None if the rim is free at the ply's edge, or if one of the nets cannot be laid.
    """
    chosen = options.lay_pocket(ply.recipe)
    chosen.net.spacing_mm, chosen.net.node_target = spacing_mm, node_target
    angles = np.radians(angles_at(ply.fibre_angles_deg, found.pocket.centroid_mm))
    times_ms = []
    for finer_too in (False, True) if timed else (True,):
        chosen.net.finer_too = finer_too
        began = time.thread_time()
        try:
            made = _core.net.lay_pocket(
                found.segmentation._core, found.feet._core, found.pocket.id, ply.reference, angles, ply.outline,
                chosen, _core.Stop(),
            )  # fmt: skip
        except _core.InputError:
            return None
        held = [_core.ridge.held_excess(made.net, ply.reference)]
        if finer_too and made.finer.spacing > 0:
            held.append(_core.ridge.held_excess(made.finer, ply.reference))
        times_ms.append(1e3 * (time.thread_time() - began))
    if not made.held_all_round or len(held) < 2:
        return None
    one, half = (
        h.largest_mm - h.segments * made.noise**2 / n.spacing for h, n in zip(held, (made.net, made.finer), strict=True)
    )
    return Nets(made.net.spacing, len(made.net.nodes), one, half, half + (half - one) / 3, times_ms[0], times_ms[-1])


def rows_of(seed: int, pixels: tuple[int, int]) -> Iterator[Row]:
    """Lay the nets of a virtual layup's pockets and yield the rows."""
    layup = scenes.layup(seed, pixels)
    recipe = Recipe(segmentation={"regions": False})
    inspector = Inspector(recipe, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    truths_mm = held_excess_mm(layup)
    for found in inspector.find(layup.scan).pockets:
        finest_mm = next((d for d in FINEST_MM if found.foot.area_mm2 / d**2 <= MOST), FINEST_MM[-1])
        reference = lay(found, inspector.ply, finest_mm, timed=False) if found.foot.closed else None
        if reference is None:
            continue
        truth_mm = truths_mm[_nearest(layup, found)]
        for sweep, settings in (("spacing", SPACINGS_MM), ("nodes", NODES)):
            for setting in settings:
                nets = lay(found, inspector.ply, *((setting,) if sweep == "spacing" else (None, int(setting))))
                if nets is not None and nets.spacing_mm > COARSER * finest_mm:
                    yield Row(
                        sweep, setting, seed, found.number, nets.spacing_mm, nets.nodes, finest_mm, nets.one_mm,
                        nets.half_mm, nets.both_mm, reference.both_mm, truth_mm, nets.one_ms, nets.both_ms,
                    )  # fmt: skip


def _nearest(layup: scenes.Layup, found: FoundPocket) -> int:
    """Return the number of the nearest true pocket."""
    tops = np.array([bump.centre_mm for bump in layup.truth.pockets])
    return int(np.argmin(np.hypot(*(tops - found.pocket.centroid_mm).T)))


def _against_truth_mm(rows: list[Row]) -> list[float]:
    """Return for each pocket the error of the ridge by the finest net against the true surfaces, mm."""
    return [abs(r.reference_mm - r.truth_mm) / 2 for r in {(r.layup, r.pocket): r for r in rows}.values()]


def table(rows: list[Row], layups: int, margin_mm: float) -> str:
    """Return the results as text."""
    pockets = {(r.layup, r.pocket) for r in rows}
    per_pocket = {(r.layup, r.pocket): r for r in rows}.values()
    noise_mm = np.array(_against_truth_mm(rows))
    sizes = {d: sum(r.finest_mm == d for r in per_pocket) for d in FINEST_MM}
    about = [
        f"{layups} virtual layups, {len(pockets)} pockets inside the ply. Error: of the ridge's height by the excess, "
        "half the excess and 0.43 of the thickness, against the finest nets of the same scan, extrapolated from "
        + ", ".join(f"{d:g} and {d / 2:g} mm ({n} pockets)" for d, n in sizes.items() if n)
        + f". Pockets count where the finest net is finer by a factor of {COARSER:g}. ms: CPU time of the thread that "
        "lays the net, its surface included; of one net, and of both. The noise's bias is taken off throughout.",
        f"What finer nets cannot give: against the true surface, along straight fibres, the finest nets are off by "
        f"{np.median(noise_mm):.4f} mm in the median, {np.quantile(noise_mm, 0.9, method='higher'):.4f} mm in nine of "
        f"ten, {noise_mm.max():.4f} mm at most: noise, smoothing and the outline. The rule's least uncertainty is "
        f"{margin_mm:g} mm.",
    ]
    lines = ["A COARSER NET AND THE EXCESS: ERROR AGAINST RUN TIME", ""]
    for paragraph in about:
        lines += [fill(paragraph, 116), ""]
    heads = " ".join(f"{name:^26}" for name in ("one net", "the half one alone", "both, extrapolated"))
    for sweep, name in (("spacing", "spacing, mm"), ("nodes", "nodes asked for")):
        lines += [f"  {'':<16} {'':>7} {'':>6} {'ms of':>6} {'ms of':>6}  {heads}"]
        lines += [
            f"  {name:<16} {'pockets':>7} {'nodes':>6} {'one':>6} {'both':>6}  "
            + " ".join(f"{'median':>8} {'90 %':>8} {'most':>8}" for _ in READINGS)
        ]
        for setting in sorted({r.setting for r in rows if r.sweep == sweep}, reverse=sweep == "spacing"):
            mine = [r for r in rows if r.sweep == sweep and r.setting == setting]
            cells = []
            for reading in READINGS:
                e = np.array([r.error_mm(reading) for r in mine])
                cells.append(f"{np.median(e):>8.4f} {np.quantile(e, 0.9, method='higher'):>8.4f} {e.max():>8.4f}")
            lines.append(
                f"  {setting:<16g} {len(mine):>7} {np.median([r.nodes for r in mine]):>6.0f} "
                f"{np.median([r.one_ms for r in mine]):>6.1f} {np.median([r.both_ms for r in mine]):>6.1f}  "
                + " ".join(cells)
            )
        lines.append("")
    return "\n".join(line.rstrip() for line in lines[:-1]) + "\n"


def picture(rows: list[Row], margin_mm: float, path: Path) -> None:
    """Draw the error over the time: that of the median pocket, and the value that nine of ten do not exceed."""
    plt = pyplot()
    swept = [r for r in rows if r.sweep == "spacing"]
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(1, 2, figsize=(13, 5.6), layout="constrained", sharey=True)
        noted: list[tuple[Any, list[Mark]]] = []
        for ax, share, name in zip(axes, (0.5, 0.9), ("of the median pocket", "that nine of ten keep"), strict=True):
            marks = []
            for k, (reading, label) in enumerate(READINGS.items()):
                points = []
                for setting in SPACINGS_MM:
                    mine = [r for r in swept if r.setting == setting]
                    e = np.quantile([r.error_mm(reading) for r in mine], share, method="higher")
                    points.append((float(np.median([r.ms(reading) for r in mine])), float(e)))
                x, y = zip(*points, strict=True)
                ax.plot(x, y, "-" + MARKERS[k], ms=5, lw=1, color=COLOURS[k], label=label)
                marks += [Mark(a, b, f"{s:g}", COLOURS[k]) for (a, b), s in zip(points, SPACINGS_MM, strict=True)]
            true_mm = np.quantile(_against_truth_mm(rows), share, method="higher")
            for level, style, note in (
                (margin_mm, "-", "the rule's least uncertainty"),
                (true_mm, "--", "the finest nets' error against the true ply"),
            ):
                ax.axhline(level, color="black", lw=1, ls=style)
                ax.annotate(note, (1, level), xycoords=("axes fraction", "data"), xytext=(0, 3),
                            textcoords="offset points", ha="right", fontsize=8)  # fmt: skip
            ax.set_xscale("log")
            ax.set_yscale("log")
            ax.set_xlabel("CPU time to lay what the reading needs, ms, median pocket")
            ax.set_title(f"Error {name}", loc="left", fontweight="bold", fontsize=10)
            for axis in (ax.xaxis, ax.yaxis):
                _plain(axis)
            noted.append((ax, marks))
        axes[0].set_ylabel("error of the ridge's height, mm")
        axes[1].legend(fontsize=8, loc="upper right", title="ridge by the excess from (beside the marks: mm)")
        figure.suptitle(
            "What a coarser net costs the excess rule, against the finest nets of the same scan", fontsize=11
        )
        note_marks(figure, noted)
        figure.savefig(path, metadata={"Software": "debulk"})
        plt.close(figure)


def _plain(axis: Any) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda v, _: f"{v:g}"))
    axis.set_minor_formatter(NullFormatter())


def main(arguments: list[str] | None = None) -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--layups", type=int, nargs=2, default=(110, 119), help="first and last seed")
    parser.add_argument("--pixels", type=int, nargs=2, default=(1280, 960))
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder")
    wanted = parser.parse_args(arguments)
    first, last = wanted.layups
    rows: list[Row] = []
    for seed in range(first, last + 1):
        rows += rows_of(seed, tuple(wanted.pixels))
        print(f"layup {seed}: {len(rows)} nets", flush=True)
    margin_mm = Recipe().verdict.excess_margin_mm
    text = table(rows, last - first + 1, margin_mm)
    wanted.out.mkdir(parents=True, exist_ok=True)
    (wanted.out / "spacings.txt").write_text(text, encoding="utf-8")
    write_csv(wanted.out / "spacings.csv", rows)
    picture(rows, margin_mm, wanted.out / "spacings.png")
    print(text)


if __name__ == "__main__":
    main()
