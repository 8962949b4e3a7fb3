"""What rides on a pocket between the fibres of its net lifts the range of its ridge; what does not, leaves it alone."""

import numpy as np
import pytest

import laid_ply
from debulk import Recipe, Verdict
from debulk.inspection.straight_fibres import longest

WIDE = (0.0, 0.0, 260.0, 6.5)  # a ridge of 0.4 mm
RIDER = (22.0, 2.3)  # width and height: a ridge of 0.42 mm
LIMIT_MM = 2 * (Recipe().verdict.max_ridge_mm - 0.43 * laid_ply.THICKNESS_MM)  # of excess


def exact_mm(shape, aside):
    """Of the longest of straight lines along both fibre directions, by the exact shape over the mold's reference."""
    excess_mm, along = [], np.linspace(-140.0, 140.0, 10_001)
    for off in aside:
        for line in (np.stack([along, 0 * along + off], axis=1), np.stack([0 * along + off, along], axis=1)):
            mold = laid_ply.inspector().reference.height(line)
            step = np.linalg.norm(np.diff(line, axis=0), axis=1)
            ply = mold + shape(line[:, 0], line[:, 1])
            excess_mm.append(float(sum(np.hypot(step, np.diff(ply)) - np.hypot(step, np.diff(mold)))))
    return max(excess_mm)


def with_rider(x, y):
    wide, rider = laid_ply.bell(*WIDE), laid_ply.bell(x, y, *RIDER)
    return lambda x, y: wide(x, y) + rider(x, y)


@pytest.mark.parametrize("at", [(9.0, 9.0), (-31.0, 7.0)])
def test_a_bump_that_rides_on_a_pocket_is_not_passed(at):
    shape = with_rider(*at)
    true_mm = exact_mm(shape, at)
    assert true_mm > 1.1 * LIMIT_MM
    scan = laid_ply.scan(shape)
    report = laid_ply.inspector().inspect(scan)
    (p,) = report.pockets
    limit_mm = Recipe().verdict.max_ridge_mm
    assert p.excess.height_mm + p.excess.uncertainty_mm < limit_mm < p.excess.range_mm[1]
    assert p.verdict is Verdict.UNDECIDED
    (found,) = laid_ply.inspector().find(scan).pockets
    line = longest(found, laid_ply.inspector().ply)
    assert line.excess_mm == pytest.approx(true_mm, abs=0.08)
    assert line.top_mm == pytest.approx(at, abs=14.0)


def test_a_smooth_pocket_has_nothing_between_its_fibres():
    shape = laid_ply.bell(*WIDE)
    scan = laid_ply.scan(shape)
    (p,) = laid_ply.inspector().inspect(scan).pockets
    (found,) = laid_ply.inspector().find(scan).pockets
    assert p.verdict is Verdict.CEASE
    assert p.excess.missed_mm < 0.01
    assert longest(found, laid_ply.inspector().ply).excess_mm == pytest.approx(
        exact_mm(shape, np.arange(-40.0, 41.0, 4.0)), abs=0.02
    )


def test_a_line_counts_at_the_edge_only_where_the_ply_goes_on():
    scan = laid_ply.scan(laid_ply.bell(*WIDE))
    (found,) = laid_ply.inspector().find(scan).pockets
    ply = laid_ply.inspector().ply
    assert longest(found, ply, held_over_mm=20.0) == longest(found, ply)
    assert longest(found, ply, held_over_mm=2000.0).excess_mm == 0.0


def test_a_bump_that_rides_on_a_pocket_at_the_edge_is_not_passed():
    """The net is free at the edge, and its held fibres, 16 mm apart, step over a bump of 18 mm, 105 mm inside."""
    right_mm = laid_ply.layup().ply_outline[:, 0].max()
    wide, rider = laid_ply.bell(right_mm - 60, 0, 240, 6), laid_ply.bell(right_mm - 105, 7, 18, 2.2)
    (p,) = laid_ply.inspector().inspect(laid_ply.scan(lambda x, y: wide(x, y) + rider(x, y))).pockets
    assert p.excess is None
    assert p.verdict is Verdict.UNDECIDED
    assert p.excess_length_mm < 0.6 * LIMIT_MM
    assert p.reason.startswith("a fibre that is held at both ends is 0.8")
