"""A step in the level is named as one, whatever a few squares do; a tilt or a bow stays what it is."""

import numpy as np
import pytest

from debulk import Recipe
from debulk.inspection.evidence.ply_zones import Blocks
from debulk.inspection.place import level
from debulk.inspection.place.level_reason import level_reason
from debulk.inspection.place.level_step import step_of

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
    said = level_reason(level.level_of(found, blocks, 0.3, recipe.level.tol_mm, 0.0), found, recipe)
    return said.text if said else "", found


@pytest.mark.parametrize("high_share", [0.0, 0.04])
@pytest.mark.parametrize(
    ("shape", "share", "height_mm"),
    [
        (lambda u, v: 0.4 * (u + 0.3 * v > 0), 0.5, 0.4),
        (lambda u, v: -0.4 * (u > 0), 0.5, 0.3),  # a ply may lie 0.1 mm low before that counts
        (lambda u, v: 0.4 * (u > 1 / 3), 1 / 3, 0.4),
        (lambda u, v: 0.4 * (v > 0.7), 1 / 6, 0.4),
        (lambda u, v: 1.5 * (v < -0.8), 1 / 12, 1.5),
    ],
    ids=["half", "half low", "third", "strip", "narrow strip"],
)
def test_a_step_is_a_step(shape, share, height_mm, high_share):
    said, found = reason(seen(shape, high_share))
    assert " of the ply lies " in said and " by a step along " in said
    step = step_of(found, 1)
    assert step.share == pytest.approx(share, abs=0.02) and step.height_mm == pytest.approx(height_mm, abs=0.02)


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
