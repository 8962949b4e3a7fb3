"""What no pocket covers is judged where its runs count, in both modes alike."""

from __future__ import annotations

import re
from types import SimpleNamespace

import numpy as np
import pytest

import laid_ply
import stranger_scenes
from debulk import Inspector, Recipe, _core, scenes
from debulk.inspection.lines import places
from debulk.inspection.ply import excess
from debulk.verdict import Verdict
from lab.varied import given_right, varied_layup


def test_a_small_steep_bump_is_judged_and_creases():
    # 20 by 20 mm and 6 mm high: 1.8 cm² at the cut. By the arc of its profile a fibre over it is 3.5 mm too long.
    report = laid_ply.inspector().inspect(laid_ply.scan(laid_ply.bell(50, 30, 20, 6)))
    assert report.verdict is Verdict.CREASE
    (bump,) = report.pockets
    assert bump.area_mm2 < 200
    assert bump.promoted.startswith("below the tolerances, but a fibre over it is up to")
    assert np.linalg.norm(bump.outline_mm.mean(axis=0) - (50, 30)) < 1.0


def test_a_wide_shallow_bump_stays_dropped_with_its_bound():
    # 80 by 80 mm and 2.8 mm high: its profile is 0.24 mm longer than its chord.
    scan = laid_ply.scan(laid_ply.bell(50, 30, 80, 2.8))
    report = laid_ply.inspector().inspect(scan)
    assert report.verdict is Verdict.CEASE
    assert report.pockets == ()
    (entry,) = [entry for entry in report.left_out if entry.what.startswith("bump of")]
    assert "at (50, 30) mm" in entry.what
    said = re.search(r"up to ([\d.]+) mm longer than the mold", entry.why)
    assert float(said[1]) == pytest.approx(np.pi**2 * 2.8**2 / (4 * 80), rel=0.25)


def judged(inspector, found):
    """Return the places that are judged besides the pockets."""
    return list(places.judged(found, found.pockets, inspector.ply, _core.Stop()))


def _shelf(x, y):
    """A broad pocket with a ledge that ends 0.007 mm below the cut, and an island on it that stands up by 0.014 mm."""
    broad = laid_ply.bell(0, 0, 240, 5)(x, y)
    ledge = 1.693 * np.clip((105 - np.abs(x)) / 10, 0, 1) * np.clip((40 - np.abs(y)) / 10, 0, 1)
    return np.maximum(broad, ledge) + laid_ply.bell(83, 0, 24, 0.014)(x, y)


def test_an_island_that_only_noise_parts_from_a_pocket_is_judged_with_it():
    inspector = laid_ply.inspector()
    found = inspector.find(laid_ply.scan(_shelf, noise_mm=0.03))
    assert len(found.pockets) == 1
    assert found.dropped
    assert judged(inspector, found) == []


def _cross(half_mm, high_mm):
    """Two long ridges that cross, 30 degrees from the fibres."""

    def height(x, y):
        u, v = 0.866 * x + 0.5 * y, 0.866 * y - 0.5 * x
        away = np.minimum(
            np.hypot(v, np.maximum(np.abs(u) - 90, 0)),
            np.hypot(u, np.maximum(np.abs(v) - 90, 0)),
        )
        return high_mm * np.cos(0.5 * np.pi * np.clip(away / half_mm, 0, 1)) ** 2

    return height


def test_the_arms_of_a_branched_bump_are_not_stepped_over():
    """25 mm wide and 2.85 mm high: a fibre is 1.08 mm too long, a ridge of 0.67 mm; the net sees two thirds of it."""
    inspector = laid_ply.inspector()
    scan = laid_ply.scan(_cross(12.5, 2.85))
    assert inspector.find(scan).pockets == ()
    (place,) = judged(inspector, inspector.find(scan))
    assert excess.upper_mm(place.excess) == pytest.approx(1.08, rel=0.1)
    assert inspector.inspect(scan).verdict is not Verdict.CEASE


def test_a_bump_that_ends_in_a_hole_is_bounded_by_what_was_seen():
    """No net can be laid on it, and the hole cuts its foot where that is below the cut: it was dropped unbounded."""
    inspector, scan = laid_ply.inspector(), laid_ply.scan(_cross(12.5, 2.85))
    pose = laid_ply.layup().mold_from_scanner
    x, y, _ = np.moveaxis(scan @ pose[:3, :3].T + pose[:3, 3], -1, 0)
    along, across = 0.866 * x + 0.5 * y, 0.866 * y - 0.5 * x
    scan[(np.abs(along - 60) < 20) & (np.abs(across - 25) < 15)] = np.nan
    (place,) = judged(inspector, inspector.find(scan))
    assert not place.pocket.touches_unknown
    assert "what was seen of a fibre over it is 1." in place.promoted
    assert inspector.inspect(scan).verdict is not Verdict.CEASE


