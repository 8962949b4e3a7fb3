"""Fibre angles: two numbers, a map with gaps, or a drape; and what happens to a pocket where they are not known."""

import numpy as np
import pytest

from debulk import Grid, InputError, Inspector, Recipe, Verdict, net, scenes, surface
from debulk.inspection.ply.fibre_angles import angles_at, checked_angles, points_of
from debulk.inspection.repeating import repeat

FEW = {"segmentation": {"area_tol_mm2": 3000.0}, "solve": {"starts": 1, "most_starts": 1}}


@pytest.fixture(scope="module")
def layup():
    return scenes.layup(seed=4, pixels=(320, 240))


@pytest.fixture(scope="module")
def plain(layup):
    return make(layup, (30.0, 120.0))


@pytest.fixture(scope="module")
def report(layup, plain):
    return plain.inspect(layup.scan)


def make(layup, angles, **more):
    return Inspector(Recipe(**FEW), layup.reference, layup.ply_outline, angles, layup.mold_from_scanner, **more)


def constant(spacing_mm=50.0) -> Grid:
    shape = (round(2000 / spacing_mm), round(2000 / spacing_mm), 2)
    return Grid(np.full(shape, (30.0, 120.0)), np.array([-1000.0, -1000.0]), spacing_mm)


def test_a_map_gives_the_angles_of_its_nearest_point():
    values = np.arange(24.0).reshape(3, 4, 2) + np.array([0.0, 90.0])
    grid = checked_angles(Grid(values, np.array([10.0, 20.0]), 5.0))
    assert angles_at(grid, np.array([10.0, 20.0])).tolist() == values[0, 0].tolist()
    assert angles_at(grid, np.array([22.4, 27.6])).tolist() == values[2, 2].tolist()
    for place in ([7.4, 20.0], [27.6, 20.0], [10.0, 17.4], [10.0, 32.6]):  # more than half a step past the border
        with pytest.raises(InputError, match=rf"\({place[0]:.0f}, {place[1]:.0f}\) mm lies outside their grid"):
            angles_at(grid, np.array(place))


def test_places_of_a_map_whose_directions_are_nearly_the_same_are_not_known():
    """As angles in radians, or a sensor that took one family for both: nobody would look across the fibres there."""
    grid = constant()
    for place, second in enumerate((30.0, 39.0, -141.0, 205.0, 41.0)):
        grid.values[0, place, 1] = second
    known = np.isfinite(checked_angles(grid).values).all(axis=2)
    assert known[0, :5].tolist() == [False, False, False, False, True] and known[1:].all()
    radians = Grid(np.full((3, 3, 2), (0.0, np.pi / 2)), np.zeros(2), 1.0)
    with pytest.raises(InputError, match="no point with two known angles at least 10 degrees apart"):
        checked_angles(radians)


def test_a_gap_in_one_pocket_makes_that_one_invalid_and_no_other(layup, report):
    one = report.pockets[2]
    centre = layup_centre(one)
    grid = constant()
    i, j = np.rint((centre - grid.origin_mm) / grid.spacing_mm).astype(int)
    grid.values[j, i, 1] = np.nan  # one of the two is enough
    again = make(layup, grid).inspect(layup.scan)
    assert len(again.pockets) == len(report.pockets)
    for a, b in zip(again.pockets, report.pockets, strict=True):
        if a.id != one.id:
            assert a.verdict is b.verdict
            if not a.promoted:  # those are cut out at half the height of a line, and lines follow the field
                assert a.debulked_mm.tobytes() == b.debulked_mm.tobytes()
    lost = again.pockets[2]
    assert lost.verdict is Verdict.INVALID
    assert again.verdict is Verdict.INVALID
    assert lost.net is None
    assert f"({centre[0]:.0f}, {centre[1]:.0f}) mm is NaN" in lost.reason
    assert "give angles that cover the whole ply" in lost.reason


def test_a_pocket_past_the_border_is_invalid_not_given_the_borders_angles(layup, report):
    centre = layup_centre(report.pockets[0])
    left = Grid(np.full((40, 8, 2), (30.0, 120.0)), np.array([centre[0] + 100.0, -1000.0]), 50.0)
    again = make(layup, left).inspect(layup.scan)
    assert again.pockets[0].verdict is Verdict.INVALID
    assert "lies outside their grid" in again.pockets[0].reason


