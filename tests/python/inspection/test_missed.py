"""What the filters take from a pocket's excess, and what lies beyond its foot, lifts the range and nothing else."""

from types import SimpleNamespace

import numpy as np
import pytest

import laid_ply
from debulk.inspection.laid_pocket import lay_pocket
from debulk.inspection.missed import missed_share

TOP_MM = (50.3, 30.6)
THICKNESS_SHARE = 0.43  # of the thickness, in a ridge without excess length


def true_ridge_mm(wide_mm, high_mm, long_mm=None):
    """Of the straight lines over the top along both fibre directions, by the exact shape over the mold's reference."""
    shape, along = laid_ply.bell(*TOP_MM, wide_mm, high_mm, long_mm), np.linspace(-80.0, 80.0, 20_001)
    excess_mm = []
    for way in ((1.0, 0.0), (0.0, 1.0)):
        line = np.array(TOP_MM) + along[:, None] * way
        mold = laid_ply.inspector().reference.height(line)
        step = np.linalg.norm(np.diff(line, axis=0), axis=1)
        ply = mold + shape(line[:, 0], line[:, 1])
        excess_mm.append(float(sum(np.hypot(step, np.diff(ply)) - np.hypot(step, np.diff(mold)))))
    return max(excess_mm) / 2 + THICKNESS_SHARE * laid_ply.THICKNESS_MM


def laid(wide_mm, high_mm, long_mm=None, noise_mm=0.03):
    inspector = laid_ply.inspector()
    scan = laid_ply.scan(laid_ply.bell(*TOP_MM, wide_mm, high_mm, long_mm), noise_mm)
    (found,) = inspector.find(scan).pockets
    return lay_pocket(found, inspector.ply), found


@pytest.mark.parametrize("shape", [(30, 5), (32, 4.2), (36, 7), (40, 4.5), (60, 5), (100, 6), (30, 3.6, 90)], ids=str)
def test_the_true_ridge_of_a_bell_lies_within_the_range(shape):
    known = laid(*shape)[0].excess
    assert known.range_mm[0] <= true_ridge_mm(*shape) <= known.range_mm[1]


def test_the_filters_lower_a_narrow_bell_by_more_than_the_uncertainty():
    """Without what is missed the range would end below the truth: a bias towards CEASE."""
    known = laid(30, 5)[0].excess
    assert known.height_mm + known.uncertainty_mm < true_ridge_mm(30, 5) < known.range_mm[1]
    assert known.range_mm[1] == pytest.approx(known.height_mm + known.uncertainty_mm + known.missed_mm)
    assert known.range_mm[0] == pytest.approx(known.height_mm - known.uncertainty_mm)


def test_a_net_without_fibres_misses_nothing():
    pocket, found = laid(100, 6)
    alone = np.full_like(pocket.net.neighbours, -1)
    net = SimpleNamespace(nodes_mm=pocket.net.nodes_mm, neighbours=alone)
    assert missed_share(found, net, laid_ply.inspector().reference) == 0.0


def test_a_wide_pocket_misses_next_to_nothing():
    pocket, found = laid(100, 6)
    share = missed_share(found, pocket.net, pocket.reference)
    assert 0 < share < 0.02
    assert pocket.excess.missed_mm == pytest.approx(share * pocket.excess.length_mm / 2)