def test_the_sides_of_a_wide_ring_share_nothing():
    """Within it lie 84 mm of ply on the mold: each side makes a ridge of 0.39 mm."""
    inspector = laid_ply.inspector()

    def ring(x, y):
        return 2.4 * np.cos(0.5 * np.pi * np.clip((np.hypot(x, y) - 60) / 18, -1, 1)) ** 2

    scan = laid_ply.scan(ring)
    assert judged(inspector, inspector.find(scan)) == []
    assert inspector.inspect(scan).verdict is Verdict.CEASE


def _bent(radius_mm, half_mm, high_mm):
    """A ridge along seven tenths of a circle, which bends round its own middle."""

    def height(x, y):
        ends = np.hypot(x - radius_mm * np.cos(2.2), np.abs(y) - radius_mm * np.sin(2.2))
        along = np.abs(np.arctan2(y, x)) < 2.2
        away = np.where(along, np.abs(np.hypot(x, y) - radius_mm), ends)
        return high_mm * np.cos(0.5 * np.pi * np.clip(away / half_mm, 0, 1)) ** 2

    return height


def test_a_bent_bump_is_passed():
    inspector = laid_ply.inspector()
    scan = laid_ply.scan(_bent(60, 18, 2.5))
    assert [bump.reason for bump in inspector.find(scan).dropped] == ["peak"]
    assert inspector.inspect(scan).verdict is Verdict.CEASE


def test_a_bump_that_a_bent_one_goes_round_is_not_passed():
    """It comes to no cut. The fibres over both of them are 1.1 mm too long: a ridge of up to 0.69 mm."""
    inspector = laid_ply.inspector()
    bent, low = _bent(60, 16, 2.3), laid_ply.bell(19, 0, 10, 1.6, 40)
    scan = laid_ply.scan(lambda x, y: bent(x, y) + low(x, y))
    assert inspector.inspect(scan).verdict is not Verdict.CEASE


def test_places_that_a_deadline_cuts_off_leave_the_layup_undecided(monkeypatch):
    def stopped(*_):
        raise _core.Stopped("not in time for the places")

    monkeypatch.setattr(places, "_place_at", stopped)
    report = laid_ply.inspector().inspect(laid_ply.scan(laid_ply.bell(50, 30, 20, 6)))
    assert report.verdict is Verdict.UNDECIDED
    assert "deadline" in [one.check for one in report.findings if one.at_best is Verdict.UNDECIDED]


def test_a_long_ridge_below_the_cut_is_not_passed():
    """A ridge of 1.9 mm above the mold, 6 by 150 mm: a fibre over it is 1.0 mm too long, and the filters lower it."""
    inspector = laid_ply.inspector()
    scan = laid_ply.scan(laid_ply.bell(50, 30, 6, 1.6, 150))
    found = inspector.find(scan)
    assert (found.pockets, found.dropped) == ((), ())
    assert inspector.inspect(scan).verdict is not Verdict.CEASE


def test_what_stands_below_the_cut_is_bounded():
    """300 mm wide and 1.5 mm high: it never comes to the cut."""
    report = laid_ply.inspector().inspect(laid_ply.scan(laid_ply.bell(50, 30, 300, 1.5)))
    (entry,) = [entry for entry in report.left_out if entry.what.startswith("nets where the ply stands off")]
    assert float(re.search(r"up to ([\d.]+) mm longer", entry.why)[1]) < 0.1
    assert np.linalg.norm(np.subtract(entry.place_mm, (50, 30))) < 100


@pytest.mark.parametrize(("wide_mm", "high_mm"), [(10, 3), (12, 3), (14, 4), (16, 2.8)])
def test_what_the_filters_lower_is_not_passed(wide_mm, high_mm):
    """Bells whose profile is 1.2 to 2.5 mm longer than its chord, hardly wider than the filters."""
    report = laid_ply.inspector().inspect(laid_ply.scan(laid_ply.bell(50, 30, wide_mm, high_mm)))
    assert report.verdict is not Verdict.CEASE, report.reason


@pytest.mark.parametrize(("criterion", "count"), [("excess", 0), ("paper", 1)])
def test_the_rms_promotes_a_bump_only_where_it_decides(criterion, count):
    """25 mm wide, 2.6 mm high: 0.66 mm too long makes a ridge of 0.46 mm, though an RMS above 0.3 on few nodes."""
    one = laid_ply.layup()
    recipe = Recipe(verdict={"criterion": criterion})
    mold = laid_ply.inspector().prepared
    inspector = Inspector(recipe, mold, one.ply_outline, mold_from_scanner=one.mold_from_scanner)
    assert len(judged(inspector, inspector.find(laid_ply.scan(laid_ply.bell(50, 30, 25, 2.6))))) == count


