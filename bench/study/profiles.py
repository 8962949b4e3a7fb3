"""Dolan-Moré profiles of the methods: python bench/study/profiles.py [--count 120] [--deadline 5] [--out DIR].

Every method solves the 14 pockets of a virtual layup and random stress cases (bench/stress/cases.py) of small and
medium nets, from the same start and with the same deadline. Writes profile.txt, profile.csv and profile.png.
"""

from __future__ import annotations

import argparse
import os
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from textwrap import fill

import numpy as np

from debulk import InputError, _core, solve
from debulk.inspection.minima.laid_pocket import REFUSED
from debulk.recipe import Recipe
from debulk.sheet import Sheet
from lab.study import Plan
from lab.study.pictures import STYLE, profile_panel, pyplot
from lab.study.summary import ratios, write_csv

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "stress"))
from cases import build, latin_hypercube

MOST_NODES = 300
NEAR = 0.05  # share of the energy's fall within which a result is as good as the best that any method found
TOLERANCES = {"nlopt": 1e-4}  # first derivatives do not reach a smaller one; the other methods take the default


@dataclass(frozen=True, eq=False)
class Problem:
    """A problem that every method is given."""

    group: str
    name: str
    sheet: Sheet


@dataclass
class Run:
    """The result of a method on a problem."""

    group: str
    problem: str
    nodes: int
    movable: int
    method: str
    certified: bool
    status: str
    failure: str
    iterations: int
    cpu_ms: float
    energy_mj: float
    energy_gap: float = np.nan  # to the best that any method found, as a share of the fall to it


def pockets(count: int, pixels: tuple[int, int]) -> Iterator[Problem]:
    """Yield the pockets of the first virtual layup."""
    from lab.study.cases import cases

    recipe = Recipe()
    for case in next(cases((0,), (recipe.net.node_target,), recipe, pixels, count)):
        yield Problem("pockets", case.name, case.sheet)


def stress_cases(count: int) -> Iterator[Problem]:
    """Yield those of `count` combinations that are not too large and that are not refused before any method runs."""
    for k, case in enumerate(latin_hypercube(count)):
        if case.nodes > MOST_NODES:
            continue
        try:
            sheet = build(case)
        except InputError:
            continue
        if solve.minimise(sheet, max_iterations=1).status in REFUSED:
            continue
        yield Problem("stress cases", f"{k}: {case.text()}", sheet)


@contextmanager
def cpu_deadline(seconds: float) -> Iterator[_core.Stop]:
    """Give a stop that is cancelled after this much CPU time of this thread, which other programs do not use up."""
    stop, over = _core.Stop(), threading.Event()
    clock = time.pthread_getcpuclockid(threading.get_ident())
    end = time.clock_gettime(clock) + seconds

    def watch() -> None:
        while not over.wait(0.02):
            if time.clock_gettime(clock) > end:
                return stop.cancel()

    watching = threading.Thread(target=watch)
    watching.start()
    try:
        yield stop
    finally:
        over.set()
        watching.join()


def run(problem: Problem, method: str, deadline_s: float) -> Run:
    """Run one start. The time is the CPU time of the solving thread, including retries and certificate."""
    tolerance = TOLERANCES.get(method, Recipe().solve.tolerance)
    with cpu_deadline(deadline_s) as stop:
        began = time.thread_time()
        solution = solve.minimise(problem.sheet, method, stop=stop, tolerance=tolerance)
        cpu_ms = 1e3 * (time.thread_time() - began)
    return Run(
        group=problem.group,
        problem=problem.name,
        nodes=len(problem.sheet.kinds),
        movable=int(np.count_nonzero(problem.sheet.kinds != 1)),
        method=method,
        certified=solution.certified,
        status="deadline" if solution.status == "cancelled" else solution.status,
        failure=solution.certificate.failure,
        iterations=solution.iterations,
        cpu_ms=cpu_ms,
        energy_mj=solution.energy_mj,
    )


def all_runs(problems: list[Problem], methods: list[str], deadline_s: float) -> list[Run]:
    """Run every method on every problem: NLopt on one thread, the rest (Ipopt solves one at a time) on another."""
    slow = [[m for m in methods if m == "nlopt"], [m for m in methods if m != "nlopt"]]
    with ThreadPoolExecutor(2) as pool:
        found = pool.map(lambda names: [run(p, m, deadline_s) for p in problems for m in names], slow)
        runs = [r for part in found for r in part]
    start = {p.name: p.sheet.energy(p.sheet.start_mm) for p in problems}
    for name in start:
        mine = [r for r in runs if r.problem == name]
        best = min((r.energy_mj for r in mine if r.certified), default=np.nan)
        for r in mine:
            fall = start[name] - best
            r.energy_gap = (r.energy_mj - best) / fall if fall > 1e-12 * abs(best) else 0.0
    return sorted(runs, key=lambda r: (list(start).index(r.problem), methods.index(r.method)))


def solved(run: Run, most_gap: float) -> bool:
    """Return whether a run counts as solved."""
    return run.certified and not run.energy_gap > most_gap


def profiles(runs: list[Run], methods: list[str], most_gap: float) -> dict[str, list[float]]:
    """Return the ratios of the times to that of the fastest method; infinite for failures."""
    times: dict[str, dict[str, float]] = {}
    for r in runs:
        times.setdefault(r.problem, {})[r.method] = r.cpu_ms if solved(r, most_gap) else np.inf
    return ratios(list(times.values()), methods)