def layup_centre(pocket):
    """Centroid of the outline's area."""
    outline = pocket.outline_mm
    ahead = np.roll(outline, -1, axis=0)
    cross = outline[:, 0] * ahead[:, 1] - ahead[:, 0] * outline[:, 1]
    return ((outline + ahead) * cross[:, None]).sum(axis=0) / (3 * cross.sum())


@pytest.fixture(scope="module")
def drape(layup, plain):
    """The ply draped from one corner, so that its fibres shear."""
    return net.drape(plain.reference, (-300.0, -200.0), (30.0, 120.0), 12.0, layup.ply_outline)


def test_a_drape_is_taken_as_it_is(layup, plain, drape, tmp_path):
    inspector = make(layup, drape)
    report = inspector.inspect(layup.scan)
    assert len(report.pockets) >= 5
    for found, p in zip(inspector.find(layup.scan).pockets, (p for p in report.pockets if not p.promoted), strict=True):
        there = drape.angles_deg(found.pocket.centroid_mm)
        assert np.isfinite(there).all()  # inside the ply it reaches every pocket
        assert angles_at(inspector.fibre_angles_deg, found.pocket.centroid_mm) == pytest.approx(there, abs=0.1)
        assert p.net is not None
        edge = p.net.nodes_mm[p.net.edges[0]]
        step = edge[1] - edge[0]
        assert np.degrees(np.arctan2(step[1], step[0])) % 90 == pytest.approx(there[0] % 90, abs=5)
    inspector.save(tmp_path / "cell.npz")
    again = Inspector.load(tmp_path / "cell.npz").inspect(layup.scan)
    minima = [[p.debulked_mm for p in one.pockets] for one in (again, report)]
    assert all(np.array_equal(a, b) for a, b in zip(*minima, strict=True))


def test_a_seed_and_two_directions_drape_the_ply_over_the_reference(layup, drape):
    draping = net.Draping((-300.0, -200.0), (30.0, 120.0), 12.0)
    draped = make(layup, draping)
    assert draped.fibre_angles_deg.values.tobytes() == checked_angles(drape).values.tobytes()
    with pytest.raises(InputError, match=r"^fibre_angles_deg: seed_mm: expected a point"):
        make(layup, net.Draping((-3000.0, 0.0)))
    for wrong in ({"seed_mm": (1.0, np.nan)}, {"angles_deg": (1.0,)}, {"spacing_mm": 0.0}):
        with pytest.raises(InputError, match=rf"^{next(iter(wrong))}: expected"):
            net.Draping(**{"seed_mm": (0.0, 0.0), **wrong})


def names(report):
    return {one.check: one for one in report.findings if one.at_best is not None}


def test_a_gap_on_a_pockets_flank_is_invalid_and_filled_from_nominal_it_is_not(layup, plain, report, tmp_path):
    rim = report.pockets[1].outline_mm
    seen = constant(10.0)
    seen.values[np.abs(points_of(seen) - rim[0]).max(axis=2) < 15] = np.nan
    assert np.isfinite(angles_at(seen, np.array(layup_centre(report.pockets[1])))).all()
    lost = make(layup, seen).inspect(layup.scan)
    assert lost.verdict is Verdict.INVALID
    finding = names(lost)["fibre_angles"]
    assert np.hypot(*(rim - finding.place_mm).T).min() < 100 and "nominal_angles_deg" in finding.asks
    filled = make(layup, seen, nominal_angles_deg=(30.0, 120.0))
    found = filled.inspect(layup.scan)
    assert found.verdict is report.verdict and "fibre_angles" not in names(found)
    assert [p.verdict for p in found.pockets] == [p.verdict for p in report.pockets]
    filled.save(tmp_path / "cell.npz")
    again = Inspector.load(tmp_path / "cell.npz").inspect(layup.scan)
    assert again.findings == found.findings and again.trace.nominal_angles_map.values.shape == seen.values.shape