def test_a_clump_of_flying_points_is_no_bump():
    """A second scan of this ply, in whose coarse pass a plateau of four by four cells stands where no bump is."""
    first, again = (scenes.layup(110, (1280, 960), repeat=k) for k in (0, 1))
    inspector = Inspector(None, first.reference, first.ply_outline, mold_from_scanner=first.mold_from_scanner)
    places = judged(inspector, inspector.find(again.scan))
    true_mm = [bump.centre_mm for bump in (*again.truth.pockets, *again.truth.decoys)]
    for place in places:
        assert min(np.linalg.norm(np.subtract(true_mm, place.pocket.centroid_mm), axis=1)) < 30
    assert len(places) == 2  # the decoys below the tolerance on area, which crease


def _dish(radius_mm, half_mm, flatter=1.0):
    """Height, below the mold's, of a dish at the origin, or of a ply that is flatter than it."""
    return lambda x, y: -np.maximum(0.0, half_mm**2 - x * x - y * y) / (2 * radius_mm * flatter)


@pytest.mark.parametrize(("radius_mm", "half_mm", "flatter"), [(40, 15, 1.3), (60, 25, 1.15), (100, 25, 1.2)])
def test_a_ply_too_short_for_a_dish_does_not_pass_though_it_stands_low(radius_mm, half_mm, flatter):
    """It stands 0.52 to 0.68 mm off the mold and stays there: with the ply 0.77 to 0.93 mm."""
    layup, mold = laid_ply.layup(), _dish(radius_mm, half_mm)
    reference = laid_ply.scan(lambda x, y: mold(x, y) - laid_ply.THICKNESS_MM, seed=1)
    inspector = Inspector(None, reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
    laid, short = (inspector.inspect(laid_ply.scan(_dish(radius_mm, half_mm, f))) for f in (1.0, flatter))
    assert laid.verdict is Verdict.CEASE, laid.reason
    assert short.verdict in (Verdict.UNDECIDED, Verdict.CREASE), short.reason
    assert "bridge" in short.reason


def test_a_steep_bell_on_a_low_hill_is_as_narrow_as_the_bell():
    """The foot is the hill's, 144 mm wide; a fibre over the bell, whose top the filters lower, is 1 mm too long."""

    def standing(x, y):
        away = np.minimum(np.hypot(x, y) / 12.3, 1.0)
        hill = 1.4 * np.maximum(0.0, 1 - ((x + 18) ** 2 + y**2) / 72**2) ** 2
        return hill + 2.75 * (1 - away) ** 4 * (1 + 4 * away)

    assert 0.6 < stranger_scenes.ridge_mm(standing, 95.0) < 0.65
    flat, size_mm, ply_mm = stranger_scenes.flat, (360, 360), (300, 300)
    reference = stranger_scenes.cloud(flat, size_mm, 0.85, seed=1)
    scan = stranger_scenes.cloud(stranger_scenes.laid(flat, standing, ply_mm), size_mm, 0.85, seed=2)
    report = Inspector(None, reference, stranger_scenes.outline(*ply_mm)).inspect(scan)
    (bump,) = report.pockets
    assert bump.verdict is Verdict.UNDECIDED


@pytest.mark.parametrize("seed", [91002, 91019, 741205, 770285, 92525])
def test_a_loose_border_ceases(seed):
    """Borders up to 2 mm high, of plies that are no longer than the mold.

    Of two the heights are not known over the last two cells; a line that fell to the mold there was too long by 0.9 mm.
    Beside three the mold ends in a cliff or the heights scatter along the edge: nodes past the edge followed both, and
    the ply's own nodes, which are laid from them, sheared by 60 degrees. Minima then had ridges of up to 12 mm.
    """
    layup = varied_layup(seed, (1280, 960))
    assert layup.truth.ridge_mm < 0.45
    given = given_right(layup)
    inspector = Inspector(
        None, given.reference, given.ply_outline, given.fibre_angles_deg, given.mold_from_scanner, mask=given.mask
    )
    report = inspector.inspect(given.scan)
    assert report.verdict is Verdict.CEASE, report.reason


def test_what_nothing_bounds_is_said_in_words():
    runs = SimpleNamespace(high_mm=np.array([2e3]), uncertainty_mm=np.array([0.1]))
    assert "nothing bounds" in places._longest(runs, Recipe())
    runs.high_mm[0] = 2.0
    assert "up to 2.10 mm longer" in places._longest(runs, Recipe())
