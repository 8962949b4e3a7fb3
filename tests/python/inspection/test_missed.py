"""What the filters take from a pocket's excess, and what lies beyond its foot, lifts the range and nothing else."""

import numpy as np
import pytest

import laid_ply
from debulk.inspection.laid_pocket import lay_pocket
from debulk.inspection.missed import missed_share

THICKNESS_SHARE = 0.43  # of the thickness, in a ridge without excess length


def true_ridge_mm(wide_mm, high_mm):
    x = np.linspace(0.0, wide_mm, 20_001)
    arc = np.hypot(np.diff(x), np.diff(high_mm * np.sin(np.pi * x / wide_mm) ** 2)).sum()
    return (arc - wide_mm) / 2 + THICKNESS_SHARE * laid_ply.THICKNESS_MM


def laid(wide_mm, high_mm, long_mm=None, noise_mm=0.03):
    inspector = laid_ply.inspector()
    scan = laid_ply.scan(laid_ply.bell(50.3, 30.6, wide_mm, high_mm, long_mm), noise_mm)
    (found,) = inspector.find(scan).pockets
    return lay_pocket(found, inspector.ply), found


@pytest.mark.parametrize(
    "shape", [(27, 4), (30, 4.2), (40, 4.5), (60, 5), (100, 6), (30, 3.2, 90), (26, 5), (36, 7)], ids=str
)
def test_the_true_ridge_of_a_bell_lies_within_the_range(shape):
    known = laid(*shape)[0].excess
    assert known.range_mm[0] <= true_ridge_mm(*shape[:2]) <= known.range_mm[1]


def test_the_filters_lower_a_narrow_bell_by_more_than_the_uncertainty():
    """Without what is missed the range would end below the truth: a bias towards CEASE."""
    known = laid(27, 4)[0].excess
    assert known.height_mm + known.uncertainty_mm < true_ridge_mm(27, 4) < known.range_mm[1]
    assert known.range_mm[1] == pytest.approx(known.height_mm + known.uncertainty_mm + known.missed_mm)
    assert known.range_mm[0] == pytest.approx(known.height_mm - known.uncertainty_mm)


def test_a_wide_pocket_misses_next_to_nothing():
    pocket, found = laid(100, 6)
    share = missed_share(found, pocket.net, pocket.reference)
    assert 0 < share < 0.02
    assert pocket.excess.missed_mm == pytest.approx(share * pocket.excess.length_mm / 2)
