"""The stress table: python bench/stress/stress.py [--count 400] [--draws 1 2 3 4 5] [--out bench/stress].

It varies one parameter at a time, and takes draws of Latin-hypercube combinations of all of them, each with its own
seed. Answers of small nets are held against extended precision (second.py). Writes stress.txt, stress.csv and
stress.png, and each case that is neither certified nor refused to build/stress, for `python -m lab.kept_solves`.
"""

from __future__ import annotations

import argparse
import csv
import os
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from cases import Case, build, latin_hypercube, one_at_a_time
from second import second

from debulk import InputError, solve
from debulk.inspection.minima.laid_pocket import REFUSED
from lab import kept_solves

LONGEST_MS = 2000.0  # that a solve is meant to take
SMALL = 150  # nodes of nets whose answers are held against those of extended precision
LEFT, MOVED = 1e-5, 1e-3  # of the vacuum on a node, and spacings, within which an answer is confirmed
ILL = 1e10  # condition number of what is called ill-conditioned: six of sixteen digits are left


@dataclass
class Row:
    """The result of a case."""

    group: str
    case: Case
    ending: str  # certified, compliant, refused, failed
    status: str
    why: str
    nodes: int = 0
    movable: int = 0
    kkt_error: float = np.nan
    strict_kkt_error: float = np.nan  # in units of P A / N, or of a node's weight, also for stiff plies
    length_error: float = np.nan
    penetration_mm: float = np.nan
    iterations: int = 0
    ms: float = np.nan
    rms_spacings: float = np.nan  # of the movable nodes' gaps
    seed: int = -1  # of the draw
    number: int = -1  # in the draw
    condition: float = np.nan  # of the equations of the answer
    exact_residual: float = np.nan  # in extended precision, in units of strict_kkt_error
    exact_left: float = np.nan  # the same after Newton's method in extended precision
    exact_moved: float = np.nan  # way of a node to there, in spacings

    @property
    def good(self) -> bool:
        """Return whether the case is refused before the solve, or certified within the time meant for it."""
        return self.ending == "refused" or (self.ending in ("certified", "compliant") and self.ms <= LONGEST_MS)


@dataclass(frozen=True)
class Job:
    """A case, and how to solve it."""

    group: str
    case: Case
    seed: int
    number: int
    method: str
    dumps: str
    deadline_s: float


def run(job: Job) -> Row:
    """Run one case."""
    group, case = job.group, job.case
    try:
        model = build(case)
    except InputError as error:
        return Row(group, case, "refused", "no net", str(error)[:100], seed=job.seed, number=job.number)
    started = time.process_time()
    solution = solve.minimise(model, job.method, deadline_s=job.deadline_s)
    ms = 1e3 * (time.process_time() - started)
    certificate = solution.certificate
    if solution.status in REFUSED and solution.iterations == 0:
        ending, why = "refused", solution.explanation  # before the solve; a ply that slides off during it has failed
    elif not solution.certified:
        ending, why = "failed", certificate.failure
        name = f"{group.split(',')[0].replace(' ', '_')}_{max(job.seed, 0)}_{job.number}.json"
        kept_solves.dump(Path(job.dumps) / name, model, solution, method=job.method)
    else:
        ending, why = "compliant" if certificate.compliant else "certified", ""
    movable = model.kinds != 1
    gaps = model.gaps(solution.nodes_mm)[movable]
    rms = float(np.sqrt(np.mean(gaps**2)) / case.spacing_mm) if movable.any() else 0.0
    row = Row(
        group, case, ending, solution.status, why, len(movable), int(movable.sum()), certificate.kkt_error,
        certificate.strict_kkt_error, certificate.length_error, certificate.penetration_mm, solution.iterations,
        ms, rms, job.seed, job.number,
    )  # fmt: skip
    if ending in ("certified", "compliant") and solution.iterations and row.nodes <= SMALL:
        try:
            exact = second(model, solution)
        except InputError:  # a ply that slid beyond the heights of the mold, which goes on there for the solver only
            return row
        row.condition, row.exact_residual = exact.condition, exact.residual
        row.exact_left, row.exact_moved = exact.left, exact.moved
    return row


