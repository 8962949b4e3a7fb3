"""A step in the level is named as one, whatever a few squares do; a tilt or a bow stays what it is."""

import numpy as np
import pytest

from debulk import Recipe
from debulk.inspection.evidence.ply_zones import Blocks
from debulk.inspection.place import level
from debulk.inspection.place.level_reason import level_reason
from debulk.inspection.place.level_step import _sum_of_squares, best_step

pytestmark = pytest.mark.unit


def seen(shape, high_share, noise_mm=0.02):
    """Squares of 20 mm on a flat ply of 600 by 480 mm, raised by shape(u, v), of which some stand 2 to 6 mm high."""
    rng = np.random.default_rng(7)
    x, y = np.meshgrid(np.arange(-290.0, 300, 20), np.arange(-230.0, 240, 20))
    xy = np.column_stack([x.ravel(), y.ravel()])
    height = 0.3 + shape(xy[:, 0] / 300, xy[:, 1] / 240) + rng.normal(0, noise_mm, len(xy))
    high = rng.random(len(xy)) < high_share
    height[high] += rng.uniform(2, 6, np.count_nonzero(high))
    return Blocks(xy, height, np.full(len(xy), noise_mm / 3), 20.0, 1.0)


def reason(blocks):
    recipe = Recipe()
    found = level.deviation(blocks, 0.3, 0.2)
    said = level_reason(level.level_of(found, 0.3, recipe.level.tol_mm), found, recipe)
    return said.text if said else "", found


@pytest.mark.parametrize("high_share", [0.0, 0.04])
@pytest.mark.parametrize(
    ("shape", "share", "height_mm"),
    [
        (lambda u, v: 0.4 * (u + 0.3 * v > 0), 0.5, 0.4),
        (lambda u, v: -0.7 * (u > 0), 0.5, 0.6),  # a ply may lie 0.1 mm low before that counts
        (lambda u, v: 0.4 * (u > 1 / 3), 1 / 3, 0.4),
        (lambda u, v: 0.4 * (v > 0.7), 1 / 6, 0.4),
        (lambda u, v: 1.5 * (v < -0.8), 1 / 12, 1.5),
    ],
    ids=["half", "half low", "third", "strip", "narrow strip"],
)
def test_a_step_is_a_step(shape, share, height_mm, high_share):
    said, found = reason(seen(shape, high_share))
    assert " of the ply lies " in said and " by a step along " in said
    step = best_step(found)
    assert step.share == pytest.approx(share, abs=0.02) and step.height_mm == pytest.approx(height_mm, abs=0.02)


@pytest.mark.parametrize("high_share", [0.0, 0.04])
def test_a_step_of_a_thickness_down_is_bare_mold(high_share):
    said, _ = reason(seen(lambda u, v: -0.3 * (u > 0), high_share))
    assert "the mold is bare on 50 % of where the ply should be" in said


@pytest.mark.parametrize("high_share", [0.0, 0.04])
@pytest.mark.parametrize(
    ("shape", "words"),
    [
        (lambda u, v: 0.25 * u, "the scan is tilted by"),
        (lambda u, v: 2.0 * u - v, "the scan is tilted by"),
        (lambda u, v: 0.4 * u**2, "the scan is bent by"),
        (lambda u, v: 0.5 * u * v, "the scan is bent by"),
        (lambda u, v: 0.4 + 0 * u, "the scan lies 0.40 mm too high everywhere"),
    ],
    ids=["tilt", "steep tilt", "bow", "twist", "offset"],
)
def test_no_motion_or_bend_is_called_a_step(shape, words, high_share):
    said, _ = reason(seen(shape, high_share))
    assert said.startswith(words)


def stepped(xy, height_mm, high):
    """Squares of which some lie higher, without any noise."""
    blocks = Blocks(xy, 0.3 + height_mm * high, np.full(len(xy), 1e-4), 20.0, 1.0)
    return level.deviation(blocks, 0.3, 0.3)


def test_the_line_of_a_step_is_where_the_step_is():
    """Oblique, and away from the middle of squares that do not lie round the origin."""
    x, y = np.meshgrid(np.arange(110.0, 700, 20), np.arange(-430.0, 50, 20))
    xy = np.column_stack([x.ravel(), y.ravel()])
    across, along = np.array([-0.5, 0.75**0.5]), np.array([0.75**0.5, 0.5])  # of a line at 30 degrees
    on_line = np.array([480.0, -120.0])
    step = best_step(stepped(xy, 0.4, (xy - on_line) @ across > 0))
    assert step.line_deg == 30.0
    assert (step.at_mm - on_line) @ across == pytest.approx(0, abs=10)  # half a square
    assert (step.at_mm - xy.mean(axis=0)) @ along == pytest.approx(0, abs=1e-6)  # the place nearest to the middle
    assert np.mean(np.abs(step.rest_mm) > 1e-9) <= 1 / 60  # between two of the places that are tried


def test_a_step_from_below_the_thickness_to_above_it_is_a_step():
    xy = seen(lambda u, v: 0 * u, 0.0).xy_mm
    step = best_step(stepped(xy, 0.2, np.sign(xy[:, 0])))
    assert step.height_mm == pytest.approx(0.4) and step.share == pytest.approx(0.5)


def test_a_fit_that_explains_all_leaves_no_step():
    blocks = seen(lambda u, v: u, 0.0)
    assert best_step(level.deviation(blocks, 0.3, 0.3)) is None


@pytest.mark.parametrize("side", [1, -1])
def test_three_squares_are_a_side_and_two_are_not(side):
    """In either direction, at any number of squares."""
    rng = np.random.default_rng(5)
    xy = np.column_stack([side * np.arange(0.0, 400, 20), rng.uniform(-60, 60, 20)])
    for few in (3, 4):
        assert best_step(stepped(xy, 2.0, np.arange(20) >= 20 - few)).share == pytest.approx(few / 20)
    fewer = best_step(stepped(xy, 2.0, np.arange(20) >= 18))
    assert fewer is None or fewer.share > 0.1


def test_no_square_counts_as_more_than_the_most():
    assert _sum_of_squares(np.array([0.1, 0.2, 0.9]), 0.5) == pytest.approx(0.01 + 0.04 + 0.25)
