"""Random cases: layups of both families, half of them with a mistake, and the outcome of their inspection."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from first_family import held_excess_mm

from debulk import InputError, inspect, scenes
from debulk.recipe import Recipe
from debulk.verdict import Verdict
from lab.varied import MISTAKES, Given, Mistake, given_right, varied_layup
from lab.varied.bridges import highest_mm
from lab.varied.polygons import inside

MARGIN_MM = 0.1
"""A true ridge this far above the limit must not pass: the true excess alone decides, whatever the net gives."""
LOOSE_SHARE = 0.2
"""A ply with more than this share off the mold, besides its pockets, is not laid, and it is right to refuse it."""
LAYUPS_OF_FIRST = 40  # layups of the first family differ by seed only in places, so a few seeds show all kinds


@dataclass(frozen=True)
class Case:
    """One scene, by number: the same number and seed give the same scene."""

    number: int
    seed: int
    family: str
    layup_seed: int
    mistake: Mistake | None


def draw(number: int, seed: int) -> Case:
    """Draw a case at random: seven of ten from the second family, every second one with a mistake."""
    rng = np.random.default_rng([seed, number])
    family = "varied" if rng.random() < 0.7 else "first"
    layup_seed = int(rng.integers(LAYUPS_OF_FIRST if family == "first" else 1_000_000))
    spoiled = rng.random() < 0.5
    mistake = MISTAKES[int(rng.integers(len(MISTAKES)))] if spoiled else None
    return Case(number, seed, family, layup_seed, mistake)


def make(case: Case, pixels: tuple[int, int]) -> tuple[Any, Given]:
    """Make the layup and the data that the inspector is given."""
    make_layup = varied_layup if case.family == "varied" else scenes.layup
    layup: Any = make_layup(case.layup_seed, pixels)
    return layup, given_right(layup) if case.mistake is None else case.mistake.apply(layup, case.number)


@dataclass(frozen=True)
class Standing:
    """A place where the ply stands off the mold, and the ridge that its held excess length makes."""

    centre_mm: tuple[float, float]
    ridge_mm: float
    kinds: str


def truly(case: Case, layup: Any) -> list[Standing]:
    """Return the raised places; for the first family by the second's quadrature over its public surfaces."""
    truth = layup.truth
    if case.family == "varied":
        return [Standing(p.centre_mm, p.ridge_mm, "+".join(p.kinds)) for p in (*truth.pockets, *truth.decoys)]
    bumps = (*truth.pockets, *truth.decoys)
    return [
        Standing(bump.centre_mm, 0.5 * held_mm + 0.43 * truth.thickness_mm, bump.kind)
        for bump, held_mm in zip(bumps, held_excess_mm(layup), strict=True)
    ]


@dataclass
class Outcome:
    """The verdict on a case, and the truth about it."""

    number: int
    family: str
    layup_seed: int
    mistake: str
    note: str
    mold: str
    said: str  # cease, crease, undecided, invalid, InputError, crash, hang, or another error's name
    reason: str
    passed: bool
    true_ridge_mm: float
    true_kinds: str  # kinds of the pocket with that ridge
    true_bridge_mm: float  # the highest of a ply of the second family, if no ridge exceeds the limit; else 0
    good: bool  # nothing is wrong with the layup, all of it was seen, and the ply is laid on the mold
    blind: bool  # the case has a mistake with which nothing may pass
    missed: int  # number of creasing pockets that no pocket of the report, other than closing ones, covers
    pockets: int
    checks: str  # the checks that make the verdict worse than CEASE, each with the verdict that it allows at best
    seconds: float  # CPU time of the inspection

    @property
    def creases(self) -> bool:
        """Return whether a pocket's true ridge, or the true bridge, exceeds the limit by the margin."""
        return self.true_mm > Recipe().verdict.max_ridge_mm + MARGIN_MM

    @property
    def true_mm(self) -> float:
        """Height of what truly remains: a ridge, or the bridge of a ply that is too short."""
        return max(self.true_ridge_mm, self.true_bridge_mm)

    @property
    def false_cease(self) -> bool:
        """Return whether the case passed although a pocket creases."""
        return (self.said == "cease" or self.passed) and self.creases

    @property
    def blind_cease(self) -> bool:
        """Return whether the case passed by chance, without usable data, because no pocket creases."""
        return (self.said == "cease" or self.passed) and self.blind and not self.creases

    @property
    def false_alarm(self) -> bool:
        """Return whether the case was refused although nothing was wrong."""
        return self.good and self.said in ("invalid", "InputError")

    @property
    def closes(self) -> bool:
        """Return whether nothing is wrong, and every held excess and every bridge stay clear of the limit."""
        return self.clear and self.true_mm < Recipe().verdict.max_ridge_mm

    @property
    def false_crease(self) -> bool:
        """Return whether the verdict was crease although it closes."""
        return self.closes and self.said == "crease"

    @property
    def needlessly_undecided(self) -> bool:
        """Return whether nothing is wrong, what truly remains is clear of the limit, and the verdict was undecided."""
        return self.clear and self.said == "undecided"

    @property
    def clear(self) -> bool:
        """Return whether nothing is wrong, and what truly remains is off the limit by more than the margin."""
        return self.good and abs(self.true_mm - Recipe().verdict.max_ridge_mm) > MARGIN_MM


