"""The referee's measuring: a fold's height and gathered excess, and the excess of whole fibres and of windows."""

import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from debulk import surface

sys.path.insert(0, str(Path(__file__).parents[2] / "bench" / "referee"))

import excess
import folds
import pockets


def flat_mold(reach=60.0):
    return surface.Reference(np.zeros((4, 4)), (-reach, -reach), 2 * reach / 3)


def sheet_of(profile, rows=5, spacing=1.0):
    """Nodes over z(x) in rows along x, one spacing apart in y; all ends fixed."""
    count = len(profile)
    nodes = np.array([[x, spacing * j, z] for j in range(rows) for x, z in profile])
    number = np.arange(rows * count).reshape(rows, count)
    neighbours = np.full((rows * count, 4), -1)
    neighbours[number[:, :-1].ravel(), 0] = number[:, 1:].ravel()
    neighbours[number[:, 1:].ravel(), 1] = number[:, :-1].ravel()
    neighbours[number[:-1].ravel(), 2] = number[1:].ravel()
    neighbours[number[1:].ravel(), 3] = number[:-1].ravel()
    kinds = np.zeros(rows * count, dtype=int)
    kinds[number[:, [0, -1]]] = 1
    return nodes, neighbours, kinds


def roofs(*tops, spacing=1.0, flat=6):
    """A profile of equal chords with roofs of two chords on each side, of these slopes in degrees."""
    turns = [0.0] * flat
    for degrees in tops:
        turns += [degrees, degrees, -degrees, -degrees] + [0.0] * flat
    step = spacing * np.array([(np.cos(np.radians(t)), np.sin(np.radians(t))) for t in turns])
    return np.vstack([[0.0, 0.0], np.cumsum(step, axis=0)])


def test_a_roof_is_one_fold_of_its_height_and_excess():
    fold = folds.worst_fold(*sheet_of(roofs(40.0)), flat_mold())
    assert fold.height_mm == pytest.approx(2 * np.sin(np.radians(40)))
    assert fold.gathered_mm == pytest.approx(4 * (1 - np.cos(np.radians(40))))
    assert (fold.folds, fold.length_mm) == (1, pytest.approx(4.0))
    assert fold.direction_deg == pytest.approx(90.0)


def test_the_higher_of_two_roofs_gathers_its_own_excess_only():
    fold = folds.worst_fold(*sheet_of(roofs(30.0, 50.0)), flat_mold())
    assert fold.height_mm == pytest.approx(2 * np.sin(np.radians(50)))
    assert fold.gathered_mm == pytest.approx(4 * (1 - np.cos(np.radians(50))))
    assert fold.folds == 2


def test_a_ply_that_hangs_over_a_hollow_is_no_fold():
    _, x = np.mgrid[-60.0:61.0, -60.0:61.0]
    hollow = surface.Reference(-2 * np.exp(-((x - 8) ** 2) / 20), (-60, -60), 1.0)
    straight = np.column_stack([np.arange(17.0), np.zeros(17)])
    assert folds.worst_fold(*sheet_of(straight), hollow) == folds.Fold()


def test_windows_find_the_best_piece_of_a_fibre():
    profile = roofs(30.0, 50.0)
    nodes, neighbours, kinds = sheet_of(profile)
    laid = SimpleNamespace(nodes_mm=nodes, neighbours=neighbours, kinds=kinds, spacing_mm=1.0)
    small, large = (4 * (1 - np.cos(np.radians(t))) for t in (30, 50))
    assert excess.largest(laid, flat_mold()) == pytest.approx(small + large)
    assert excess.largest(laid, flat_mold(), 5.0) == pytest.approx(large)
    assert excess.largest(laid, flat_mold(), 2.5) == pytest.approx(large * 2.5 / 4)
    laid.kinds = np.where(kinds == 1, 2, kinds)
    assert excess.largest(laid, flat_mold()) == 0
    assert excess.largest(laid, flat_mold(), held=False) == pytest.approx(small + large)


def test_synthetic_pockets_have_the_excess_that_their_shape_asks_for():
    for shape in pockets.shapes()[::7]:
        assert pockets.excess(pockets.synthetic_pocket(shape)) == pytest.approx(shape.excess_mm, rel=0.02)


def test_half_of_the_synthetic_pockets_lie_near_the_limit():
    assert sum(0.6 <= shape.excess_mm / pockets.LIMIT_EXCESS_MM <= 1.4 for shape in pockets.shapes()) == 30


def test_mujoco_folds_a_strip_as_high_as_the_closed_form_says():
    pytest.importorskip("mujoco", reason="the extra referee is not installed")
    import mujoco_ply
    import strip

    mold, laid = strip.strip(0.5, 0.5 * strip.LENGTH_MM)
    end = mujoco_ply.simulate(mold, laid, 1, mujoco_ply.Physics(friction=0.0))
    fold = folds.worst_fold(end.nodes_mm, laid.neighbours, laid.kinds, mold.reference)
    assert end.accepted
    assert fold.height_mm == pytest.approx(strip.EXACT[0.5] * strip.LENGTH_MM, rel=0.05)
    assert fold.gathered_mm == pytest.approx(0.5 * strip.LENGTH_MM, rel=0.05)
