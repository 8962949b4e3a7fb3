"""A bump on a pocket that the filters take for noise keeps a layup from passing; flying points do not."""

import numpy as np
import pytest

import laid_ply
from debulk import Verdict, _core
from debulk.inspection.evidence.raw_points import RawPoints
from debulk.inspection.rawscan import riders

WIDE = (0.0, 0.0, 260.0, 6.5)  # a ridge of 0.4 mm


def found_on(scan):
    inspector = laid_ply.inspector()
    (found,) = inspector.find(scan).pockets
    pose, image = laid_ply.layup().mold_from_scanner, inspector.prepared.image
    both = [
        list(riders.riders_on(found, RawPoints(scan, None, pose, inspector.grid_spacing_mm, known), inspector.ply))
        for known in (image, None)
    ]
    assert both[0] == both[1]  # in the image's window, or in the whole scan
    return both[0]


@pytest.mark.parametrize(("wide_mm", "high_mm"), [(8.0, 2.5), (10.0, 3.0)])
def test_a_narrow_bump_on_a_pocket_is_not_passed(wide_mm, high_mm):
    wide, rider = laid_ply.bell(*WIDE), laid_ply.bell(31.0, 22.0, wide_mm, high_mm)
    scan = laid_ply.scan(lambda x, y: wide(x, y) + rider(x, y))
    report = laid_ply.inspector().inspect(scan)
    assert report.verdict is Verdict.UNDECIDED
    (one,) = found_on(scan)
    assert one.top_mm == pytest.approx((31.0, 22.0), abs=1.5)
    assert wide_mm - 3 < one.wide_mm < wide_mm + 3
    if report.pockets[0].verdict is Verdict.CEASE:
        assert "rides on pocket 1 at (3" in report.reason


def test_a_narrow_bump_on_what_is_no_pocket_is_not_passed():
    """120 mm wide and 1.5 mm high the ply stands up below the cut; that is no even ground either."""
    low, rider = laid_ply.bell(0.0, 0.0, 120.0, 1.5), laid_ply.bell(17.0, 14.0, 7.0, 2.0)
    report = laid_ply.inspector().inspect(laid_ply.scan(low))
    assert report.verdict is Verdict.CEASE
    assert report.pockets == ()
    report = laid_ply.inspector().inspect(laid_ply.scan(lambda x, y: low(x, y) + rider(x, y)))
    assert report.verdict is Verdict.UNDECIDED
    assert "rides on the bump at (" in report.reason


@pytest.mark.parametrize(("wild_mm", "said"), [(0.5, Verdict.CEASE), (1.5, Verdict.UNDECIDED)])
def test_flying_points_and_highlights_ride_on_nothing(wild_mm, said):
    """In a highlight of 2 by 2 cm that scatters by 1.5 mm lines are longer, up to a ridge of 0.61 mm: no rider."""
    scan = laid_ply.scan(laid_ply.bell(*WIDE))
    rng = np.random.default_rng(1)
    flying = rng.random(scan.shape[:2]) < 2e-3
    scan[flying, 2] -= rng.uniform(0.5, 5.0, np.count_nonzero(flying)).astype(np.float32)
    rows, columns = slice(480, 500), slice(640, 660)
    scan[rows, columns, 2] += rng.normal(0.0, wild_mm, (20, 20)).astype(np.float32)
    assert found_on(scan) == []
    report = laid_ply.inspector().inspect(scan)
    assert report.verdict is said
    assert "rides on" not in report.reason


def test_what_a_deadline_cuts_is_in_doubt_and_a_cancel_ends_the_search():
    inspector, scan = laid_ply.inspector(), laid_ply.scan(laid_ply.bell(*WIDE))
    found = inspector.find(scan)
    raw = RawPoints(scan, None, laid_ply.layup().mold_from_scanner, inspector.grid_spacing_mm, inspector.prepared.image)
    stop = _core.Stop()
    stop.set_deadline(0.0)
    (judged,) = riders.findings(raw, found, found.pockets, inspector.ply, stop)
    assert judged.check == "deadline" and judged.at_best is Verdict.UNDECIDED
    assert judged.reason == "the deadline passed before bumps on pocket 1 were looked for"
    stop = _core.Stop()
    stop.cancel()
    with pytest.raises(_core.Stopped):
        riders.findings(raw, found, found.pockets, inspector.ply, stop)


def test_a_scan_that_shows_nothing_there_has_no_riders():
    inspector, scan = laid_ply.inspector(), laid_ply.scan(laid_ply.bell(*WIDE))
    (found,) = inspector.find(scan).pockets
    pose, nothing = laid_ply.layup().mold_from_scanner, np.full_like(scan, np.nan)
    for points in (nothing, nothing.reshape(-1, 3), nothing[:1, :1]):
        for moved in (pose, None):
            raw = RawPoints(points, None, moved, inspector.grid_spacing_mm, inspector.prepared.image)
            assert riders.riders_on(found, raw, inspector.ply) == []
