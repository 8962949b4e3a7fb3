"""A ply that is torn, folded over or double passes nothing; bells, loose borders and ribs below it are no plateaus."""

from __future__ import annotations

import re

import numpy as np
import pytest

import laid_ply
from debulk import Inspector, _core, pocket
from debulk.grid import Grid
from debulk.inspection.place import plateaus
from debulk.inspection.reference.prepared import Prepared
from debulk.recipe import Recipe
from debulk.verdict import Verdict
from lab.varied import given_right, varied_layup

T = laid_ply.THICKNESS_MM


def place(wide_mm, long_mm, high_mm):
    return lambda x, y: np.where((np.abs(x - 20) < wide_mm / 2) & (np.abs(y - 10) < long_mm / 2), high_mm, 0.0)


def folded(size_mm):
    """Fold the corner farthest along (1, 1) over: bare beyond the fold, two plies before it."""
    corners, way = laid_ply.layup().ply_outline, np.array([1, 1]) / np.sqrt(2)
    fold = (corners @ way).max() - size_mm / np.sqrt(2)

    def height(x, y):
        beyond = x * way[0] + y * way[1] - fold
        mirrored = np.stack([x, y], axis=1) - 2 * beyond[:, None] * way
        double = (beyond < 0) & (beyond > -size_mm) & pocket.inside(corners, mirrored)
        return np.where(double, T, np.where(beyond > 0, -T, 0.0))

    return height


def found(scan):
    inspector = laid_ply.inspector()
    overview = inspector.find(scan).overview
    return plateaus.find(overview, inspector._placing.zones, inspector.setup)


@pytest.mark.parametrize("noise_mm", [0.0, 0.02, 0.1])
@pytest.mark.parametrize("size", [(20, 20), (50, 50), (25, 150), (100, 100)])
def test_where_the_ply_is_missing_is_found(size, noise_mm):
    (one,) = found(laid_ply.scan(place(*size, -T), noise_mm))
    assert one.off_mm == pytest.approx(-T, abs=0.02)
    assert one.centre_mm == pytest.approx((20, 10), abs=1.5)
    assert one.area_mm2 == pytest.approx(size[0] * size[1], rel=0.12)


@pytest.mark.parametrize("high_mm", [T, 0.6, 1.4])
@pytest.mark.parametrize("size", [(20, 20), (10, 100), (100, 100)])
def test_where_something_lies_on_it_is_found(size, high_mm):
    (one,) = found(laid_ply.scan(place(*size, high_mm)))
    assert one.off_mm == pytest.approx(high_mm, abs=0.02)


def test_a_small_one_is_found_beside_many_large_bells():
    bells = [laid_ply.bell(100 * i - 330, 100 * j - 150, 60, 1.6) for i in range(7) for j in range(4)]
    patch = place(20, 20, T)
    (one,) = found(laid_ply.scan(lambda x, y: patch(x, y) + sum(bell(x, y) for bell in bells)))
    assert one.centre_mm == pytest.approx((20, 10), abs=2)


def test_the_search_heeds_a_raised_stop():
    inspector, stop = laid_ply.inspector(), _core.Stop()
    overview = inspector.find(laid_ply.scan(place(40, 40, T))).overview
    stop.cancel()
    with pytest.raises(_core.Stopped):
        plateaus.find(overview, inspector._placing.zones, inspector.setup, stop)


def test_a_torn_ply_is_invalid():
    report = laid_ply.inspector().inspect(laid_ply.scan(place(40, 40, -T)))
    assert report.verdict is Verdict.INVALID
    assert re.search("the ply is missing over 1[56] cm².*, and a mask over its windows$", report.reason)


def test_a_window_of_the_ply_goes_into_the_mask():
    scan, given = laid_ply.scan(place(40, 40, -T)), laid_ply.layup()
    points = scan @ given.mold_from_scanner[:3, :3].T + given.mold_from_scanner[:3, 3]
    mask = (np.abs(points[..., :2] - (20, 10)) < 22).all(axis=-1)
    inspector = Inspector(None, given.reference, given.ply_outline, (0, 90), given.mold_from_scanner, mask=mask)
    assert inspector.inspect(scan).verdict is Verdict.CEASE


@pytest.mark.parametrize(
    ("size_mm", "expected"),
    [(15, Verdict.UNDECIDED), (25, Verdict.INVALID), (60, Verdict.INVALID), (100, Verdict.INVALID)],
)
def test_a_corner_that_is_folded_over_passes_nothing(size_mm, expected):
    """Of a small one only what lies double is far enough inside the outline."""
    assert laid_ply.inspector().inspect(laid_ply.scan(folded(size_mm))).verdict is expected


def test_a_double_ply_is_undecided():
    report = laid_ply.inspector().inspect(laid_ply.scan(place(60, 80, T)))
    assert report.verdict is Verdict.UNDECIDED
    assert "the ply lies 0.30 mm too high over" in report.reason


@pytest.mark.parametrize(("wide_mm", "high_mm"), [(20, 1.5), (30, 1.6), (40, 1.4), (60, 1.2), (100, 0.6), (200, 1.2)])
def test_a_bell_is_none(wide_mm, high_mm):
    assert not found(laid_ply.scan(laid_ply.bell(50, 30, wide_mm, high_mm)))


def on_wide_cells(height):
    """Search a map of cells of 2.25 mm, as the overview of a scan has them, three pixels wide."""
    x, y = np.meshgrid(np.arange(-60, 100, 2.25), np.arange(-70, 90, 2.25))
    noise = np.random.default_rng(0).normal(0, 0.01, x.shape)
    heights = Grid((T + height(x, y) + noise).astype(np.float32), np.array([-60.0, -70.0]), 2.25)
    inspector = laid_ply.inspector()
    return plateaus.find(heights, Flat(), inspector.setup)


