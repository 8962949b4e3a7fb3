"""Running the study and writing its tables."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from contextlib import nullcontext
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path

from debulk.recipe import Recipe
from lab.study.cases import Case, cases
from lab.study.minima import Growth, Perturbation, growth, perturbations
from lab.study.plan import Plan
from lab.study.rules import Rule, rules
from lab.study.runs import Reference, Row, Setting, converge, run
from lab.study.summary import Line, lines, write_csv

_Layup = tuple[list[tuple[Case, Reference]], list[Row]]
_LIGHT = ("tolerance", "starts", "stiffness")


@dataclass
class Results:
    """Everything that the study found."""

    plan: Plan
    settings: list[Setting]
    rows: list[Row] = field(default_factory=list)
    references: list[tuple[Case, Reference]] = field(default_factory=list)  # every pocket and size of net that has one
    load_before: float = 0.0
    load_after: float = 0.0

    @property
    def default_size(self) -> int:
        """Number of nodes per net according to the recipe."""
        return Recipe().net.node_target

    @cached_property
    def solved(self) -> list[tuple[Case, Reference]]:
        """References of the recipe's size of net."""
        return [(c, r) for c, r in self.references if c.node_target == self.default_size]

    @cached_property
    def lines(self) -> list[Line]:
        """One line per setting."""
        return lines(self.rows)

    @cached_property
    def growth(self) -> list[Growth]:
        """Results over numbers of starts."""
        most = self.plan.reference_starts + 1
        return growth(self.solved, tuple(sorted({n for n in (1, 2, 3, 4, 6, 8, 12, 16, 24) if n < most} | {most})))

    @cached_property
    def perturbations(self) -> list[Perturbation]:
        """Results over sizes of perturbation."""
        return perturbations(self.solved)

    @cached_property
    def rules(self) -> list[Rule]:
        """Results over rules for the number of starts."""
        return rules(self.solved)

    def sweep(self, name: str) -> list[Line]:
        """Lines of one sweep."""
        return [line for line in self.lines if line.sweep == name]

    @cached_property
    def text(self) -> str:
        """The tables as plain text."""
        from lab.study.text import study_text

        return study_text(self)


def collect(plan: Plan, settings: list[Setting], progress: Callable[[str, float], None], workers: int = 1) -> Results:
    """Solve every pocket under every setting; with several workers, each process takes a layup at a time."""
    results = Results(plan, settings, load_before=os.getloadavg()[0])
    jobs = list(enumerate(plan.layups))
    solve_one = partial(_layup, plan, settings, results.default_size)
    with ProcessPoolExecutor(workers) if workers > 1 else nullcontext() as pool:
        found: Iterable[_Layup] = pool.map(solve_one, jobs) if pool else map(solve_one, jobs)
        for done, (layup, (references, rows)) in enumerate(zip(plan.layups, found, strict=True), start=1):
            results.references += references
            results.rows += rows
            progress(f"layup {layup}", done / len(jobs))
    results.load_after = os.getloadavg()[0]
    progress("tables", 1.0)
    return results


def _layup(plan: Plan, settings: list[Setting], usual_size: int, job: tuple[int, int]) -> _Layup:
    number, seed = job
    heavy = number < plan.heavy_layups
    middle = plan.amplitudes[len(plan.amplitudes) // 2]
    references: list[tuple[Case, Reference]] = []
    rows: list[Row] = []
    sizes = tuple(sorted({s.node_target for s in settings}))
    for case in next(cases((seed,), sizes, Recipe(), plan.pixels, plan.pockets)):
        usual = case.node_target == usual_size
        if not usual and not heavy:
            continue
        reference = converge(
            case,
            plan.amplitudes if usual else (middle,),
            plan.reference_starts if usual else plan.other_sizes_starts,
            plan.deadline_s,
        )
        if reference is not None:
            references.append((case, reference))
        wanted = [s for s in settings if s.node_target == case.node_target and (heavy or s.sweep in _LIGHT)]
        rows += [run(case, setting, reference, plan.deadline_s) for setting in wanted]
    return references, rows


def write(results: Results, folder: Path) -> None:
    """Write study.txt and the tables."""
    write_csv(folder / "settings.csv", results.lines)
    write_csv(folder / "runs.csv", results.rows)
    write_csv(folder / "starts.csv", results.growth)
    write_csv(folder / "rules.csv", results.rules)
    write_csv(folder / "perturbations.csv", results.perturbations)
    write_csv(folder / "references.csv", [_reference_line(c, r) for c, r in results.references])
    (folder / "study.txt").write_text(results.text, encoding="utf-8")


def _reference_line(case: Case, reference: Reference) -> dict[str, object]:
    good = [s for s in reference.starts if s.certified]
    rms, ridge = [s.figures.rms_mm for s in good], [s.figures.ridge_height_mm for s in good]
    return {
        "layup": case.layup,
        "pocket": case.pocket,
        "node_target": case.node_target,
        "nodes": len(case.net.nodes_mm),
        "spacing_mm": case.net.spacing_mm,
        "area_mm2": case.net.area_mm2,
        "starts": len(reference.starts),
        "certified": len(good),
        "energy_mj": reference.solution.energy_mj,
        "depth_mj": reference.depth_mj,
        "rms_mm": reference.figures.rms_mm,
        "rms_low_mm": min(rms),
        "rms_high_mm": max(rms),
        "ridge_mm": reference.figures.ridge_height_mm,
        "ridge_low_mm": min(ridge),
        "ridge_high_mm": max(ridge),
        "verdict": reference.verdict.value,
        "verdict_of_all": reference.verdict_of_all.value,
    }
