"""The stress table: python bench/stress/stress.py [--count 2000] [--method auto] [--out bench/stress].

It varies one parameter at a time, and takes Latin-hypercube combinations of all of them. Writes stress.txt, stress.csv
and stress.png, and each case that is neither certified nor refused to build/stress, for
`python -m debulk.inspection.evaluate.replay`.
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

from debulk import InputError, solve
from debulk.inspection.evaluate import replay

REFUSALS = ("too_few_movable_nodes", "no_minimum", "not_a_surface", "no net")


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


def run(job: tuple[int, str, Case, str, str, float]) -> Row:
    """Run one case."""
    number, group, case, method, dumps, deadline_s = job
    try:
        model = build(case)
    except InputError as error:
        return Row(
            group, case, "refused", "no net", str(error).split(":")[0] + ": " + str(error).split(": ", 1)[1][:60]
        )
    started = time.process_time()
    solution = solve.minimise(model, method, deadline_s=deadline_s)
    ms = 1e3 * (time.process_time() - started)
    certificate = solution.certificate
    if solution.status in REFUSALS and solution.iterations == 0:
        ending = "refused"  # before the solve; a ply that slides off during the solve counts as failed
    elif not solution.certified:
        ending = "failed"
    else:
        ending = "compliant" if certificate.compliant else "certified"
    if ending == "failed":
        replay.dump(
            Path(dumps) / f"{group.split(',')[0].replace(' ', '_')}_{number}.json", model, solution, method=method
        )
    movable = model.kinds != 1
    gaps = model.gaps(solution.nodes_mm)[movable]
    rms = float(np.sqrt(np.mean(gaps**2)) / case.spacing_mm) if movable.any() else 0.0
    why = solution.certificate.failure if ending == "failed" else ""
    return Row(
        group, case, ending, solution.status, why, len(movable), int(movable.sum()), certificate.kkt_error,
        certificate.strict_kkt_error, certificate.length_error, certificate.penetration_mm, solution.iterations,
        ms, rms,
    )  # fmt: skip


def table(rows: list[Row], combinations: list[Row]) -> str:
    """Return the table as text."""
    lines = [
        "Stress table of the solve. Times are CPU times of single runs, solve and certificate.",
        "",
    ]
    head = f"{'parameter':<20} {'case':<44} {'ending':<10} {'status':<22} {'nodes':>5} {'mov':>4} {'it':>5} {'ms':>8} "
    lines += [head + f"{'kkt':>8} {'length':>8} {'rms/spacing':>11}", "-" * 160]
    for r in rows:
        lines.append(
            f"{r.group:<20} {r.case.text()[:44]:<44} {r.ending:<10} {r.status:<22} {r.nodes:>5} {r.movable:>4} "
            f"{r.iterations:>5} {r.ms:>8.1f} {r.kkt_error:>8.1e} {r.length_error:>8.1e} {r.rms_spacings:>11.4f} {r.why}"
        )
    lines += ["", f"{len(combinations)} Latin-hypercube combinations over all ranges"]
    endings = Counter(r.ending for r in combinations)
    asked = len(combinations) - endings["refused"]
    good = endings["certified"] + endings["compliant"]
    lines.append(
        f"  refused up front {endings['refused']}, solved {asked}; certified {good}: {100 * good / max(1, asked):.2f} %"
    )
    lines.append(f"  of the certified, with a compliance: {endings['compliant']}; not certified: {endings['failed']}")
    strict = sum(r.ending in ("certified", "compliant") and r.strict_kkt_error <= 1e-4 for r in combinations)
    lines.append(f"  with the residual in units of P A / N for stiff plies, too, it would be {strict} of the {good}")
    reasons = Counter((r.status, r.why) for r in combinations if r.ending == "refused")
    for (status, why), count in reasons.most_common():
        lines.append(f"    refused, {status} {why}: {count}")
    for status, count in Counter(r.status for r in combinations if r.ending == "failed").most_common():
        lines.append(f"    not certified, {status}: {count}")
    ms = np.array([r.ms for r in combinations if r.ending != "refused"])
    size = np.array([r.nodes for r in combinations if r.ending != "refused"])
    for low, high in ((0, 60), (60, 150), (150, 400), (400, 1100)):
        of = ms[(size > low) & (size <= high)]
        if of.size:
            lines.append(f"  {low + 1:>4} to {high:>4} nodes: {of.size:>4} solves, median {np.median(of):.1f} ms, "
                         f"99 % {np.quantile(of, 0.99):.1f} ms, worst {of.max():.1f} ms")  # fmt: skip
    for r in combinations:
        if r.ending == "failed":
            lines.append(f"  not certified: {r.status}; {r.why}; it {r.iterations}, {r.ms:.0f} ms; {r.case.text()}")
    return "\n".join(lines) + "\n"


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
    figure.suptitle(f"{len(combinations)} random combinations over all ranges: how each solve ended")
    figure.tight_layout()
    figure.savefig(path, dpi=80)


def main() -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--method", default="auto")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent)
    parser.add_argument("--workers", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--deadline", type=float, default=20.0, help="seconds a solve may take")
    options = parser.parse_args()
    dumps = Path("build/stress")
    dumps.mkdir(parents=True, exist_ok=True)
    named = list(one_at_a_time()) + [("combination", case) for case in latin_hypercube(options.count)]
    jobs = [(k, group, case, options.method, str(dumps), options.deadline) for k, (group, case) in enumerate(named)]
    with ProcessPoolExecutor(options.workers) as pool:
        rows = list(pool.map(run, jobs, chunksize=4))
    single = [r for r in rows if r.group != "combination"]
    combinations = [r for r in rows if r.group == "combination"]
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "stress.txt").write_text(text := table(single, combinations))
    with (options.out / "stress.csv").open("w", newline="") as file:
        names = {"nodes": "net_nodes", "movable": "net_movable"}  # a case has fields of these names, too
        results = [names.get(k, k) for k in asdict(rows[0]) if k != "case"]
        writer = csv.DictWriter(file, [*asdict(Case()), *results])
        writer.writeheader()
        for r in rows:
            row = asdict(r)
            writer.writerow({**row.pop("case"), **{names.get(k, k): v for k, v in row.items()}})
    picture(combinations, options.out / "stress.png")
    print(text)


if __name__ == "__main__":
    main()
