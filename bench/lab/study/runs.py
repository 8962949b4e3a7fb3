"""Solving a case under a setting, and the converged reference with which it is compared."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

import numpy as np

from debulk import _core, solve
from debulk.inspection.minima import starts
from debulk.verdict import Verdict
from lab.study.cases import Case, Figures

DECIDED = (Verdict.CEASE, Verdict.CREASE)
REFERENCE_TOLERANCE = 1e-10


@dataclass(frozen=True)
class Setting:
    """How to solve, the sweep to which the setting belongs, and its label there."""

    sweep: str
    label: str
    method: str
    starts: int
    most_starts: int  # for a pocket close to a limit
    tolerance: float
    stiffness: float
    node_target: int
    as_inspected: bool = True
    """Pockets that the excess decides get a single start for the picture, as in an inspection; others get `starts`."""


@dataclass(frozen=True, eq=False)
class Start:
    """Result of one start of the reference."""

    amplitude: float  # of its perturbation, in spacings; 0 for the deterministic start
    certified: bool  # without a compliance
    energy_mj: float
    figures: Figures
    iterations: int
    cpu_ms: float


@dataclass(frozen=True, eq=False)
class Reference:
    """The converged reference of a case: the certified start of least energy of many starts at a tight tolerance."""

    starts: tuple[Start, ...]
    solution: solve.Solution
    figures: Figures
    verdict: Verdict
    """Verdict of the least energy alone."""
    verdict_of_all: Verdict
    """Verdict of the range over all certified starts."""
    depth_mj: float
    """Fall of the energy from the initial net to the reference."""

    def gap(self, energy_mj: float) -> float:
        """Share of that fall which a solution misses; below 0 if the solution is better than the reference."""
        return (energy_mj - self.solution.energy_mj) / self.depth_mj if self.depth_mj > 0 else 0.0


@dataclass(frozen=True)
class Row:
    """Figures of a case under a setting, and those of its reference."""

    sweep: str
    label: str
    layup: int
    pocket: int
    nodes: int
    certified: bool
    compliant: bool
    status: str
    starts: int
    iterations: int
    evaluations: int
    net_ms: float
    cpu_ms: float
    length_error: float
    energy_gap: float
    rms_mm: float
    ridge_mm: float
    rms_range_mm: float
    ridge_range_mm: float
    rms_error_mm: float
    ridge_error_mm: float
    verdict: str
    reference_verdict: str
    reference_verdict_of_all: str

    @property
    def flipped(self) -> bool:
        """Whether it is decided, and the reference is decided the other way."""
        return self.verdict in DECIDED and self.reference_verdict in DECIDED and self.verdict != self.reference_verdict

    @property
    def overconfident(self) -> bool:
        """Whether it is decided, though the starts of the reference lie on both sides of a limit."""
        return self.verdict in DECIDED and self.reference_verdict_of_all == Verdict.UNDECIDED


def run(case: Case, setting: Setting, reference: Reference | None, deadline_s: float) -> Row:
    """Solve and post-process. The time is CPU time of the solving thread, without waiting for other programs."""
    picture = setting.as_inspected and case.laid.held
    names = ("method", "starts", "most_starts", "tolerance", "stiffness")
    recipe = case.recipe.model_copy(update={"solve": {name: getattr(setting, name) for name in names}})
    stop = _core.Stop()
    stop.set_deadline(deadline_s)
    began = time.thread_time()
    settled = starts.settle(case.sheet, recipe, case.post_process, stop, for_the_picture=picture)
    solution, figures = settled.solution, settled.best
    cpu_ms = 1e3 * (time.thread_time() - began)
    figured = reference.figures if reference else Figures(np.nan, np.nan, np.nan)
    return Row(
        sweep=setting.sweep,
        label=setting.label,
        layup=case.layup,
        pocket=case.pocket,
        nodes=len(case.net.nodes_mm),
        certified=solution.certified,
        compliant=solution.certificate.compliant,
        status=solution.status,
        starts=len(solution.minima),
        iterations=sum(m.iterations for m in solution.minima),
        evaluations=sum(m.evaluations for m in solution.minima),
        net_ms=case.net_ms,
        cpu_ms=cpu_ms,
        length_error=solution.length_error,
        energy_gap=reference.gap(solution.energy_mj) if reference else np.nan,
        rms_mm=figures.rms_mm,
        ridge_mm=figures.ridge_height_mm,
        rms_range_mm=float(np.ptp(settled.rms_mm)),
        ridge_range_mm=float(np.ptp(settled.ridge_mm)),
        rms_error_mm=abs(figures.rms_mm - figured.rms_mm),
        ridge_error_mm=abs(figures.ridge_height_mm - figured.ridge_height_mm),
        verdict=str(case.judge(solution, figures, settled.every)),
        reference_verdict=str(reference.verdict) if reference else "",
        reference_verdict_of_all=str(reference.verdict_of_all) if reference else "",
    )


def converge(case: Case, amplitudes: tuple[float, ...], count: int, deadline_s: float) -> Reference | None:
    """Solve from the initial net and from `count` perturbed ones of each size; None if no solution is certified."""
    tried: list[Start] = []
    best: solve.Solution | None = None
    origins = [(0.0, 0)] + [(amplitude, k) for amplitude in amplitudes for k in range(1, count + 1)]
    for amplitude, k in origins:
        origin = None if amplitude == 0 else case.perturbed(amplitude, k)
        began = time.thread_time()
        solution = solve.minimise(
            case.sheet, "interior_point", origin, seed=k, tolerance=REFERENCE_TOLERANCE, deadline_s=deadline_s
        )
        cpu_ms = 1e3 * (time.thread_time() - began)
        solution = replace(solution, minima=())
        figures = case.figures(solution)
        good = solution.certified and not solution.certificate.compliant  # with softer fibres it is a different ply
        tried.append(Start(amplitude, good, solution.energy_mj, figures, solution.iterations, cpu_ms))
        if good and (best is None or solution.energy_mj < best.energy_mj):
            best = solution
    if best is None:
        return None
    figures = case.figures(best)
    return Reference(
        starts=tuple(tried),
        solution=best,
        figures=figures,
        verdict=case.judge(best, figures, [figures]),
        verdict_of_all=case.judge(best, figures, [s.figures for s in tried if s.certified]),
        depth_mj=case.sheet.energy(case.net.nodes_mm) - best.energy_mj,
    )