def test_a_ply_laid_five_degrees_off_is_invalid_where_a_sensor_saw_it(layup):
    draping = net.Draping((-300.0, -200.0), (30.0, 120.0))
    nominal = make(layup, draping).fibre_angles_deg
    rng = np.random.default_rng(0)
    for off, at_best in ((5.0, Verdict.INVALID), (1.0, None)):
        seen = nominal.values + off + rng.normal(0, 1.5, nominal.values.shape)
        inspector = make(layup, Grid(seen, nominal.origin_mm, nominal.spacing_mm), nominal_angles_deg=draping)
        report = inspector.inspect(layup.scan)
        finding = names(report).get("fibre_angles")
        assert (finding and finding.at_best) is at_best
        if finding:
            assert finding.measured == pytest.approx(5.0, abs=0.3) and "counter-clockwise" in finding.reason
            assert report.verdict is Verdict.INVALID and report.reason.startswith(finding.reason)
            assert repeat(report, layup.scan, layup.reference).same
        assert np.nanmax(report.shear_map.values) > 0


def test_angles_that_come_with_the_scan_are_held_against_the_inspectors_own(layup, plain, report):
    """An inspector that is made with them says the same (`repeat` makes one), and the next scan has its own again."""
    turned = Grid(constant().values + 5.0, constant().origin_mm, 50.0)
    turned.values[:20] = np.nan  # where the sensor saw nothing
    found = plain.inspect(layup.scan, fibre_angles_deg=turned)
    finding = names(found)["fibre_angles"]
    assert found.verdict is Verdict.INVALID and finding.measured == pytest.approx(5.0, abs=0.01)
    assert repeat(found, layup.scan, layup.reference).same
    right = plain.inspect(layup.scan, fibre_angles_deg=constant())
    assert "fibre_angles" not in names(right) and right.trace.fibre_angles_map.values.shape == turned.values.shape
    again = plain.inspect(layup.scan)
    assert again.findings == report.findings and again.trace.fibre_angles_map is None
    for wrong in ((0.0, 90.0), net.Draping((0.0, 0.0), (0.0, 90.0))):
        with pytest.raises(InputError, match="fibre_angles_deg: expected a Grid of what was measured"):
            plain.inspect(layup.scan, fibre_angles_deg=wrong)


def test_a_drape_is_read_closely_where_fibres_shear():
    x, y = np.meshgrid(np.arange(-200.0, 201.0, 10.0), np.arange(-200.0, 201.0, 10.0))
    dome = surface.Reference(np.sqrt(400.0**2 - x**2 - y**2), (-200.0, -200.0), 10.0)
    drape = net.drape(dome, (-120.0, -80.0), (30.0, 120.0), 8.0)
    places = np.random.default_rng(0).uniform(-150, 150, (100, 2))
    there = drape.angles_deg(places)
    assert np.abs(there - (30.0, 120.0)).max() > 2
    grid = checked_angles(drape)
    read = np.array([angles_at(grid, place) for place in places])
    assert np.abs(read - there).max() < 0.6  # a step from cell to cell, on a mold far more curved than a part's


def test_outside_a_drape_nothing_is_known(plain, drape):
    angles = checked_angles(drape)
    assert np.isnan(angles.values).any()
    with pytest.raises(InputError, match="outside their grid"):
        angles_at(angles, drape.nodes_mm[:, :2].max(axis=0) + 40.0)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (Grid(np.full((3, 3, 2), np.nan), np.zeros(2), 1.0), "no point with two known angles"),
        (Grid(np.full((3, 3, 2), np.inf), np.zeros(2), 1.0), "none infinite"),
        (Grid(np.zeros((3, 3)), np.zeros(2), 1.0), r"shape \(3, 3\)"),
        (Grid(np.full((3, 3, 2), (0.0, 90.0)), np.zeros(2), 0.0), "spacing_mm: expected a positive length"),
        (Grid(np.full((3, 3, 2), (0.0, 90.0)), np.array([0.0, np.nan]), 1.0), "origin_mm"),
        ((0.0, np.nan), "fibre_angles_deg: expected two angles"),
        (["0", "90"], "fibre_angles_deg: expected two angles"),
        ((-np.pi / 4, np.pi / 4), "at least 10 degrees apart, .*; are they in radians"),
        ((0.0, 9.0), "at least 10 degrees apart, but got 0 and 9$"),
    ],
)
def test_bad_angles_are_named(value, words):
    with pytest.raises(InputError, match=words):
        checked_angles(value)
