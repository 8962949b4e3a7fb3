"""Rules for the number of starts: the cost of each and how well it decides, sampled from the references' starts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from debulk import verdict
from debulk.inspection.minima import starts
from debulk.recipe import Recipe
from lab.study.cases import Case
from lab.study.runs import DECIDED, Reference, Start

AMPLITUDE = 0.1  # of the solver's own perturbations, in spacings
ORDERS = 20  # random orders of the perturbed starts; a rule is averaged over them
_FIXED = (1, 2, 3, 4, 6, 8, 12, 16, 24)
_MOST = (4, 8, 12, 16, 24)
_WINDOWS = (0.5, 1.0, 1.5)  # multiples of the recipe's windows
_MARGINS = (0.1, 0.5, 1.5)  # multiples of the recipe's margins, in addition to 1


@dataclass(frozen=True)
class Rule:
    """Results of a rule over all pockets and orders."""

    starts: int
    most_starts: int
    close_ridge_mm: float
    close_rms_mm: float
    ridge_margin_mm: float
    rms_margin_mm: float
    starts_mean: float
    starts_p90: float
    cpu_mean_ms: float
    cpu_p99_ms: float
    undecided: float  # share of pockets
    found: float  # share of the undecidable pockets that the rule calls undecided
    overconfident: float  # share of pockets: decided, though undecidable
    false_cease: float  # share of pockets: called CEASE, though undecidable
    contrary: float  # share of all starts that end on the other side of the decisions
    flipped: float  # share of pockets decided differently from the least energy
    opposite: float  # share of pairs of runs that decide a pocket in opposite ways


def rules(solved: Sequence[tuple[Case, Reference]]) -> list[Rule]:
    """Try fixed numbers of starts, and additional starts close to a limit with several windows and margins."""
    usual = Recipe()
    first, most = usual.solve.starts, usual.solve.most_starts
    wanted = [_recipe(n, n) for n in _FIXED]
    wanted += [_recipe(f, m) for f in (2, 3) for m in _MOST]
    wanted += [_recipe(first, most, windows=w) for w in _WINDOWS if w != 1.0]
    wanted += [_recipe(n, m, margins=w) for n, m in ((3, 3), (first, most), (first, 16)) for w in _MARGINS]
    there = min((sum(s.amplitude == AMPLITUDE for s in r.starts) for _, r in solved), default=0) + 1
    sides = [_sides(case, reference) for case, reference in solved]
    return [_rule(solved, sides, recipe) for recipe in wanted if recipe.solve.most_starts <= there]


def _recipe(first: int, most: int, windows: float = 1.0, margins: float = 1.0) -> Recipe:
    usual = Recipe()
    return usual.model_copy(
        update={
            "solve": {
                "starts": first,
                "most_starts": most,
                "close_ridge_mm": windows * usual.solve.close_ridge_mm,
                "close_rms_mm": windows * usual.solve.close_rms_mm,
            },
            "verdict": {
                "ridge_margin_mm": margins * usual.verdict.ridge_margin_mm,
                "rms_margin_mm": margins * usual.verdict.rms_margin_mm,
            },
        }
    )


def _sides(case: Case, reference: Reference) -> list[verdict.Verdict]:
    """Return on which side of the limits each certified start lies, however near."""
    sharp = Recipe().model_copy(update={"verdict": {"ridge_margin_mm": 0.0, "rms_margin_mm": 0.0}})
    return [case.judge(reference.solution, s.figures, [s.figures], sharp) for s in reference.starts if s.certified]


def _rule(solved: Sequence[tuple[Case, Reference]], sides: Sequence[Sequence[verdict.Verdict]], recipe: Recipe) -> Rule:
    table = np.array(
        [
            [_outcome(case, reference, side, recipe, k) for k in range(ORDERS)]
            for (case, reference), side in zip(solved, sides, strict=True)
        ]
    )
    counts, ms, cease, crease, contrary, flipped = np.moveaxis(table, 2, 0)
    undecidable = np.array([r.verdict_of_all is verdict.Verdict.UNDECIDED for _, r in solved])
    decided = cease + crease
    return Rule(
        starts=recipe.solve.starts,
        most_starts=recipe.solve.most_starts,
        close_ridge_mm=recipe.solve.close_ridge_mm,
        close_rms_mm=recipe.solve.close_rms_mm,
        ridge_margin_mm=recipe.verdict.ridge_margin_mm,
        rms_margin_mm=recipe.verdict.rms_margin_mm,
        starts_mean=float(counts.mean()),
        starts_p90=float(np.quantile(counts, 0.9, method="higher")),
        cpu_mean_ms=float(ms.mean()),
        cpu_p99_ms=float(np.quantile(ms, 0.99, method="higher")),
        undecided=float(1 - decided.mean()),
        found=float(1 - decided[undecidable].mean()) if undecidable.any() else 1.0,
        overconfident=float((decided * undecidable[:, None]).mean()),
        false_cease=float((cease * undecidable[:, None]).mean()),
        contrary=float(contrary.mean()),
        flipped=float(flipped.mean()),
        opposite=float(np.mean(2 * cease.mean(axis=1) * crease.mean(axis=1))),
    )


def _outcome(
    case: Case, reference: Reference, sides: Sequence[verdict.Verdict], recipe: Recipe, order: int
) -> list[float]:
    """Return starts, ms, CEASE, CREASE, contrary and flipped for one order of a pocket's starts."""
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
        judged = case.judge(reference.solution, best.figures, _figures(good), recipe)
    decided = judged in DECIDED
    other = next((v for v in DECIDED if v is not judged), judged)
    return [
        count,
        sum(s.cpu_ms for s in taken),
        float(judged is verdict.Verdict.CEASE),
        float(judged is verdict.Verdict.CREASE),
        float(np.mean([v is other for v in sides])) if decided else 0.0,
        float(decided and reference.verdict is other),
    ]


def _figures(of: Sequence[Start]) -> list[starts.Figures]:
    return [s.figures for s in of if s.certified]
