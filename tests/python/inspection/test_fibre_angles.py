"""Fibre angles: two numbers, a map with gaps, or a drape; and what happens to a pocket where they are not known."""

import numpy as np
import pytest

from debulk import Grid, InputError, Inspector, Recipe, Verdict, net, scenes, surface
from debulk.inspection.ply.fibre_angles import angles_at, checked_angles

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
    given = {"mold_from_scanner": layup.mold_from_scanner, "fibre_angles_deg": angles, **more}
    return Inspector(Recipe(**FEW), layup.reference, layup.ply_outline, **given)


def constant(spacing_mm=50.0) -> Grid:
    shape = (round(2000 / spacing_mm), round(2000 / spacing_mm), 2)
    return Grid(np.full(shape, (30.0, 120.0)), np.array([-1000.0, -1000.0]), spacing_mm)


def test_a_map_gives_the_angles_of_its_nearest_point():
    values = np.arange(24.0).reshape(3, 4, 2)
    grid = checked_angles(Grid(values, np.array([10.0, 20.0]), 5.0))
    assert angles_at(grid, np.array([10.0, 20.0])).tolist() == values[0, 0].tolist()
    assert angles_at(grid, np.array([22.4, 27.6])).tolist() == values[2, 2].tolist()
    for place in ([7.4, 20.0], [27.6, 20.0], [10.0, 17.4], [10.0, 32.6]):  # more than half a step past the border
        with pytest.raises(InputError, match=rf"\({place[0]:.0f}, {place[1]:.0f}\) mm lies outside their grid"):
            angles_at(grid, np.array(place))


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
        (Grid(np.zeros((3, 3, 2)), np.zeros(2), 0.0), "spacing_mm: expected a positive length"),
        (Grid(np.zeros((3, 3, 2)), np.array([0.0, np.nan]), 1.0), "origin_mm"),
        ((0.0, np.nan), "fibre_angles_deg: expected two angles"),
        (["0", "90"], "fibre_angles_deg: expected two angles"),
    ],
)
def test_bad_angles_are_named(value, words):
    with pytest.raises(InputError, match=words):
        checked_angles(value)
