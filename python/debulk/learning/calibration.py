"""From a history to a limit: what its outcomes support, what that limit would have cost, and what is still needed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError
from debulk.arguments import typed
from debulk.history.store import History
from debulk.history.tables import connected, counting_outcomes
from debulk.learning.detection import Pod, pod
from debulk.learning.likelihood import Outcomes, Posterior, Prior, posterior
from debulk.recipe import Recipe
from debulk.ridge import excess_of_ridge

_FOLDS = 5
_LEAST = 10  # outcomes: with fewer the prior speaks
_SHOWN = 10
_RIDGES_MM = np.linspace(0.0, 2.0, 401)


@dataclass(frozen=True)
class Costs:
    """What a crease costs that was passed, and a rework that was not needed, in any one unit."""

    missed: float = 20.0
    needless: float = 1.0

    def __post_init__(self) -> None:
        if not (0 < self.missed < math.inf and 0 < self.needless < math.inf):
            raise InputError(f"costs: expected positive numbers, got {self.missed!r} and {self.needless!r}")

    @property
    def share(self) -> float:
        """The probability of a crease above which a rework costs less than to pass the pocket."""
        return self.needless / (self.needless + self.missed)


@dataclass(frozen=True)
class Validated:
    """Costs per outcome of a limit that the outcomes in question had no part in.

    `own` is that of limits calibrated on four fifths of the outcomes each, `present` that of the present recipe;
    `log_score` is the mean logarithm of the probability that was given to what happened (0 is best, -0.69 a coin).
    """

    own: float
    present: float
    log_score: float


@dataclass(frozen=True, eq=False)
class Calibrated:
    """What the outcomes of a history support."""

    outcomes: Outcomes
    posterior: Posterior
    """`outcomes`, `posterior`: the outcomes, and what they say of the limit at which half of all pockets crease."""
    costs: Costs
    limit_mm: float
    """`costs`, `limit_mm`: the costs, and the largest ridge for which passing a pocket costs no more than reworking it:
    the limit that is proposed for ``verdict.max_ridge_mm``, rounded down to 0.01 mm. 0 if no ridge is worth passing,
    or only less than a ply has that makes no ridge."""
    present_mm: float
    excess_mm: float
    """`present_mm`, `excess_mm`: the limit of the recipe that is compared; the excess length that gives a ridge of
    `limit_mm`."""
    validated: Validated
    """Cross-validated costs."""
    wanted_mm: float
    more_best: int
    more_usual: int | None
    """`wanted_mm`, `more_best`, `more_usual`: half the width of the 95 % interval that is wanted; how many more
    outcomes that needs, of pockets whose ridges lie in `best_mm`, and of pockets as the history has them. Rounded up; 0
    if it is reached. None: the history's pockets tell nothing."""
    best_mm: tuple[float, float]
    """Ridges whose outcomes tell at least half as much as the best one does."""
    ask: tuple[tuple[int, int, float], ...]
    """(record, pocket, ridge in mm) of pockets in `best_mm` whose outcome is not known, the newest first."""
    detected: Pod | None
    """What is detected of which measured size; None where the outcomes do not give a curve, and `not_detected` says
    why."""
    not_detected: str = ""
    undecided: int = 0
    others: int = 0
    """`undecided`, `others`: pockets with outcomes that are UNDECIDED or INVALID alone, or taken back so: each limit is
    as likely by them; and those of plies of another thickness or bulk factor, to which no limit carries over."""

    def proposed(self, recipe: Recipe) -> Recipe:
        """Return the recipe with the limit that is proposed, and with what is known of it for the probabilities.

        Raises
        ------
        InputError
            If no limit is proposed: by these outcomes no ridge is worth passing.
        """
        if not self.limit_mm:
            raise InputError("by these outcomes no ridge is worth passing: no limit is proposed")
        found = self.posterior
        known = {"crease_mm": found.limit_mm, "limit_mm": found.limit_sd_mm, "spread_mm": found.spread_mm}
        unsure = recipe.uncertainty.model_copy(update={name: round(value, 4) for name, value in known.items()})
        limits = recipe.verdict.model_copy(update={"max_ridge_mm": self.limit_mm})
        return recipe.model_copy(update={"verdict": limits, "uncertainty": unsure})