def table(rows: list[Row], combinations: list[Row]) -> str:
    """Return the table as text."""
    lines = ["Stress table of the solve. Times are processor times of single runs, solve and certificate.", ""]
    head = f"{'parameter':<20} {'case':<44} {'ending':<10} {'status':<22} {'nodes':>5} {'mov':>4} {'it':>5} {'ms':>8} "
    lines += [head + f"{'kkt':>8} {'length':>8} {'rms/spacing':>11}", "-" * 160]
    for r in rows:
        lines.append(
            f"{r.group:<20} {r.case.text()[:44]:<44} {r.ending:<10} {r.status:<22} {r.nodes:>5} {r.movable:>4} "
            f"{r.iterations:>5} {r.ms:>8.1f} {r.kkt_error:>8.1e} {r.length_error:>8.1e} {r.rms_spacings:>11.4f} {r.why}"
        )
    seeds = sorted({r.seed for r in combinations})
    lines += ["", f"{len(combinations)} Latin-hypercube combinations over all ranges, in {len(seeds)} draws", ""]
    lines.append(
        f"  {'seed':>5} {'cases':>6} {'refused':>8} {'certified':>10} {'compliant':>10} {'not certified':>14} "
        f"{'over 2 s':>9}"
    )
    for seed in [*seeds, None]:
        of = [r for r in combinations if seed in (None, r.seed)]
        endings = Counter(r.ending for r in of)
        slow = sum(r.ending != "failed" and r.ms > LONGEST_MS for r in of)
        lines.append(
            f"  {'all' if seed is None else seed:>5} {len(of):>6} {endings['refused']:>8} "
            f"{endings['certified'] + endings['compliant']:>10} {endings['compliant']:>10} {endings['failed']:>14} "
            f"{slow:>9}"
        )
    certain = sum(r.ending != "failed" for r in combinations)
    good = sum(r.good for r in combinations)
    lines += ["", f"  certified or refused before the solve: {100 * certain / len(combinations):.2f} %"]
    lines.append(f"  and within 2 s of processor time: {100 * good / len(combinations):.2f} %")
    reasons = Counter((r.status, r.why) for r in combinations if r.ending == "refused")
    lines += [f"    refused {count}: {status}: {why}" for (status, why), count in reasons.most_common()]
    asked = [r for r in combinations if r.ending != "refused"]
    strict = sum(r.ending != "failed" and r.strict_kkt_error <= 1e-4 for r in asked)
    lines.append(f"  residual in units of P A / N for stiff plies, too, below 1e-4: {strict} of {len(asked)} solved")
    for low, high in ((0, 60), (60, 150), (150, 400), (400, 2000)):
        ms = np.array([r.ms for r in asked if low < r.nodes <= high])
        if ms.size:
            lines.append(f"  {low + 1:>4} to {high:>4} nodes: {ms.size:>4} solves, median {np.median(ms):.1f} ms, "
                         f"99 % {np.quantile(ms, 0.99):.1f} ms, worst {ms.max():.1f} ms")  # fmt: skip
    lines += ["", *_seconds(asked), "", "Each that was not certified, or took longer than 2 s:"]
    for r in asked:
        if not r.good:
            lines.append(
                f"  seed {r.seed} number {r.number}: {r.ending}, {r.status}; {r.why or 'certified'}; "
                f"it {r.iterations}, {r.ms:.0f} ms, {r.ms / max(1, r.iterations):.0f} an iteration, "
                f"{r.nodes} nodes; {r.case.text()}"
            )
    return "\n".join(lines) + "\n"


def _seconds(asked: list[Row]) -> list[str]:
    """Return what extended precision says of the answers."""
    held = [r for r in asked if np.isfinite(r.exact_residual)]
    sure = [r for r in held if r.exact_left <= LEFT and r.exact_moved <= MOVED]
    lines = [
        f"Answers of up to {SMALL} nodes held against extended precision (second.py): forces of its own, in 64 binary",
        f"digits, and Newton's method. Confirmed: they balance to {LEFT:g} of the vacuum on a node, at most {MOVED:g} "
        "spacings away.",
        f"  {'condition number':<18} {'answers':>8} {'confirmed':>10} {'largest residual':>17} {'left':>9} "
        f"{'farthest way':>13}",
    ]
    for text, low, high in (("below 1e6", 0, 1e6), ("1e6 to 1e10", 1e6, ILL), ("above 1e10", ILL, np.inf)):
        of = [r for r in held if low <= min(r.condition, 1e300) < high]
        if of:
            residual, left, moved = (max(getattr(r, f"exact_{k}") for r in of) for k in ("residual", "left", "moved"))
            confirmed = sum(r in sure for r in of)
            lines.append(f"  {text:<18} {len(of):>8} {confirmed:>10} {residual:>17.1e} {left:>9.1e} {moved:>13.1e}")
    lines += [
        f"    not confirmed: seed {r.seed} number {r.number}: condition {r.condition:.0e}, residual "
        f"{r.exact_residual:.0e}, left {r.exact_left:.0e}, moved {r.exact_moved:.0e}; {r.case.text()}"
        for r in held
        if r not in sure
    ]
    return lines