def flat_topped(a_mm, b_mm, high_mm, turn=0.4):
    """A pocket on an ellipse with these half axes that rises steeply and is level in its middle."""

    def height(x, y):
        u, v = ((x - 20) * np.cos(turn) + (y - 10) * np.sin(turn), (y - 10) * np.cos(turn) - (x - 20) * np.sin(turn))
        return high_mm * np.maximum(0, 1 - ((u / a_mm) ** 2 + (v / b_mm) ** 2) ** 2) ** 2

    return height


@pytest.mark.parametrize(("a_mm", "b_mm", "high_mm"), [(13.1, 17.8, 1.65), (13.5, 22.6, 1.72), (13.4, 21.7, 1.18)])
def test_a_pocket_with_a_flat_top_and_steep_flanks_is_none(a_mm, b_mm, high_mm):
    """Scenes 79, 151 and 178 of the open benchmark: they go down over several cells, and an edge within one."""
    assert not on_wide_cells(flat_topped(a_mm, b_mm, high_mm))


@pytest.mark.parametrize("off_mm", [20, 30])
def test_on_the_foot_of_such_a_pocket_something_is_found(off_mm):
    air, thing = flat_topped(18, 22, 1.6), place(40, 40, 0.6)
    (one,) = on_wide_cells(lambda x, y: air(x - off_mm, y) + thing(x, y))
    assert one.off_mm == pytest.approx(0.6, abs=0.1)


def test_without_an_outline_bare_mold_is_none():
    """The ply may end there; what lies double is found all the same."""
    layup, scan = laid_ply.layup(), laid_ply.scan(place(60, 80, T))
    whole = Inspector(None, laid_ply.inspector().prepared, mold_from_scanner=layup.mold_from_scanner)
    assert "missing" not in whole.inspect(laid_ply.scan(place(40, 40, -T))).reason
    assert "mm too high over" in whole.inspect(scan).reason


def test_a_loose_border_is_none():
    """Its highest strip is cut off where the ply's level is not read any more: that is no edge."""
    layup = varied_layup(2001, (640, 480))
    inspector = Inspector(None, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    assert "mm too high over" not in inspector.inspect(layup.scan).reason


class Flat:
    """Zones of a ply that covers all of a map."""

    def cells(self, heights):
        return np.ones(heights.values.shape, dtype=bool)


def flat_map(shape, value):
    return Grid(np.full(shape, value, dtype=np.float32), np.zeros(2), 2.0)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 0.0, 0.3, 1e30])
@pytest.mark.parametrize("shape", [(1, 1), (3, 2), (60, 80)])
def test_maps_without_edges_have_none(shape, value):
    inspector = laid_ply.inspector()
    assert not plateaus.find(flat_map(shape, value), Flat(), inspector.setup)


def test_a_ply_that_runs_on_over_a_recess_is_none(monkeypatch):
    """Its height above the reference steps up there; the ply itself does not."""
    rng = np.random.default_rng(0)
    x, y = np.meshgrid(np.arange(400.0), np.arange(300.0))
    recess = -0.5 * np.clip((25 - np.maximum(np.abs(x - 200), np.abs(y - 150))), 0, 1)
    reference, scan = (
        np.dstack([x, y, z + 0.01 * rng.standard_normal(x.shape)]).astype(np.float32)
        for z in (recess, np.where((np.abs(x - 200) < 150) & (np.abs(y - 150) < 100), T, 0.0))
    )
    corners = np.array([[50, 50], [350, 50], [350, 250], [50, 250]], dtype=float)
    inspector = Inspector(None, reference, corners, mold_from_scanner=np.eye(4))
    assert "mm too high over" not in inspector.inspect(scan).reason
    monkeypatch.setattr(plateaus, "_of_reference", lambda *_: 0.0)
    assert "mm too high over" in inspector.inspect(scan).reason


def test_a_ply_in_a_groove_that_the_reference_fills_in_is_none(monkeypatch):
    """On pixels of 1.5 mm the smooth surface misses half a millimetre of a groove 24 mm wide."""
    given = given_right(varied_layup(6128, (640, 480)))
    inspector = Inspector(
        Recipe(**given.recipe), given.reference, given.ply_outline, mold_from_scanner=given.mold_from_scanner
    )
    assert "missing over" not in inspector.inspect(given.scan).reason
    monkeypatch.setattr(Prepared, "missed_mm", lambda _, xy: np.zeros(len(xy)))
    assert "missing over" in inspector.inspect(given.scan).reason


@pytest.mark.parametrize(("high_mm", "off_mm"), [(0.6, 0), (1.2, 25), (0.6, 50)])
def test_something_on_a_pockets_foot_is_found(high_mm, off_mm):
    """It is one place with the pocket, which is not flat as a whole."""
    patch, bell = place(60, 60, high_mm), laid_ply.bell(20 + off_mm, 60, 60, 2.5)
    (one,) = found(laid_ply.scan(lambda x, y: patch(x, y) + bell(x, y)))
    assert one.off_mm == pytest.approx(high_mm, abs=0.1)


@pytest.mark.parametrize(("high_mm", "wide_mm"), [(6.0, 30), (1.5, 60), (0.4, 120), (6.0, 120)])
def test_bells_on_bells_are_none(high_mm, wide_mm):
    bells = [laid_ply.bell(20 + 0.4 * wide_mm * k, 10, wide_mm, high_mm) for k in range(3)]
    assert not found(laid_ply.scan(lambda x, y: sum(bell(x, y) for bell in bells)))