@typed
def calibrate(
    history: History,
    present_mm: float = 0.60,
    thickness_mm: float = 0.30,
    costs: Costs | None = None,
    wanted_mm: float = 0.05,
    prior: Prior | None = None,
    bulk_factor: float = 1.2,
) -> Calibrated:
    """Learn the limit of a ridge from what became of a history's pockets.

    Outcomes are those of pockets that the excess decides: of each pocket the last that a comparison measured, or the
    last that somebody said (`History.add_outcome`), whichever is later and CEASE or CREASE. What is UNDECIDED or
    INVALID is none, and is counted. Pockets may be chosen by their ridges, for example because those above the limit
    are reworked: the model is of the outcome given the ridge. A limit does not carry over to another thickness or bulk
    factor, so outcomes of such plies do not count.

    Parameters
    ----------
    history
        The history.
    present_mm, thickness_mm
        ``verdict.max_ridge_mm`` and ``material.thickness_mm`` of the recipe.
    costs
        None: a missed crease costs twenty times a needless rework.
    wanted_mm
        Half the width of the 95 % interval of the limit that is wanted.
    prior
        None: `Prior()`.
    bulk_factor
        ``material.bulk_factor``: the thickness divided by it is what a ply without any wrinkle has. No limit is below.

    Raises
    ------
    InputError
        If there are fewer than ten outcomes, or all are the same; the message says how many there are.
    """
    if not 0 < wanted_mm < 1:
        raise InputError(f"wanted_mm: expected a width between 0 and 1 mm, got {wanted_mm!r}")
    read = _read(history, {"thickness_mm": thickness_mm, "bulk_factor": bulk_factor})
    known = read.outcomes
    creased = int(known.creased.sum())
    if len(known) < _LEAST or creased in (0, len(known)):
        raise InputError(
            f"{history.path}: expected at least {_LEAST} outcomes of pockets that their excess decided, some creased "
            f"and some not, but got {creased} creased of {len(known)}{also(read.undecided, read.others)}: "
            "run debulk compare --history, or debulk history outcome"
        )
    costs = costs or Costs()
    found = posterior(known, prior)
    limit = cost_limit_mm(found, costs)
    limit = limit if limit > thickness_mm / bulk_factor else 0.0
    best, best_mm = _best(found)
    lacking = (1.96 / wanted_mm) ** 2 - 1 / found.limit_sd_mm**2
    ridges_mm = read.ridges_mm[:: max(1, len(read.ridges_mm) // 500)]
    usual = float(found.information(ridges_mm).mean()) if len(ridges_mm) else 0.0
    ask = tuple(one for one in read.open if best_mm[0] <= one[2] <= best_mm[1])[:_SHOWN]
    detected, why = _detection(read.sizes_mm, read.hits)
    return Calibrated(
        known, found, costs, limit, present_mm, excess_of_ridge(limit, thickness_mm),
        validated(known, costs, present_mm, prior), wanted_mm, max(0, math.ceil(lacking / best)),
        max(0, math.ceil(lacking / usual)) if usual > 0 else None, best_mm, ask, detected, why, read.undecided,
        read.others,
    )  # fmt: skip


def cost_limit_mm(found: Posterior, costs: Costs) -> float:
    """Return the largest ridge, rounded down to 0.01 mm, that costs no more to pass than to rework."""
    passed = found.creases(_RIDGES_MM) <= costs.share
    if not passed[0]:
        return 0.0
    last = len(passed) - 1 if passed.all() else int(np.argmin(passed)) - 1
    return math.floor(100 * float(_RIDGES_MM[last]) + 1e-6) / 100


def validated(known: Outcomes, costs: Costs, present_mm: float, prior: Prior | None = None) -> Validated:
    """Judge each fifth of the outcomes by the limit that the others give."""
    fold = np.random.default_rng(0).permutation(len(known)) % _FOLDS
    own = present = score = 0.0
    for k in range(_FOLDS):
        test = known.part(fold == k)
        found = posterior(known.part(fold != k), prior)
        own += _cost(test, cost_limit_mm(found, costs), costs)
        present += _cost(test, present_mm, costs)
        p = np.clip(found.creases(test.ridge_mm, test.noise_mm), 1e-9, 1 - 1e-9)
        score += float(np.log(np.where(test.creased, p, 1 - p)).sum())
    return Validated(own / len(known), present / len(known), score / len(known))


def _cost(known: Outcomes, limit_mm: float, costs: Costs) -> float:
    passed = known.ridge_mm <= limit_mm
    return costs.missed * float((passed & known.creased).sum()) + costs.needless * float(
        (~passed & ~known.creased).sum()
    )


def _best(found: Posterior) -> tuple[float, tuple[float, float]]:
    """Return the most that one outcome tells, and the ridges that tell at least half of it."""
    told = found.information(_RIDGES_MM)
    good = _RIDGES_MM[told >= 0.5 * told.max()]
    return float(told.max()), (float(good[0]), float(good[-1]))


_QUERY = f"""SELECT pocket.record, pocket.id, ridge_mm, noise_mm, pocket.verdict, last.measured, last.peak_mm
FROM pocket LEFT JOIN ({counting_outcomes()}) AS last ON last.report = pocket.record AND last.pocket = pocket.id
WHERE decided_by = 'excess' AND noise_mm IS NOT NULL AND ridge_mm IS NOT NULL ORDER BY pocket.record DESC, pocket.id"""


@dataclass(frozen=True, eq=False)
class _Known:
    """What `calibrate` reads from a history."""

    outcomes: Outcomes
    sizes_mm: NDArray[np.float64]
    hits: NDArray[np.bool_]
    """`sizes_mm`, `hits`: the heights that may stand, and whether each was not passed."""
    ridges_mm: NDArray[np.float64]
    """Of all pockets."""
    open: list[tuple[int, int, float]]
    """(record, pocket, ridge in mm) of those whose outcome is not known."""
    undecided: int
    others: int
    """`undecided`, `others`: number of those of which no outcome decided, and of outcomes of other plies."""


def _read(history: History, ply: dict[str, float]) -> _Known:
    with connected(history.path) as connection:
        every = connection.execute(_QUERY).fetchall()
        recipes = connection.execute(
            "SELECT recipe, max(record) FROM layup WHERE recipe <> '' GROUP BY recipe"
        ).fetchall()
        of = dict(connection.execute("SELECT record, recipe FROM layup").fetchall())
    materials = {recipe: history.report(record).recipe.get("material", {}) for recipe, record in recipes}
    foreign = {recipe for recipe, made in materials.items() if any(made.get(k, v) != v for k, v in ply.items())}
    rows = [row for row in every if of.get(row[0]) not in foreign]
    known = [row for row in rows if row[5] in ("CEASE", "CREASE")]
    unknown = [row for row in rows if row[5] not in ("CEASE", "CREASE")]
    outcomes = Outcomes(
        np.array([row[2] for row in known], dtype=np.float64),
        np.array([row[3] for row in known], dtype=np.float64),
        np.array([row[5] == "CREASE" for row in known], dtype=bool),
    )
    sized = [(row[6], row[4] != "CEASE") for row in known if row[6] is not None and row[6] > 0]
    return _Known(
        outcomes,
        np.array([size for size, _ in sized], dtype=np.float64),
        np.array([hit for _, hit in sized], dtype=bool),
        np.array([row[2] for row in rows], dtype=np.float64),
        [row[:3] for row in unknown],
        sum(row[5] is not None for row in unknown),
        sum(row[5] is not None and of.get(row[0]) in foreign for row in every),
    )


def also(undecided: int, others: int) -> str:
    """Return how many outcomes decided nothing, and how many are of other plies, to go on with."""
    open_ones = f", and {undecided} that are UNDECIDED or INVALID" if undecided else ""
    return open_ones + (f", and {others} of plies of another thickness or bulk factor" if others else "")


def _detection(sizes: NDArray[np.float64], hits: NDArray[np.bool_]) -> tuple[Pod | None, str]:
    if not len(sizes):
        return None, "no second scan measured a size"
    try:
        return pod(sizes, hits), ""
    except InputError as error:
        return None, str(error)