def picture(combinations: list[Row], path: Path) -> None:
    """Draw the solve's time over each parameter, coloured by how the solve ended."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt
    from matplotlib.ticker import SymmetricalLogLocator

    colours = {"certified": "#2a78b5", "compliant": "#e0a030", "failed": "#c02020"}
    names = {
        "pressure_mpa": "pressure, MPa", "young_mpa": "E, MPa", "shear_mpa": "G, MPa", "thickness_mm": "thickness, mm",
        "friction": "friction", "spacing_mm": "spacing, mm", "nodes": "nodes", "bump": "bump height / spacing",
        "tilt_deg": "tilt, degrees", "curvature": "curvature (1: sharpest)", "offset_mm": "offset, mm",
    }  # fmt: skip
    figure, axes = plt.subplots(3, 4, figsize=(16, 10), sharey=True)
    for axis, (name, label) in zip(axes.flat, names.items(), strict=False):
        for ending, colour in colours.items():
            of = [r for r in combinations if r.ending == ending]
            x = np.array([float(getattr(r.case, name)) for r in of])
            axis.scatter(
                x, [r.ms for r in of], s=5 if ending == "certified" else 18, c=colour, label=f"{ending} ({len(of)})"
            )
        if name not in ("tilt_deg", "curvature"):
            least = min(float(getattr(r.case, name)) or np.inf for r in combinations)
            threshold = 10 ** np.floor(np.log10(least))
            axis.set_xscale("symlog", linthresh=threshold)
            locator = SymmetricalLogLocator(base=10.0, linthresh=threshold)
            locator.set_params(numticks=6)  # more labels would overlap
            axis.xaxis.set_major_locator(locator)
        axis.set_yscale("log")
        axis.set_xlabel(label)
    for axis in axes[:, 0]:
        axis.set_ylabel("ms a solve")
    axes.flat[-1].axis("off")
    axes.flat[-1].legend(*axes.flat[0].get_legend_handles_labels(), loc="center")
    figure.suptitle(
        f"{len(combinations)} random combinations over all ranges: how each solve ended, and how long it took"
    )
    figure.tight_layout()
    figure.savefig(path, dpi=80)


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=400, help="cases of a draw")
    parser.add_argument("--draws", type=int, nargs="*", default=[1, 2, 3, 4, 5], help="seeds")
    parser.add_argument("--method", default="auto")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent)
    parser.add_argument("--workers", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--deadline", type=float, default=600.0, help="seconds of wall time that a solve may take")
    options = parser.parse_args()
    dumps = Path("build/stress")
    dumps.mkdir(parents=True, exist_ok=True)
    draws = [(-1, list(one_at_a_time()))]
    draws += [
        (seed, [("combination", case) for case in latin_hypercube(options.count, seed)]) for seed in options.draws
    ]
    rows: list[Row] = []
    options.out.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(options.workers) as pool:
        for seed, cases in draws:
            jobs = [
                Job(group, case, seed, k, options.method, str(dumps), options.deadline)
                for k, (group, case) in enumerate(cases)
            ]
            rows += pool.map(run, jobs, chunksize=4)
            write(rows, options.out)


def write(rows: list[Row], out: Path) -> None:
    """Write the table, the rows and the picture."""
    combinations = [r for r in rows if r.seed >= 0]
    with (out / "stress.csv").open("w", newline="") as file:
        names = {"nodes": "net_nodes", "movable": "net_movable"}  # a case has fields of these names, too
        results = [names.get(k, k) for k in asdict(rows[0]) if k != "case"]
        writer = csv.DictWriter(file, [*asdict(Case()), *results])
        writer.writeheader()
        for r in rows:
            row = asdict(r)
            writer.writerow({**row.pop("case"), **{names.get(k, k): v for k, v in row.items()}})
    if combinations:
        (out / "stress.txt").write_text(table([r for r in rows if r.seed < 0], combinations))
        picture(combinations, out / "stress.png")


if __name__ == "__main__":
    main()
