"""Recipes that mean hours or gigabytes are refused with the estimate, before anything is allocated."""

import resource

import numpy as np
import pytest

from debulk import InputError, Inspector, Recipe, scenes
from debulk.inspection.running.effort import check_map, check_solves

METRE = (np.zeros(2), np.array([1000.0, 1000.0]))


@pytest.fixture(scope="module")
def layup():
    return scenes.layup(seed=4, pixels=(640, 480))


def test_a_map_of_gigabytes_is_refused_before_it_is_allocated(layup):
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(InputError, match=r"clean.grid_spacing_mm: expected .* takes about [0-9.e+]+ GB; take"):
        Inspector(Recipe(clean={"grid_spacing_mm": 0.05}), layup.reference, mold_from_scanner=layup.mold_from_scanner)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 500_000  # kB


def test_what_the_error_recommends_is_taken():
    with pytest.raises(InputError, match=r"0.1 mm over 1000 by 1000 mm takes about 8 GB; take 0.14 mm"):
        check_map(*METRE, 0.1, Recipe(clean={"max_hole_mm": 10.0}))
    check_map(*METRE, 0.1415, Recipe(clean={"max_hole_mm": 10.0}))
    check_map(*METRE, 0.5, Recipe())


def test_holes_that_take_minutes_each_are_refused():
    high = np.array([100.0, 100.0])
    with pytest.raises(InputError, match=r"clean.max_hole_mm: expected at most 6 mm, .* about 12.7 minutes"):
        check_map(METRE[0], high, 0.03, Recipe(clean={"max_hole_mm": 31.5}))
    check_map(METRE[0], high, 0.16, Recipe(clean={"max_hole_mm": 31.5}))


@pytest.mark.parametrize(
    "slow",
    [
        {"net": {"node_target": 5000}},
        {"net": {"node_target": 400}, "solve": {"most_starts": 1000}},
        {"net": {"node_target": 400}, "solve": {"starts": 1000}},
        {"solve": {"method": "nlopt", "most_starts": 200}},
    ],
)
def test_solves_of_more_than_a_minute_a_pocket_are_refused(layup, slow):
    recipe = Recipe(**slow)
    with pytest.raises(InputError, match=r"net.node_target, solve.most_starts: expected at most 60 s .* take about"):
        Inspector(recipe, layup.reference, mold_from_scanner=layup.mold_from_scanner)


def test_what_people_use_is_not_refused():
    for recipe in (Recipe(), Recipe(net={"node_target": 1000}), Recipe(solve={"starts": 50, "most_starts": 100})):
        check_solves(recipe)


def test_a_spacing_of_the_nets_is_refused_by_the_pocket_it_is_too_fine_for():
    recipe = Recipe(net={"spacing_mm": 1.0})
    check_solves(recipe)
    check_solves(recipe, 900.0)
    with pytest.raises(InputError, match=r"net.spacing_mm, solve.most_starts: .* 10000 nodes from 8 starts .* minutes"):
        check_solves(recipe, 10_000.0)