def groups(runs: list[Run]) -> dict[str, list[Run]]:
    """Return the runs by kind of problem, and all of them."""
    return {**{g: [r for r in runs if r.group == g] for g in dict.fromkeys(r.group for r in runs)}, "all": runs}


def table(runs: list[Run], methods: list[str], count: int, deadline_s: float, load: float) -> str:
    """Return the results as text."""
    explained = (
        f"Every method solves the pockets of virtual layup 0 and the stress cases once, from the net as laid, within "
        f"{deadline_s:g} s of a CPU. Stress cases: of {count} random combinations of bench/stress those of up to "
        f"{MOST_NODES} nodes that are not refused up front. Tolerance 1e-8, NLopt's 1e-4. CPU times of the solving "
        f"thread, retries and certificate included; other programs ran beside it (load {load:.1f}).",
        f"Solved: certified. Near: certified, and within {100 * NEAR:g} % of the energy's fall to the best certified "
        "energy of all methods. Times the fastest: share of all problems that are solved in so many times the time of "
        "the fastest method there.",
    )
    lines = ["THE METHODS ON POCKETS AND STRESS CASES (Dolan-Moré)", ""]
    for paragraph in explained:
        lines += [fill(paragraph, 110), ""]
    head = f"  {'group':<13} {'method':<15} {'problems':>8} {'solved':>7} {'near':>6} {'ms median':>10} {'99 %':>8} "
    lines.append(head + f"{'fastest':>8} {'x 2':>7} {'x 10':>7} {'x 100':>7}  not certified")
    for group, mine in groups(runs).items():
        found = profiles(mine, methods, np.inf)
        for method in methods:
            of = [r for r in mine if r.method == method]
            ms = np.array([r.cpu_ms for r in of])
            factors = np.array(found[method])
            why = Counter(r.status for r in of if not r.certified)
            lines.append(
                f"  {group:<13} {method:<15} {len(of):>8} {np.mean([r.certified for r in of]):>7.1%} "
                f"{np.mean([solved(r, NEAR) for r in of]):>6.0%} {np.median(ms):>10.1f} "
                f"{np.quantile(ms, 0.99, method='higher'):>8.0f} "
                + " ".join(f"{np.mean(factors <= f):>{w}.0%}" for f, w in ((1, 8), (2, 7), (10, 7), (100, 7)))
                + "  "
                + ", ".join(f"{status} {n}" for status, n in why.most_common())
            )
    lines += ["", "Problems that a method does not certify"]
    for name in dict.fromkeys(r.problem for r in runs if not r.certified):
        mine = [r for r in runs if r.problem == name]
        lines.append(
            f"  {name}\n      "
            + "; ".join(
                f"{r.method}: {'certified' if r.certified else f'{r.status}, {r.failure}'} ({r.cpu_ms:.0f} ms)"
                for r in mine
            )
        )
    return "\n".join(line.rstrip() for line in lines) + "\n"


def picture(runs: list[Run], methods: list[str], path: Path) -> None:
    """Draw the profiles, with one column per group and one row per criterion."""
    plt = pyplot()
    with plt.rc_context(STYLE):
        parts = groups(runs)
        figure, axes = plt.subplots(2, len(parts), figsize=(14, 11), layout="constrained", sharey=True, sharex=True)
        criteria = ((np.inf, "certified"), (NEAR, f"and within {100 * NEAR:g} % of the best energy's fall"))
        for row, (gap, criterion) in enumerate(criteria):
            for column, (group, mine) in enumerate(parts.items()):
                found = profiles(mine, methods, gap)
                problems = f"{len(mine) // len(methods)} {group if group != 'all' else 'problems, all of them'}"
                profile_panel(
                    axes[row, column],
                    {m.replace("_", " "): found[m] for m in methods},
                    [(k, ("-", "--", "-.")[k % 3]) for k in range(len(methods))],
                    f"{problems}:\n{criterion}",
                )
        for axis in axes[:, 0]:
            axis.set_ylabel("share of problems solved within that factor")
        for axis in axes.flat:
            axis.set_xlabel("CPU time over that of the fastest method")
        figure.savefig(path, metadata={"Software": "debulk"})
        plt.close(figure)


def main(arguments: list[str] | None = None) -> None:
    """Run from the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=120, help="combinations of which the stress cases are taken")
    parser.add_argument("--pockets", type=int, default=14, help="of the layup, largest first")
    parser.add_argument("--deadline", type=float, default=5.0, help="CPU seconds a solve")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder")
    options = parser.parse_args(arguments)
    methods = [m for m in solve.methods() if m != "auto"]
    load = os.getloadavg()[0]
    problems = [*pockets(options.pockets, Plan().pixels), *stress_cases(options.count)]
    runs = all_runs(problems, methods, options.deadline)
    options.out.mkdir(parents=True, exist_ok=True)
    text = table(runs, methods, options.count, options.deadline, load)
    (options.out / "profile.txt").write_text(text, encoding="utf-8")
    write_csv(options.out / "profile.csv", runs)
    picture(runs, methods, options.out / "profile.png")
    print(text)


if __name__ == "__main__":
    main()
