"""How many starts a pocket gets: the fixed ones, and further ones while a figure lies close to its limit."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from debulk import _core, solve
from debulk.inspection.minima import starts
from debulk.recipe import Recipe
from debulk.sheet import Sheet
from debulk.surface import Reference

pytestmark = pytest.mark.unit

RECIPE = Recipe(solve={"starts": 2, "most_starts": 6, "close_ridge_mm": 0.2, "close_rms_mm": 0.03})


def figures(rms=0.26, ridge=0.0, bridge=0.0):
    return SimpleNamespace(rms_mm=rms, ridge_height_mm=ridge, bridge_height_mm=bridge)


@pytest.mark.parametrize(
    ("every", "wanted"),
    [
        ([], False),  # nothing is certified: no figure can lie close to anything
        ([figures(rms=0.25)], False),
        ([figures(rms=0.28)], True),  # within 0.03 mm of 0.30
        ([figures(rms=0.25), figures(rms=0.28)], True),  # one start is enough
        ([figures(rms=0.25, ridge=0.39)], False),
        ([figures(rms=0.25, ridge=0.41)], True),  # within 0.2 mm of 0.60
        ([figures(rms=0.25, bridge=0.41)], True),
        ([figures(rms=0.35, ridge=0.0)], False),  # it creases, by far, whatever the others say
        ([figures(rms=0.31, ridge=0.9)], False),
        ([figures(rms=0.29, ridge=0.9)], False),
        ([figures(rms=0.31, ridge=0.7)], True),  # it creases by either, by far by none
        ([figures(rms=0.35), figures(rms=0.32)], True),
        ([figures(rms=0.25, ridge=0.55), figures(rms=0.25, ridge=0.65)], False),  # on both sides: so it remains
        ([figures(rms=0.301)], False),  # as near as a tie: the same
        ([figures(rms=0.25, ridge=0.56)], False),
        ([figures(rms=0.32, ridge=0.55), figures(rms=0.32, ridge=0.65)], True),  # one on both sides, one above
    ],
)
def test_close_is_what_another_start_may_change(every, wanted):
    assert starts.close(every, RECIPE) is wanted


@pytest.fixture(scope="module")
def roof():
    """A ridge between two fixed nodes that can only tip over: every start is certified."""
    height = np.sqrt(25 - 4.9**2)
    nodes = [[-4.9, 0, 0], [0, 0, height], [4.9, 0, 0]]
    neighbours = [[1, -1, -1, -1], [2, 0, -1, -1], [-1, 1, -1, -1]]
    return Sheet(nodes, neighbours, [1, 0, 1], 5.0, 75.0, Reference(np.zeros((4, 4)), (-10, -10), 10.0))


def settle(roof, values, recipe=RECIPE, stop=None):
    """Starts of which the k-th has the k-th of these RMS values."""
    seen = []

    def post_process(solution):
        seen.append(solution)
        return figures(rms=values[len(seen) - 1])

    return starts.settle(roof, recipe, post_process, stop or _core.Stop())


def test_a_bridge_that_does_not_decide_keeps_no_start_from_a_ridge_that_is_close(roof):
    def post_process(_):
        return figures(rms=0.25, ridge=0.5, bridge=4.0)

    def without_bridge(one):
        return figures(one.rms_mm, one.ridge_height_mm)

    kept = starts.settle(roof, RECIPE, post_process, _core.Stop())
    assert len(kept.every) == RECIPE.solve.starts
    judged = starts.settle(roof, RECIPE, post_process, _core.Stop(), judged_as=without_bridge)
    assert len(judged.every) == RECIPE.solve.most_starts
    assert judged.bridge_mm == (4.0, 4.0)


def test_a_clear_pocket_gets_the_fixed_starts(roof):
    settled = settle(roof, [0.25, 0.26])
    assert len(settled.solution.minima) == len(settled.every) == 2
    assert settled.rms_mm == (0.25, 0.26)
    assert settled.ridge_mm == settled.bridge_mm == (0.0, 0.0)
    assert not settled.cut


def test_a_close_one_gets_the_most(roof):
    settled = settle(roof, [0.28] * 6)
    assert len(settled.solution.minima) == 6
    assert not settled.cut


def test_it_ends_where_the_starts_lie_on_both_sides(roof):
    settled = settle(roof, [0.28, 0.28, 0.29, 0.32, 0.28])
    assert len(settled.solution.minima) == 4
    assert settled.rms_mm == (0.28, 0.32)


def test_most_starts_below_the_fixed_ones_turn_it_off(roof):
    recipe = RECIPE.model_copy(update={"solve": {"starts": 3, "most_starts": 1}})
    assert len(settle(roof, [0.28] * 3, recipe).solution.minima) == 3


def test_starts_one_by_one_are_the_starts_at_once(roof):
    settled = settle(roof, [0.28] * 6)
    at_once = solve.minimise(roof, starts=6)
    for one, other in zip(settled.solution.minima, at_once.minima, strict=True):
        assert np.array_equal(one.nodes_mm, other.nodes_mm)
        assert one.iterations == other.iterations
    assert settled.solution.energy_mj == at_once.energy_mj
    energies = [m.energy_mj for m in at_once.minima]
    assert settled.best is settled.every[int(np.argmin(energies))]


def test_softer_fibres_count_only_where_all_are(roof, monkeypatch):
    real = solve.minimise_with

    def strained(which):
        def minimise(options, *args):
            found = real(options, *args)
            softer = [
                replace(m, certificate=replace(m.certificate, compliant=True), energy_mj=m.energy_mj - 1.0)
                if which(options.first_start + k)
                else m
                for k, m in enumerate(found.minima)
            ]
            return solve.best(softer)

        return minimise

    monkeypatch.setattr(solve, "minimise_with", strained(lambda k: k == 0))
    settled = settle(roof, [0.99, 0.28, 0.27, 0.27, 0.27, 0.27])
    assert settled.rms_mm == (0.27, 0.28)
    assert not settled.solution.certificate.compliant
    assert len(settled.solution.minima) == 6
    monkeypatch.setattr(solve, "minimise_with", strained(lambda k: True))
    settled = settle(roof, [0.25, 0.26])
    assert settled.rms_mm == (0.25, 0.26)
    assert settled.solution.certificate.compliant


def test_a_deadline_cuts_and_says_so(roof):
    stop = _core.Stop()
    stop.set_deadline(0.0)
    settled = settle(roof, [0.28] * 6, stop=stop)
    assert len(settled.solution.minima) == 1
    assert settled.cut


def test_the_first_of_the_starts_must_be_one_of_them(roof):
    with pytest.raises(solve._core.InputError, match="first_start"):
        solve.minimise(roof, starts=2, first_start=2)


def test_for_the_picture_one_certified_start_is_enough_and_it_is_perturbed(roof):
    settled = starts.settle(roof, RECIPE, lambda _: figures(rms=0.28), _core.Stop(), for_the_picture=True)
    assert len(settled.solution.minima) == 1
    assert not settled.cut
    perturbed = solve.minimise(roof, starts=2, first_start=1)
    assert settled.solution.nodes_mm.tobytes() == perturbed.nodes_mm.tobytes()


def test_for_the_picture_the_net_as_laid_is_the_second_resort(roof):
    recipe = RECIPE.model_copy(update={"solve": {"max_iterations": 1}})
    settled = starts.settle(roof, recipe, lambda _: figures(), _core.Stop(), for_the_picture=True)
    assert [m.certified for m in settled.solution.minima] == [False, False]