def run(case: Case, pixels: tuple[int, int]) -> Outcome:
    """Make a case, inspect it, and compare the report with the truth."""
    layup, given = make(case, pixels)
    standing = truly(case, layup)
    nothing = Standing((0.0, 0.0), 0.43 * layup.truth.thickness_mm, "")
    worst = max(standing, key=lambda s: s.ridge_mm, default=nothing)
    varied = case.family == "varied"
    outcome = Outcome(
        number=case.number,
        family=case.family,
        layup_seed=case.layup_seed,
        mistake="" if case.mistake is None else case.mistake.name,
        note=given.note,
        mold=layup.truth.mold_kind if varied else "crest",
        said="",
        reason="",
        passed=False,
        true_ridge_mm=round(worst.ridge_mm, 3),
        true_kinds=worst.kinds,
        true_bridge_mm=_bridge_mm(layup, worst.ridge_mm) if varied else 0.0,
        good=case.mistake is None and (not varied or (_all_seen(layup) and _loose_share(layup) <= LOOSE_SHARE)),
        blind=case.mistake is not None and case.mistake.blind,
        missed=0,
        pockets=0,
        checks="",
        seconds=0.0,
    )
    began = time.process_time()
    try:
        report = inspect(
            given.scan,
            given.reference,
            Recipe(**given.recipe),
            given.ply_outline,
            given.fibre_angles_deg,
            given.mold_from_scanner,
            given.camera,
            given.mask,
        )
    except InputError as error:
        outcome.said, outcome.reason = "InputError", str(error)
    except Exception as error:
        outcome.said, outcome.reason = type(error).__name__, str(error)
    else:
        outcome.said, outcome.reason, outcome.passed = report.verdict.value, report.reason, report.passed
        outcome.pockets = len(report.pockets)
        worse = {(f.check, f.at_best.value) for f in report.findings if f.at_best not in (None, Verdict.CEASE)}
        outcome.checks = " ".join(f"{check}:{at_best}" for check, at_best in sorted(worse))
        if case.mistake is None and outcome.said != "invalid":
            outcome.missed = _missed(standing, report)
    outcome.seconds = round(time.process_time() - began, 2)
    return outcome


def _bridge_mm(layup: Any, ridge_mm: float) -> float:
    """Return the true bridge where it matters: where no ridge creases by itself."""
    recipe = Recipe()
    return 0.0 if ridge_mm > recipe.verdict.max_ridge_mm + MARGIN_MM else round(highest_mm(layup, recipe), 3)


def _all_seen(layup: Any) -> bool:
    """Return whether so much of the layup was seen that a refusal cannot be excused."""
    truth = layup.truth
    pockets_seen = all(
        p.unseen_share < 0.1 and p.reference_unseen_share < 0.1 and p.rim_unseen_share < 0.1 for p in truth.pockets
    )
    return bool(truth.ply_seen_share > 0.985 and pockets_seen)


def _loose_share(layup: Any) -> float:
    """Return the share of the ply that its loose borders lift by more than the recipe's tolerance `level.tol_mm`."""
    low, high = layup.ply_outline.min(axis=0), layup.ply_outline.max(axis=0)
    x, y = np.meshgrid(*(np.arange(a, b, 4.0) for a, b in zip(low, high, strict=True)))
    on = inside(layup.ply_outline, x, y)
    gap = sum((b.gap(x[on], y[on]) for b in layup.truth.bumps if b.kind == "border"), np.zeros(np.count_nonzero(on)))
    return float(np.mean(gap > Recipe().level.tol_mm))


def _missed(standing: list[Standing], report: Any) -> int:
    """Return the number of creasing pockets whose top lies in no pocket of the report, apart from closing ones."""
    limit = Recipe().verdict.max_ridge_mm + MARGIN_MM
    open_ones = [p for p in report.pockets if p.verdict.value != "cease"]
    feet = [p.foot_outline_mm if len(p.foot_outline_mm) else p.outline_mm for p in open_ones]
    missed = 0
    for one in standing:
        if one.ridge_mm > limit:
            x, y = (np.array(v) for v in one.centre_mm)
            missed += not any(bool(inside(foot, x, y)) for foot in feet)
    return missed
