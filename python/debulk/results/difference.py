"""What differs between two reports: verdicts, places, figures, and the settings of their recipes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from debulk.results.deciding import worst_first
from debulk.results.number import number
from debulk.words import in_mm

if TYPE_CHECKING:
    from debulk.results.report import PocketReport, ReportData

_SAME_PLACE_MM = 15.0  # pockets whose centroids are nearer than this, or than the smaller one is wide, are the same
_SAME_MM = 0.005  # ridges that differ by less are the same when rounded


class Place(NamedTuple):
    """A place at which the first report has a pocket, the second, or both."""

    first: PocketReport | None
    second: PocketReport | None

    @property
    def rise_mm(self) -> float | None:
        """By how much the second ridge is the higher one; None without both."""
        ridges = [pocket and pocket.deciding_ridge for pocket in self]
        return None if None in ridges else ridges[1].height_mm - ridges[0].height_mm  # type: ignore[union-attr]

    @property
    def differs(self) -> bool:
        """Whether the verdict, or the ridge as it is shown, differs."""
        if self.first is None or self.second is None or self.first.verdict is not self.second.verdict:
            return True
        low, high = _heights(self)
        return low != high and not abs(self.rise_mm or math.inf) < _SAME_MM


class SettingChange(NamedTuple):
    """A setting of two recipes that differs, with both values in words."""

    name: str
    first: str
    second: str


def places(first: ReportData, second: ReportData) -> list[Place]:
    """Return every place, those of both reports first, the most severe ones first of each.

    Pockets are paired by their places, as their numbers follow from their areas.
    """
    pairs, only_first, only_second = _paired(first, second)
    alone = [Place(pocket, None) for pocket in only_first] + [Place(None, pocket) for pocket in only_second]
    return [*(Place(*pair) for pair in pairs), *alone]


def report_difference(first: ReportData, second: ReportData) -> list[str]:
    """Return a line for each difference, the most severe first; empty if verdicts, places and settings are the same.

    Of two reports of a scan with other settings this shows what the settings change; of two scans of a ply, what
    happened to it.
    """
    lines = [] if first.verdict is second.verdict else [f"verdict: {first.verdict}, then {second.verdict}"]
    lines += [_line(place) for place in places(first, second) if place.differs]
    return lines + recipe_difference(first.recipe, second.recipe)


def _line(place: Place) -> str:
    a, b = place
    if a is None or b is None:
        known, which = (b, "second") if a is None else (a, "first")
        return f"{_name(known)}: {known.verdict}, only in the {which}"  # type: ignore[arg-type, union-attr]
    verdicts = f"{a.verdict}" if a.verdict is b.verdict else f"{a.verdict}, then {b.verdict}"
    low, high = _heights(place)
    return f"{_name(a)}, pocket {b.id} then: {verdicts}; ridge {low}, then {high} mm"


def _heights(place: Place) -> list[str]:
    ridges = [pocket and pocket.deciding_ridge for pocket in place]
    return [number(ridge.height_mm if ridge else None, 2) for ridge in ridges]


def recipe_difference(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[str]:
    """Return a line for each setting that differs."""
    return [f"recipe, {one.name}: {one.first}, then {one.second}" for one in changes(first, second)]


def changes(first: Mapping[str, Any], second: Mapping[str, Any]) -> list[SettingChange]:
    """Return the settings that differ, in the order of the recipe."""
    settings = [dict(_settings(recipe)) for recipe in (first, second)]
    names = [*settings[0], *(name for name in settings[1] if name not in settings[0])]
    every = [SettingChange(name, *(_told(one, name) for one in settings)) for name in names]
    return [one for one in every if one.first != one.second]


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
    return f"pocket {pocket.id} at {in_mm(pocket.centroid_mm or (math.nan, math.nan))}"
