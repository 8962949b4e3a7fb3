"""Ridges of a net at a minimum: closed forms."""

import math

import numpy as np
import pytest

from debulk import ridge, surface
from debulk.inspection.ply import polyline
from lab.net_crests import distance_mm, net_crests


def turned(x, y, deg):
    """Coordinates along and across a direction."""
    c, s = math.cos(math.radians(deg)), math.sin(math.radians(deg))
    return c * x + s * y, c * y - s * x


def rows(count, shift=0, spacing=8.0, peak=3.0, turn=0.0):
    """Net of `count` fibres along x with three nodes each, folded in the middle; every fibre shifted to its last."""
    half = math.sqrt(spacing**2 - peak**2)
    nodes, neighbours = [], []
    for row in range(count):
        for k, (x, z) in enumerate(((-half, 0), (0, peak), (half, 0))):
            nodes.append((x, spacing * row, z))
            here = 3 * row + k
            above = here + 3 - shift if row + 1 < count and 0 <= k - shift <= 2 else -1
            below = here - 3 + shift if row and 0 <= k + shift <= 2 else -1
            neighbours.append((here + 1 if k < 2 else -1, here - 1 if k else -1, above, below))
    nodes = np.array(nodes)
    x, y = turned(nodes[:, 0], nodes[:, 1], -turn)
    return np.column_stack([x, y, nodes[:, 2]]), np.array(neighbours, dtype=np.int32)


def settled_on(nodes, neighbours):
    flat = surface.Reference(np.zeros((60, 60)), (-120.0, -120.0), 4.0)
    return ridge.post_process(nodes, neighbours, np.ones(len(nodes), bool), flat, thickness_mm=0.3, bulk_factor=1.2)


@pytest.mark.parametrize("turn", [0.0, 50.0])
@pytest.mark.parametrize("count", [1, 4])
def test_a_straight_ridge_of_a_net(count, turn):
    nodes, neighbours = rows(count, turn=turn)
    settled = settled_on(nodes, neighbours)
    (one,) = net_crests(settled, neighbours, nodes)
    line = one.points_mm[:, :2]
    assert polyline.length_mm(line) == pytest.approx(8.0 * count)
    assert polyline.length_mm(line) == pytest.approx(settled.ridge_length_mm)
    assert one.section.ply_length_mm - one.section.mold_length_mm == pytest.approx(2 * (8 - math.sqrt(64 - 9)))
    middle = np.array(turned(0.0, 4.0 * (count - 1), -turn))
    np.testing.assert_allclose(line.mean(axis=0), middle, atol=1e-9)
    assert distance_mm(line, middle) == pytest.approx(0.0, abs=1e-9)


def test_a_ridge_of_a_net_may_shift_by_a_node_from_fibre_to_fibre():
    nodes, neighbours = rows(4, shift=1)
    (one,) = net_crests(settled_on(nodes, neighbours), neighbours, nodes)
    assert len(one.nodes) == 4


def test_ridges_of_a_net_are_ordered_by_height():
    low, links = rows(3, peak=2.0)
    high, _ = rows(2, peak=3.0)
    high[:, 0] += 60.0
    more = np.array(rows(2)[1])
    more[more >= 0] += len(low)
    nodes, neighbours = np.vstack([low, high]), np.vstack([links, more]).astype(np.int32)
    crests = net_crests(settled_on(nodes, neighbours), neighbours, nodes)
    assert [len(crest.nodes) for crest in crests] == [2, 3]
    assert crests[0].section.height_mm > crests[1].section.height_mm
