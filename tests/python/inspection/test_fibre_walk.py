"""Chains of pockets along a fibre: the most that one fold may draw, whatever order they stand in."""

import math

import numpy as np
import pytest

from debulk.inspection.fibre_walk import CrossingFibres, End, Fibre, FibreWalk, Shared

WAY_MM = 20.0


def square(number, x, y, wide, spare_mm, *, turned_deg=0.0, fibres=3, with_same_foot=(), tail_mm=0.0):
    """A square pocket with fibres along both of its sides."""
    middle, step = np.array([x, y], float), wide / fibres
    held = []
    for degrees in (turned_deg, turned_deg + 90):
        along = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
        aside = np.array([-along[1], along[0]])
        for k in range(fibres):
            on = middle + (k - (fibres - 1) / 2) * step * aside
            held.append(
                Fibre(spare_mm, (End(on - wide / 2 * along, -along), End(on + wide / 2 * along, along)))
            )  # fmt: skip
    return CrossingFibres(frozenset((number, *with_same_foot)), number, step, tail_mm, 0.01, tuple(held))


def drawn(pockets, number=1, way_mm=WAY_MM):
    """By the middle fibre along x of one of the pockets, over both of its ends."""
    walk = FibreWalk(pockets, way_mm)
    shared = Shared(taken=next(one.numbers for one in pockets if one.number == number))
    for side in (0, 1):
        shared = walk.beyond(number, 1, side, shared)
    return shared


def most_by_trying_all(place, pockets, way_mm, taken):
    """Of every chain of pockets with straight, parallel fibres of one spacing: what it has to spare at most."""
    most = 0.0
    for one in pockets:
        for fibre in one.fibres if not one.numbers & taken else ():
            for near, far in (fibre.ends, fibre.ends[::-1]):
                off = near.xy - place.xy
                gap, aside = off @ place.way, off @ np.array([-place.way[1], place.way[0]])
                if near.way @ place.way < -0.9 and abs(aside) < 1e-9 and 0 <= gap <= way_mm:
                    rest = most_by_trying_all(far, pockets, way_mm - gap, taken | one.numbers)
                    most = max(most, fibre.spare_mm + rest)
    return most


def test_a_row_is_drawn_together_as_far_as_the_way_goes():
    row = [square(k + 1, 15.0 * k, 0.0, 10.0, 0.1 * (k + 1)) for k in range(7)]
    shared = drawn(row)
    assert shared.numbers == (2, 3, 4, 5)  # four gaps of 5 mm
    assert shared.spare_mm == pytest.approx(0.2 + 0.3 + 0.4 + 0.5)
    assert shared.variance_mm2 == pytest.approx(4 * 0.01**2)
    assert drawn(row, number=3).numbers == (2, 1, 4, 5, 6, 7)  # both ways, each with a way of its own
    assert drawn(row, way_mm=math.inf).numbers == (2, 3, 4, 5, 6, 7)


def test_only_ply_that_lies_on_the_mold_counts_as_way():
    for tail_mm, numbers in ((0.0, ()), (2.4, ()), (2.6, (2,)), (7.6, (2, 3)), (20.0, (2, 3))):
        row = [square(k + 1, 35.0 * k, 0.0, 10.0, 0.1, tail_mm=tail_mm) for k in range(3)]
        assert drawn(row).numbers == numbers


def test_what_stands_aside_or_across_is_not_drawn():
    assert drawn([square(1, 0, 0, 10, 0.1), square(2, 15, 12, 10, 0.1)]).numbers == ()
    assert drawn([square(1, 0, 0, 10, 0.1), square(2, 30, 0, 10, 0.1, turned_deg=45)], way_mm=19).numbers == ()
    assert drawn([square(1, 0, 0, 10, 0.1), square(2, 15, 0, 10, 0.0)]).numbers == ()


def test_pockets_of_one_foot_are_drawn_once():
    pockets = [
        square(1, 0, 0, 10, 0.1),
        square(2, 15, 0, 10, 0.2, with_same_foot=(3,)),
        square(3, 30, 0, 10, 0.3, with_same_foot=(2,)),
    ]
    shared = drawn(pockets, way_mm=25)
    assert (shared.numbers, shared.spare_mm) == ((3,), 0.3)  # the better one of both


def test_a_pocket_without_held_fibres_changes_nothing():
    row = [square(k + 1, 15.0 * k, 0.0, 10.0, 0.1) for k in range(3)]
    none = CrossingFibres(frozenset((9,)), 9, 1.0, 0.0, 0.01, ())
    assert drawn([none, *row]).numbers == drawn([*row, none]).numbers == drawn(row).numbers


@pytest.mark.parametrize("seed", range(20))
def test_against_all_chains_one_by_one(seed):
    rng = np.random.default_rng(seed)
    pockets, number = [], 0
    for y in (0.0, 9.0, 18.0):
        x = 0.0
        for _ in range(4):
            wide = float(rng.uniform(2, 9))
            x += wide / 2 + float(rng.uniform(0.5, 9))
            number += 1
            pockets.append(square(number, x, y, wide, float(rng.uniform(0.01, 0.5))))
            x += wide / 2
    walk = FibreWalk(pockets, WAY_MM)
    for one in pockets:
        for side in (0, 1):
            place = one.fibres[1].ends[side]
            row = [other for other in pockets if other.fibres[1].ends[0].xy[1] == place.xy[1]]
            least = most_by_trying_all(place, row, WAY_MM, one.numbers)
            assert walk.beyond(one.number, 1, side, Shared(taken=one.numbers)).spare_mm == pytest.approx(least)


def test_many_small_pockets_in_a_field_do_not_double_the_work_one_by_one():
    """Of 25 in a row any of 2^25 choices is a chain: tried one by one this would not end."""
    field = [square(1 + 25 * row + k, 2.5 * k, 2.5 * row, 2.0, 0.1) for row in range(5) for k in range(25)]
    shared = drawn(field, number=51)
    assert shared.numbers == tuple(range(52, 76))
    assert shared.spare_mm == pytest.approx(2.4)
