"""What the tolerances drop is bounded, and a bump that could crease is judged, in both modes alike."""

from __future__ import annotations

import numpy as np
import pytest

import laid_ply
from debulk import _core
from debulk.inspection import tolerances
from debulk.verdict import Verdict


@pytest.mark.parametrize("regions", [True, False], ids=["regions", "whole scan"])
def test_a_small_steep_bump_is_judged_and_creases(regions):
    # 20 by 20 mm and 6 mm high: 1.8 cm² at the cut. By the arc of its profile a fibre over it is 3.5 mm too long.
    report = laid_ply.inspector(regions).inspect(laid_ply.scan(laid_ply.bell(50, 30, 20, 6)))
    assert report.verdict is Verdict.CREASE
    (bump,) = report.pockets
    assert bump.area_mm2 < 200
    assert bump.promoted.startswith("below the tolerance on area, but")
    assert np.linalg.norm(bump.outline_mm.mean(axis=0) - (50, 30)) < 1.0


@pytest.mark.parametrize("regions", [True, False], ids=["regions", "whole scan"])
def test_a_wide_shallow_bump_stays_dropped_with_its_bound(regions):
    # 80 by 80 mm and 2.8 mm high: its profile is 0.24 mm longer than its chord.
    scan = laid_ply.scan(laid_ply.bell(50, 30, 80, 2.8))
    inspector = laid_ply.inspector(regions)
    report = inspector.inspect(scan)
    assert report.verdict is Verdict.CEASE
    assert report.pockets == ()
    (entry,) = [entry for entry in report.left_out if entry.what.startswith("bump of")]
    assert "at (50, 30) mm" in entry.what
    (bump,) = tolerances.weigh(inspector.find(scan), inspector.ply, _core.Stop())
    assert f"up to {bump.excess_mm:.2f} mm longer than the mold" in entry.why
    assert bump.excess_mm == pytest.approx(np.pi**2 * 2.8**2 / (4 * 80), rel=0.25)


def _shelf(x, y):
    """A broad pocket with a ledge that ends 0.007 mm below the cut, and an island on it that stands up by 0.014 mm."""
    broad = laid_ply.bell(0, 0, 240, 5)(x, y)
    ledge = 1.693 * np.clip((105 - np.abs(x)) / 10, 0, 1) * np.clip((40 - np.abs(y)) / 10, 0, 1)
    return np.maximum(broad, ledge) + laid_ply.bell(83, 0, 24, 0.014)(x, y)


@pytest.mark.parametrize("regions", [True, False], ids=["regions", "whole scan"])
def test_an_island_that_only_noise_parts_from_a_pocket_is_judged_with_it(regions):
    one = laid_ply.inspector(regions)
    found = one.find(laid_ply.scan(_shelf, noise_mm=0.03))
    bumps = tolerances.weigh(found, one.ply, _core.Stop())
    assert len(found.pockets) == 1
    assert bumps
    assert all("judged with that pocket" in bump.why for bump in bumps)


def test_both_modes_bound_a_bump_alike():
    scan = laid_ply.scan(laid_ply.bell(-200, 100, 22, 5, 30))
    found = [
        tolerances.weigh(inspector.find(scan), inspector.ply, _core.Stop())
        for inspector in (laid_ply.inspector(True), laid_ply.inspector(False))
    ]
    excess = [[bump.excess_mm for bump in bumps] for bumps in found]
    assert len(excess[0]) == 1
    assert excess[0] == pytest.approx(excess[1], abs=1e-3)


def test_bumps_that_a_deadline_cuts_off_decide_nothing():
    inspector = laid_ply.inspector()
    found = inspector.find(laid_ply.scan(laid_ply.bell(50, 30, 20, 6)))
    stop = _core.Stop()
    stop.set_deadline(1e-9)
    (bump,) = tolerances.weigh(found, inspector.ply, stop)
    assert bump.late
    assert bump.found is None
    (doubt,) = tolerances.doubts([bump])
    assert doubt.verdict is Verdict.UNDECIDED
