"""Ridge post-processing through Python: shapes and rules are tested in tests/cpp/ridge."""

import math

import numpy as np
import pytest

from debulk import InputError
from debulk.ridge import largest_fibre_excess, post_process, ridge_height
from debulk.surface import Reference

PLY = {"thickness_mm": 0.3, "bulk_factor": 1.2}


@pytest.fixture
def flat():
    return Reference(np.zeros((8, 8)), (-20.0, -20.0), 20.0)


def extruded(heights, spacing, rows):
    """An inextensible profile along the first fibre, the same in every row: nodes and neighbours."""
    heights = np.asarray(heights, dtype=float)
    x = np.concatenate([[0.0], np.cumsum(np.sqrt(spacing**2 - np.diff(heights) ** 2))])
    columns = len(heights)
    nodes = np.array([[x[i], spacing * j, heights[i]] for j in range(rows) for i in range(columns)])
    number = np.arange(rows * columns).reshape(rows, columns)
    neighbours = np.full((rows, columns, 4), -1)
    neighbours[:, :-1, 0] = number[:, 1:]
    neighbours[:, 1:, 1] = number[:, :-1]
    neighbours[:-1, :, 2] = number[1:]
    neighbours[1:, :, 3] = number[:-1]
    return nodes, neighbours.reshape(-1, 4)


@pytest.mark.parametrize(("spacing", "centre", "height"), [(8.40, 4.66, 1.540), (9.3, 3.2, 0.697)])
def test_the_three_node_ridges_of_the_model(flat, spacing, centre, height):
    assert ridge_height(2 * spacing, 2 * math.sqrt(spacing**2 - centre**2), 0.3) == pytest.approx(height, abs=5e-4)
    nodes, neighbours = extruded([0, centre, 0], spacing, 1)
    out = post_process(nodes, neighbours, np.ones(3, bool), flat, **PLY)
    assert out.ridge_height_mm == pytest.approx(height, abs=5e-4)


def test_what_comes_back(flat):
    nodes, neighbours = extruded([0, 2, 4, 2, 0], 6.0, 3)
    inside = np.abs(nodes[:, 2]) > 0
    out = post_process(nodes, neighbours, inside, flat, **PLY)
    assert out.gap_mm.shape == out.is_ridge.shape == out.is_bridge.shape == (15,)
    assert out.is_ridge.dtype == out.is_bridge.dtype == np.bool_
    assert np.flatnonzero(out.is_ridge).tolist() == [2, 7, 12]
    assert not out.is_bridge.any() and out.bridge_height_mm == 0
    assert out.rms_mm == pytest.approx(np.sqrt(np.mean(out.gap_mm[inside] ** 2)), rel=1e-12)
    assert out.ridge_length_mm == pytest.approx(18.0)
    assert [s.nodes for s in out.sections] == [(0, 1, 2, 3, 4), (5, 6, 7, 8, 9), (10, 11, 12, 13, 14)]
    section = out.sections[0]
    assert (section.peak, section.fibre) == (2, 0)
    assert section.ply_length_mm == pytest.approx(24.0)
    assert section.height_mm == pytest.approx(ridge_height(section.ply_length_mm, section.mold_length_mm, 0.3))
    assert out.excess_length_mm == pytest.approx(section.ply_length_mm - section.mold_length_mm)
    assert largest_fibre_excess(nodes, neighbours, flat) == out.excess_length_mm


def test_a_flat_net_is_the_consolidated_ply(flat):
    nodes, neighbours = extruded(np.zeros(6), 5.0, 4)
    out = post_process(nodes, neighbours, np.ones(24, bool), flat, **PLY)
    assert out.rms_mm == 0.3 / 1.2
    assert out.ridge_height_mm == out.ridge_length_mm == 0
    assert out.sections == ()


def test_touch_and_bulk_factor_are_taken(flat):
    nodes, neighbours = extruded([0, 4, 0], 8.0, 2)
    out = post_process(nodes, neighbours, np.ones(6, bool), flat, thickness_mm=0.4, bulk_factor=1.6, touch_mm=4.5)
    assert out.rms_mm == 0.25
    assert not out.is_ridge.any()


def test_input_is_checked(flat):
    nodes, neighbours = extruded([0, 4, 0], 8.0, 2)
    inside = np.ones(6, bool)
    with pytest.raises(InputError, match=r"nodes_mm: expected an \(N, 3\) array, but got shape \(6, 2\)"):
        post_process(nodes[:, :2], neighbours, inside, flat, **PLY)
    with pytest.raises(InputError, match=r"neighbours: expected an \(N, 4\) array"):
        post_process(nodes, neighbours[:, :3], inside, flat, **PLY)
    with pytest.raises(InputError, match="neighbours: expected one row"):
        post_process(nodes, neighbours[:3], inside, flat, **PLY)
    with pytest.raises(InputError, match="inside: expected one value per node"):
        post_process(nodes, neighbours, inside[:3], flat, **PLY)
    with pytest.raises(InputError, match=r"inside: expected an \(N,\) array"):
        post_process(nodes, neighbours, inside[:, None], flat, **PLY)
    with pytest.raises(InputError, match="inside: expected at least one node inside"):
        post_process(nodes, neighbours, ~inside, flat, **PLY)
    with pytest.raises(InputError, match="nodes_mm: expected finite coordinates, but got a missing value at node 2"):
        post_process(np.where(np.arange(6)[:, None] == 2, np.nan, nodes), neighbours, inside, flat, **PLY)
    with pytest.raises(InputError, match="bulk_factor"):
        post_process(nodes, neighbours, inside, flat, thickness_mm=0.3, bulk_factor=0.5)
    with pytest.raises(InputError, match="neighbours: expected node numbers"):
        largest_fibre_excess(nodes, neighbours + 1, flat)
    with pytest.raises(InputError, match="thickness_mm"):
        ridge_height(10.0, 9.0, -0.3)
