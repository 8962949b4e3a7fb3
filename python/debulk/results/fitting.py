"""Checks whether a report's verdict follows from its pockets, and theirs from their figures: files can be edited."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from debulk._core import InputError
from debulk.net import FREE
from debulk.results.advice import hole_line, is_off, level_line, wrinkle_line
from debulk.results.bridge_section import BridgeSection
from debulk.results.compose import compose
from debulk.results.edge_friction import edge_friction_line
from debulk.results.half_seen import HalfSeen, at_best, half_seen_line, or_undecided
from debulk.verdict import Verdict, criteria_of, judge

if TYPE_CHECKING:
    from debulk.recipe import Recipe
    from debulk.results.report import ExcessReport, PocketReport, ReportData

_REMEDY = "was the file edited? Inspect the scan again"


def check_fits(report: ReportData) -> None:
    """Refuse a report whose verdict is better than its figures allow; the error says what it does not fit.

    The verdict of a layup is the one that its findings allow, and at least as severe as that of each pocket, and as
    each hole allows. CEASE needs enough coverage, a good level and no wrinkle, and for each pocket figures within the
    recipe's limits that are proven, by a certificate or because no fibre can bridge. A pocket's verdict may be more
    severe than its figures, since other reasons may not appear as figures.
    """
    _check_complete(report.pockets)
    recipe = _recipe(report)
    for pocket in report.pockets:
        if pocket.bridge_section is not None:
            _check_bridge(pocket, pocket.bridge_section)
        if pocket.verdict is Verdict.CEASE:
            _check_ceases(pocket, recipe)
        if pocket.half_seen is not None:
            _check_half_seen(pocket, pocket.half_seen, recipe.segmentation.area_tol_mm2)
    worst = max(report.pockets, key=lambda pocket: pocket.verdict, default=None)
    if worst is not None and report.verdict < worst.verdict:
        raise _unfit(report, f" pocket {worst.id}, {worst.verdict}")
    _check_beside_pockets(report, recipe)
    _check_findings(report)
    seen = report.coverage
    least = recipe.verdict.min_coverage
    if report.verdict is Verdict.CEASE and (seen is None or not seen >= least):
        share = "unknown" if seen is None else f"{seen:.4g}"
        raise _unfit(report, f" coverage, which is {share}, at least {least:g} is needed")


def _unfit(record: ReportData | PocketReport, what: str) -> InputError:
    """Return the error that the verdict of a report or of one of its pockets does not fit something."""
    pocket = getattr(record, "id", None)
    name = "verdict" if pocket is None else f"pockets[{pocket - 1}].verdict"
    return InputError(f"{name}: {record.verdict} does not fit{what}; {_REMEDY}")


def _check_findings(report: ReportData) -> None:
    if report.findings:
        judged = compose(report.findings)
        if judged.verdict is not report.verdict:
            raise _unfit(report, f" the findings, {judged.verdict}: {judged.reason}")
    elif report.verdict is Verdict.CEASE:
        raise InputError(f"findings: expected those that {report.verdict} follows from, got none; {_REMEDY}")


def _check_beside_pockets(report: ReportData, recipe: Recipe) -> None:
    for hole in report.unseen:
        if hole.at_best is not None and report.verdict < hole.at_best:
            raise _unfit(report, f" {hole_line(hole)}, {hole.at_best}")
    if report.verdict is not Verdict.CEASE:
        return
    if report.wrinkles:
        raise _unfit(report, f" {wrinkle_line(report.wrinkles[0])}")
    if report.level is not None and is_off(report.level, recipe.model_dump()):
        raise _unfit(report, f" the level: {level_line(report.level)}")


def _check_complete(pockets: Sequence[PocketReport]) -> None:
    numbers = [pocket.id for pocket in pockets]
    if numbers != list(range(1, len(numbers) + 1)):
        lacking = min(set(range(1, len(numbers) + 1)) - set(numbers), default=0)
        raise InputError(f"pockets: expected all from 1 to {len(numbers)} in order, {lacking} is missing; {_REMEDY}")


def _check_ceases(pocket: PocketReport, recipe: Recipe) -> None:
    solve, excess = pocket.solve, pocket.excess
    rms, ridge, bridge = (
        math.nan if value is None else value
        for value in (pocket.rms_mm, pocket.ridge_height_mm, pocket.bridge_height_mm or 0.0)
    )
    try:
        judged = judge(
            certified=solve is not None and solve.certified,
            rms_mm=rms,
            ridge_height_mm=ridge,
            bridge_height_mm=bridge,
            rms_range_mm=pocket.rms_range_mm,
            ridge_range_mm=pocket.ridge_range_mm,
            compliant=solve is not None and solve.compliant,
            coverage=pocket.measured_share,
            inside_ply=excess is not None or pocket.decided_by == "excess",
            excess_range_mm=None if excess is None else excess.range_mm,
            bridge_range_mm=None if pocket.bridge_section is None else pocket.bridge_section.range_mm,
            criteria=criteria_of(recipe),
        )
    except InputError as error:
        raise InputError(f"pockets[{pocket.id - 1}].{error}; {_REMEDY}") from None
    if judged.verdict is not Verdict.CEASE:
        raise _unfit(pocket, f" its figures: {judged.reason}")
    if excess is not None and not _cannot_bridge(pocket, excess, recipe):
        raise _unfit(
            pocket, ": it may bridge, and neither sections of its fibres nor a certified minimum say that it does not"
        )
    both = pocket.edge_friction
    if both is None and _slips(pocket, recipe):
        raise _unfit(pocket, ": it lies at the ply's edge, and what becomes of it with its rim held is missing")
    if both is not None and {both.slipping.verdict, both.held.verdict} != {Verdict.CEASE}:
        raise _unfit(pocket, f": it {edge_friction_line(both)}")


def _cannot_bridge(pocket: PocketReport, excess: ExcessReport, recipe: Recipe) -> bool:
    from debulk.recipe import options

    certified = pocket.solve is not None and pocket.solve.certified
    return certified or pocket.bridge_section is not None or options.cannot_bridge(excess.bridge_bound_mm, recipe)


def _slips(pocket: PocketReport, recipe: Recipe) -> bool:
    """Tell whether friction at the ply's edge plays a part in a pocket that ceases."""
    free = pocket.net is not None and bool((pocket.net.kinds == FREE).any())
    by_minima = pocket.decided_by != "excess" and recipe.verdict.criterion == "excess"
    return free and by_minima and recipe.material.friction > 0


def _check_half_seen(pocket: PocketReport, half: HalfSeen, area_tol_mm2: float) -> None:
    best = or_undecided(at_best(half, area_tol_mm2), pocket.promoted)
    if pocket.verdict < best:
        raise _unfit(pocket, f": it {half_seen_line(half)}; {best} at best")


def _check_bridge(pocket: PocketReport, section: BridgeSection) -> None:
    """Refuse sections that no inspection writes."""
    low, high = section.range_mm
    if not 0 <= low <= section.height_mm <= high:
        raise InputError(
            f"pockets[{pocket.id - 1}].bridge_section: expected 0 <= range_mm[0] <= height_mm <= range_mm[1], got "
            f"{low:.4g}, {section.height_mm:.4g} and {high:.4g}; {_REMEDY}"
        )


def _recipe(report: ReportData) -> Recipe:
    """Check the settings as well, because the text and the page of a report read them."""
    from debulk.recipe import Recipe

    try:
        return Recipe(**report.recipe)
    except InputError as error:
        raise InputError(f"recipe: {error}") from None
