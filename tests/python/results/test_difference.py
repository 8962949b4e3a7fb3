"""What differs between two reports: pockets are paired by place, and settings by name."""

import dataclasses

import pytest

from debulk.results.difference import recipe_difference, report_difference
from debulk.verdict import Verdict


def test_a_report_does_not_differ_from_itself(report):
    assert report_difference(report, report) == []


def test_pockets_are_paired_by_place_and_not_by_number(report):
    turned = tuple(dataclasses.replace(p, id=8 - p.id) for p in reversed(report.pockets))
    assert report_difference(report, dataclasses.replace(report, pockets=turned)) == []


def test_verdicts_ridges_places_and_settings_that_differ_are_named(report):
    pockets = list(report.pockets)
    pockets[0] = dataclasses.replace(pockets[0], verdict=Verdict.CREASE, ridge_height_mm=0.9)
    far = dataclasses.replace(pockets[6], id=9, outline_mm=pockets[6].outline_mm - [400.0, -300.0])
    recipe = {**report.recipe, "net": {**report.recipe["net"], "node_target": 100}}
    other = dataclasses.replace(report, verdict=Verdict.CREASE, pockets=(*pockets[:6], far), recipe=recipe, findings=())
    x, y = pockets[0].centroid_mm
    assert report_difference(report, other) == [
        "verdict: INVALID, then CREASE",
        f"pocket 1 at ({x:.0f}, {y:.0f}) mm, pocket 1 then: CEASE, then CREASE; ridge 0.25, then 0.90 mm",
        f"pocket 7 at ({pockets[6].centroid_mm[0]:.0f}, {pockets[6].centroid_mm[1]:.0f}) mm: CREASE, only in the first",
        f"pocket 9 at ({far.centroid_mm[0]:.0f}, {far.centroid_mm[1]:.0f}) mm: CREASE, only in the second",
        "recipe, net.node_target: 90, then 100",
    ]


@pytest.mark.parametrize(
    ("first", "second", "line"),
    [
        ({"a": {"b": None}}, {"a": {"b": 1}}, "recipe, a.b: not set, then 1"),
        ({"a": {"b": 1}}, {"a": {}}, "recipe, a.b: 1, then unknown"),
        ({}, {"a": {"b": 1}}, "recipe, a.b: unknown, then 1"),
    ],
)
def test_a_setting_that_is_missing_is_said_to_be_unknown(first, second, line):
    assert recipe_difference(first, second) == [line]
