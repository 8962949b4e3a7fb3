"""An outline that is not the ply's is refused, or held against the scan and named."""

from __future__ import annotations

import functools
import re

import numpy as np
import pytest

from debulk import Grid, InputError, Inspector, Recipe, Verdict, pocket, scenes
from debulk.inspection.evidence.edge_check import Outline
from lab.varied import given_right, varied_layup

PIXELS = (800, 600)


@functools.cache
def given(family):
    if family == "first":
        return given_right(scenes.layup(921, PIXELS))
    return given_right(varied_layup(923, PIXELS, borders=0, clamp=False, holes_mm=0))


@functools.cache
def prepared(family):
    g = given(family)
    return Inspector(None, g.reference, mold_from_scanner=g.mold_from_scanner).prepared


def inspect(family, regions, outline):
    g = given(family)
    recipe = Recipe(segmentation={"regions": regions})
    return Inspector(recipe, prepared(family), outline, g.fibre_angles_deg, g.mold_from_scanner).inspect(g.scan)


BOTH = pytest.mark.parametrize("family", ["first", "varied"])
MODES = pytest.mark.parametrize("regions", [True, False], ids=["regions", "whole"])


@BOTH
@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda o: o / 1000, "is it in metres"),
        (lambda o: o / 25.4 / 2, "in metres or inches|lies beside"),
        (lambda o: o + 1e9, "within 100 m of the mold frame's origin"),
        (lambda o: o * [1, 0] + [0, 1e9], "within 100 m"),
        (lambda o: o + np.array([3000, 0]), "lies beside it: the outline has x"),
        (lambda o: np.concatenate([o[: len(o) // 2], o[: len(o) // 2 - 1 : -1]]), "its sides .* and .* cross near"),
        (lambda o: o[:2], "at least 3 corners"),
        (lambda o: np.where(np.arange(len(o))[:, None] == 3, np.nan, o), "finite"),
        (lambda o: np.ma.masked_less(o, 0), "masked array"),
    ],
    ids=["metres", "half inches", "1e9", "y 1e9", "beside", "crossing", "two corners", "NaN", "masked"],
)
def test_an_impossible_outline_is_refused(family, change, reason):
    with pytest.raises(InputError, match=reason):
        inspect(family, True, change(given(family).ply_outline))


@BOTH
@MODES
@pytest.mark.parametrize("size", [15, 40, 120])
def test_a_shifted_outline_is_named_with_its_place_and_way(family, regions, size):
    outline = given(family).ply_outline
    report = inspect(family, regions, outline + size * np.array([0.8, 0.6]))
    assert report.verdict is Verdict.INVALID
    if size <= 40:
        said = re.search(r"edge is elsewhere, round \(-?\d+, -?\d+\) mm (\d+) mm (inside|outside) it", report.reason)
        if said is None:  # on a ply with slopes or near the image's border something else may have been said first
            assert "between the pockets" in report.reason or "was seen" in report.reason
        else:
            assert 6 <= int(said[1]) <= size + 8


@MODES
def test_an_outline_of_another_shape_does_not_pass(regions):
    outline = given("first").ply_outline
    middle = outline.mean(axis=0)
    for other in (middle + 0.8 * (outline - middle), middle + (outline - middle)[:, ::-1] * 0.7):
        report = inspect("first", regions, other)
        assert report.verdict is Verdict.INVALID
        assert "the outline does not fit the scan" in report.reason


@pytest.mark.parametrize("sense", [1, -1], ids=["counter-clockwise", "clockwise"])
def test_the_edge_is_found_where_it_is(sense):
    """A round ply of 0.3 mm on a plane, seen exactly."""
    x, y = np.meshgrid(np.arange(-200.0, 201.0, 2.0), np.arange(-200.0, 201.0, 2.0))
    heights = Grid(np.where(np.hypot(x, y) < 120, 0.3, 0.0), np.array([-200.0, -200.0]), 2.0)
    turn = sense * np.linspace(0, 2 * np.pi, 90, endpoint=False)
    for radius in (100, 108, 132, 140):
        circle = radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        fit = Outline(circle).fit(heights, 0.3, 2.0)
        assert fit.off_share > 0.95
        assert fit.off_mm == pytest.approx(120 - radius, abs=3)
    circle = 120 * np.stack([np.cos(turn), np.sin(turn)], axis=1)
    fit = Outline(circle).fit(heights, 0.3, 2.0)
    assert fit.judged >= 15
    assert fit.off_share == 0


def rectangle(length, width):
    return np.array([[0.0, 0.0], [length, 0.0], [length, width], [0.0, width]])


@pytest.mark.parametrize("cut", [0, 8, 30, 300])
def test_a_short_side_that_is_cut_off_is_seen_in_a_long_outline(cut):
    """Of a ply 700 mm long and 200 wide, seen exactly; less than a fifth of the outline lies elsewhere."""
    x, y = np.meshgrid(np.arange(-80.0, 781.0, 2.0), np.arange(-80.0, 281.0, 2.0))
    on_ply = (x > 0) & (x < 700) & (y > 0) & (y < 200)
    heights = Grid(np.where(on_ply, 0.3, 0.0), np.array([-80.0, -80.0]), 2.0)
    fit = Outline(rectangle(700.0 - cut, 200.0)).fit(heights, 0.3, 2.0)
    assert fit.off_share < 0.2
    assert (fit.far_row >= 3) == (cut >= 30)
    if cut == 0:
        assert fit.off_share == 0


def from_y(corners, y):
    """The part of a polygon with no smaller y."""
    kept = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if a[1] >= y:
            kept.append(a)
        if (a[1] - y) * (b[1] - y) < 0:
            kept.append(a + (b - a) * (y - a[1]) / (b[1] - a[1]))
    return np.array(kept)


@MODES
def test_an_outline_that_leaves_out_a_creasing_side_does_not_pass(regions):
    """It was CEASE with all of it seen: the edge lies elsewhere along 19 % of this outline, and a fifth was allowed."""
    layup = varied_layup(70028, (1024, 768), severity="any", holes_mm=0, clamp=False, pockets=1)
    g = given_right(layup)
    (creasing,) = (p.outline_mm for p in layup.truth.pockets if p.ridge_mm > 0.7)
    short = from_y(g.ply_outline, creasing[:, 1].max() + 12)
    recipe = Recipe(**g.recipe, segmentation={"regions": regions})
    report = Inspector(recipe, g.reference, short, g.fibre_angles_deg, g.mold_from_scanner).inspect(g.scan)
    assert report.verdict is Verdict.INVALID
    assert "the outline does not fit the scan" in report.reason


def test_a_far_corner_does_not_crash_the_core():
    grid = Grid(np.zeros((20, 30), dtype=np.float32), np.zeros(2), 1.0)
    for far in (1e5, 1e9, 1e12, 1e300):
        outline = np.array([[5.0, 5.0], [far, 5.0], [far, far], [5.0, far]])
        inside = pocket.inside_outline(outline, grid)
        assert inside[6:, 6:].all()
        assert not inside[:5].any()
        assert not pocket.inside_outline(-outline, grid).any()
