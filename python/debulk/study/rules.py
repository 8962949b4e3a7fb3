"""Rules for the number of starts: what each costs and how well it decides, drawn from the references' own starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from debulk import starts, verdict
from debulk.recipe import Recipe
from debulk.study.cases import Case
from debulk.study.runs import DECIDED, Reference, Start

AMPLITUDE = 0.1  # of the solver's own perturbations
ORDERS = 20  # random orders of the perturbed starts, over which a rule is averaged
_FIXED = (1, 2, 3, 4, 6, 8, 12, 16, 24)
_MOST = (4, 8, 12, 16, 24)
_WINDOWS = (0.5, 1.0, 1.5)  # of the recipe's


@dataclass(frozen=True)
class Rule:
    """A rule over all pockets and orders."""

    starts: int
    most_starts: int
    close_ridge_mm: float
    close_rms_mm: float
    starts_mean: float
    starts_p90: float
    cpu_mean_ms: float
    cpu_p99_ms: float
    undecided: float  # share of pockets
    found: float  # share of the undecidable pockets that it calls so
    overconfident: float  # share of pockets: decided, though undecidable
    contrary: float  # share of all starts that end on the other side of the decisions
    flipped: float  # share of pockets decided otherwise than the least energy
    opposite: float  # share of pairs of runs that decide a pocket in opposite ways


def rules(solved: Sequence[tuple[Case, Reference]]) -> list[Rule]:
    """Try fixed numbers of starts, and further ones close to a limit, with several windows."""
    usual = Recipe().solve
    every = [usual.model_copy(update={"starts": n, "most_starts": n}) for n in _FIXED]
    every += [
        usual.model_copy(
            update={
                "starts": first,
                "most_starts": most,
                "close_ridge_mm": width * usual.close_ridge_mm,
                "close_rms_mm": width * usual.close_rms_mm,
            }
        )
        for first in (2, 3)
        for most in _MOST
        for width in (_WINDOWS if most == usual.most_starts and first == usual.starts else (1.0,))
    ]
    there = min((sum(s.amplitude == AMPLITUDE for s in r.starts) for _, r in solved), default=0) + 1
    return [_rule(solved, Recipe(solve=wanted)) for wanted in every if wanted.most_starts <= there]


def _rule(solved: Sequence[tuple[Case, Reference]], recipe: Recipe) -> Rule:
    table = np.array([[_outcome(case, reference, recipe, k) for k in range(ORDERS)] for case, reference in solved])
    counts, ms, cease, crease, contrary, flipped = np.moveaxis(table, 2, 0)
    undecidable = np.array([r.verdict_of_all is verdict.Verdict.UNDECIDED for _, r in solved])
    decided = cease + crease
    return Rule(
        starts=recipe.solve.starts,
        most_starts=recipe.solve.most_starts,
        close_ridge_mm=recipe.solve.close_ridge_mm,
        close_rms_mm=recipe.solve.close_rms_mm,
        starts_mean=float(counts.mean()),
        starts_p90=float(np.quantile(counts, 0.9, method="higher")),
        cpu_mean_ms=float(ms.mean()),
        cpu_p99_ms=float(np.quantile(ms, 0.99, method="higher")),
        undecided=float(1 - decided.mean()),
        found=float(1 - decided[undecidable].mean()) if undecidable.any() else 1.0,
        overconfident=float((decided * undecidable[:, None]).mean()),
        contrary=float(contrary.mean()),
        flipped=float(flipped.mean()),
        opposite=float(np.mean(2 * cease.mean(axis=1) * crease.mean(axis=1))),
    )


def _outcome(case: Case, reference: Reference, recipe: Recipe, order: int) -> list[float]:
    """Return starts, ms, CEASE, CREASE, contrary and flipped of one order of a pocket's starts."""
    pool = [s for s in reference.starts if s.amplitude == AMPLITUDE]
    shuffled = np.random.default_rng([case.layup, case.pocket, order]).permutation(len(pool))
    ordered = [next(s for s in reference.starts if s.amplitude == 0), *(pool[i] for i in shuffled)]
    count = recipe.solve.starts
    while count < recipe.solve.most_starts and starts.close(_figures(ordered[:count]), recipe):
        count += 1
    taken = ordered[:count]
    good = [s for s in taken if s.certified]
    judged = verdict.Verdict.UNDECIDED
    if good:
        best = min(good, key=lambda s: s.energy_mj)
        judged = case.judge(reference.solution, best.figures, _figures(good))
    decided = judged in DECIDED
    other = next((v for v in DECIDED if v is not judged), judged)
    return [
        count,
        sum(s.cpu_ms for s in taken),
        float(judged is verdict.Verdict.CEASE),
        float(judged is verdict.Verdict.CREASE),
        float(np.mean([v is other for v in reference.verdicts])) if decided else 0.0,
        float(decided and reference.verdict is other),
    ]


def _figures(of: Sequence[Start]) -> list[starts.Figures]:
    return [s.figures for s in of if s.certified]
