"""What differs between two reports: verdicts, places, figures, and the settings of their recipes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from debulk.results.deciding import worst_first
from debulk.results.number import number

if TYPE_CHECKING:
    from debulk.results.report import PocketReport, ReportData

__all__ = ["recipe_difference", "report_difference"]

_SAME_PLACE_MM = 15.0  # pockets whose centroids are nearer than this, or than the smaller one is wide, are the same
_SAME_MM = 0.005  # ridges that differ by less are the same when rounded


def report_difference(first: ReportData, second: ReportData) -> list[str]:
    """Return a line for each difference, the most severe first; empty if verdicts, places and settings are the same.

    Pockets are paired by their places, as their numbers follow from their areas. Of two reports of a scan with other
    settings this shows what the settings change; of two scans of a ply, what happened to it.
    """
    lines = [] if first.verdict is second.verdict else [f"verdict: {first.verdict.name}, then {second.verdict.name}"]
    pairs, only_first, only_second = _paired(first, second)
    for a, b in pairs:
        ridges = [pocket.deciding_ridge for pocket in (a, b)]
        heights = [number(ridge.height_mm if ridge else None, 2) for ridge in ridges]
        moved = [ridge.height_mm if ridge else math.nan for ridge in ridges]
        if a.verdict is not b.verdict or (not abs(moved[0] - moved[1]) < _SAME_MM and heights[0] != heights[1]):
            verdicts = a.verdict.name if a.verdict is b.verdict else f"{a.verdict.name}, then {b.verdict.name}"
            lines.append(f"{_name(a)}, pocket {b.id} then: {verdicts}; ridge {heights[0]}, then {heights[1]} mm")
    lines += [f"{_name(pocket)}: {pocket.verdict.name}, only in the first" for pocket in only_first]
    lines += [f"{_name(pocket)}: {pocket.verdict.name}, only in the second" for pocket in only_second]
    return lines + recipe_difference(first.recipe, second.recipe)


def recipe_difference(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[str]:
    """Return a line for each setting that differs.

    Examples
    --------
    >>> recipe_difference({"net": {"node_target": 90, "paths": "x"}}, {"net": {"node_target": 100, "paths": "x"}})
    ['recipe, net.node_target: 90, then 100']
    """
    settings = [dict(_settings(recipe)) for recipe in (first, second)]
    names = [*settings[0], *(name for name in settings[1] if name not in settings[0])]
    told = [(name, *(_told(one, name) for one in settings)) for name in names]
    return [f"recipe, {name}: {a}, then {b}" for name, a, b in told if a != b]


def _settings(recipe: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for section, table in recipe.items():
        if isinstance(table, Mapping):
            yield from ((f"{section}.{name}", value) for name, value in table.items())


def _told(settings: Mapping[str, Any], name: str) -> str:
    if name not in settings:
        return "unknown"
    return "not set" if settings[name] is None else str(settings[name])


def _paired(
    first: ReportData, second: ReportData
) -> tuple[list[tuple[PocketReport, PocketReport]], list[PocketReport], list[PocketReport]]:
    """Pair the pockets that lie in the same place, the nearest first."""
    near = sorted(
        (away, a.id, b.id)
        for a in first.pockets
        for b in second.pockets
        if (away := _apart(a, b)) <= max(_SAME_PLACE_MM, math.sqrt(min(a.area_mm2, b.area_mm2)))
    )
    of_first: dict[int, int] = {}
    for _, a, b in near:
        if a not in of_first and b not in of_first.values():
            of_first[a] = b
    pairs = [(pocket, second.pocket(of_first[pocket.id])) for pocket in first.pockets if pocket.id in of_first]
    pairs.sort(key=lambda pair: (-max(pair[0].verdict.severity, pair[1].verdict.severity), pair[0].id))
    alone = [pocket for pocket in worst_first(first.pockets) if pocket.id not in of_first]
    new = [pocket for pocket in worst_first(second.pockets) if pocket.id not in of_first.values()]
    return pairs, alone, new


def _apart(a: PocketReport, b: PocketReport) -> float:
    return math.dist(a.centroid_mm, b.centroid_mm) if a.centroid_mm and b.centroid_mm else math.inf


def _name(pocket: PocketReport) -> str:
    x, y = pocket.centroid_mm or (math.nan, math.nan)
    return f"pocket {pocket.id} at ({x:.0f}, {y:.0f}) mm"
