"""Several minima: how ranges and verdicts change with the number of starts and the size of their perturbation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from debulk import verdict
from lab.study.cases import Case
from lab.study.runs import DECIDED, Reference, Start

_ORDERS = 20  # random orders of the perturbed starts; results are averaged over them
_SAME = 1e-6  # minima whose energies differ by a smaller share of the fall count as one


@dataclass(frozen=True)
class Growth:
    """Averages over all pockets and orders for a number of `starts`, including the deterministic one."""

    amplitude: float
    starts: int
    rms_range_mm: float
    rms_range_p90_mm: float
    ridge_range_mm: float
    ridge_range_p90_mm: float
    energy_gap: float  # of the best start
    rms_error_mm: float  # of the best start, relative to the reference
    ridge_error_mm: float
    undecided: float  # share of pockets
    found: float  # share of the undecidable pockets that these starts reveal as such
    flipped: float  # share of pockets decided differently from the reference of least energy
    cpu_ms: float


@dataclass(frozen=True)
class Perturbation:
    """Results of the starts with one size of perturbation."""

    amplitude: float
    starts: int
    certified: float  # share of the starts
    minima: float  # different minima per pocket
    single: float  # share of the pockets for which all starts end in one minimum
    lowest: float  # share of pockets in which one of the starts reaches the least energy of all sizes
    iterations: float  # mean
    cpu_ms: float  # mean


def growth(solved: list[tuple[Case, Reference]], counts: tuple[int, ...]) -> list[Growth]:
    """Ranges, verdicts and errors over numbers of starts, for each size of perturbation."""
    out = []
    for amplitude in amplitudes(solved):
        for count in counts:
            samples = [_sample(case, reference, amplitude, count) for case, reference in solved]
            if any(s is None for s in samples):
                continue  # more starts than there are
            table = np.array([s for s in samples if s is not None])  # pocket, order, figure
            mean = table.mean(axis=(0, 1))
            undecidable = [r.verdict_of_all is verdict.Verdict.UNDECIDED for _, r in solved]
            out.append(
                Growth(
                    amplitude=amplitude,
                    starts=count,
                    rms_range_mm=mean[0],
                    rms_range_p90_mm=float(np.quantile(table[:, :, 0], 0.9)),
                    ridge_range_mm=mean[1],
                    ridge_range_p90_mm=float(np.quantile(table[:, :, 1], 0.9)),
                    energy_gap=mean[2],
                    rms_error_mm=mean[3],
                    ridge_error_mm=mean[4],
                    undecided=mean[5],
                    found=float(table[undecidable, :, 5].mean()) if any(undecidable) else 1.0,
                    flipped=mean[6],
                    cpu_ms=mean[7],
                )
            )
    return out


def perturbations(solved: list[tuple[Case, Reference]]) -> list[Perturbation]:
    """Summarise what the starts of each size of perturbation found."""
    out = []
    for amplitude in amplitudes(solved):
        every = [(r, [s for s in r.starts if s.amplitude == amplitude]) for _, r in solved]
        different = [_different(r, starts) for r, starts in every]
        reached = [min((s.energy_mj for s in starts if s.certified), default=np.inf) for _, starts in every]
        flat = [s for _, starts in every for s in starts]
        out.append(
            Perturbation(
                amplitude=amplitude,
                starts=len(every[0][1]),
                certified=float(np.mean([s.certified for s in flat])),
                minima=float(np.mean(different)),
                single=float(np.mean(np.array(different) <= 1)),
                lowest=float(np.mean([r.gap(e) < _SAME for (r, _), e in zip(every, reached, strict=True)])),
                iterations=float(np.mean([s.iterations for s in flat])),
                cpu_ms=float(np.mean([s.cpu_ms for s in flat])),
            )
        )
    return out


def amplitudes(solved: list[tuple[Case, Reference]]) -> list[float]:
    """Sizes of perturbation in the references."""
    return sorted({s.amplitude for _, r in solved for s in r.starts} - {0.0})


def _different(reference: Reference, starts: list[Start]) -> int:
    gaps = np.sort([reference.gap(s.energy_mj) for s in starts if s.certified])
    return int(np.count_nonzero(np.diff(gaps) > _SAME)) + 1 if gaps.size else 0


def _sample(case: Case, reference: Reference, amplitude: float, count: int) -> list[list[float]] | None:
    """Figures of `count` starts in several orders."""
    first = next(s for s in reference.starts if s.amplitude == 0)
    others = [s for s in reference.starts if s.amplitude == amplitude]
    if count - 1 > len(others):
        return None
    rng = np.random.default_rng([case.layup, case.pocket, count])
    out = []
    for _ in range(_ORDERS):
        chosen = [first, *(others[i] for i in rng.permutation(len(others))[: count - 1])]
        good = [s for s in chosen if s.certified]
        best = min(good, key=lambda s: s.energy_mj, default=first)
        figures = [s.figures for s in good or [first]]
        judged = case.judge(reference.solution, best.figures, figures) if good else verdict.Verdict.UNDECIDED
        rms, ridge = [f.rms_mm for f in figures], [f.ridge_height_mm for f in figures]
        decided = judged in DECIDED
        flipped = decided and reference.verdict in DECIDED and judged != reference.verdict
        out.append(
            [
                max(rms) - min(rms),
                max(ridge) - min(ridge),
                max(0.0, reference.gap(best.energy_mj)),
                abs(best.figures.rms_mm - reference.figures.rms_mm),
                abs(best.figures.ridge_height_mm - reference.figures.ridge_height_mm),
                float(judged is verdict.Verdict.UNDECIDED),
                float(flipped),
                sum(s.cpu_ms for s in chosen),
            ]
        )
    return out
