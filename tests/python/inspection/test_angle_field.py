"""Fields of fibre angles: shear against closed forms, gaps, and how far a ply lies from nominal."""

import numpy as np
import pytest

from debulk import Grid, InputError, Recipe, Verdict, fibre, net
from debulk.inspection.checks import fibre_angles
from debulk.inspection.ply.angle_field import (
    Turned,
    across_gaps,
    averaged,
    completed,
    nominal_on,
    shear_of,
    turned,
)
from debulk.inspection.ply.fibre_angles import checked_angles, points_of
from debulk.inspection.ply.fibre_runs import ScanRuns
from debulk.inspection.ply.ply_on_mold import PlyOnMold
from debulk.surface import Reference

pytestmark = pytest.mark.unit
SQUARE = np.array([(-90.0, -90.0), (90.0, -90.0), (90.0, 90.0), (-90.0, 90.0)])


def surface_of(height, half=200.0):
    x = np.arange(-half, half + 1, 5.0)
    return Reference(height(*np.meshgrid(x, x)), (-half, -half), 5.0)


PLANE = surface_of(lambda x, y: 0.3 * x - 0.2 * y)


def field(first=0.0, second=90.0, spacing_mm=10.0, half=100.0):
    n = round(2 * half / spacing_mm) + 1
    return Grid(np.full((n, n, 2), (first, second)), np.array([-half, -half]), spacing_mm)


def between(grid, xy):
    """Interpolate a grid's values at places."""
    at = (xy - grid.origin_mm) / grid.spacing_mm
    i, j = np.floor(at).astype(int).T
    u, v = (at - np.floor(at)).T
    v00, v10, v01, v11 = (grid.values[j + b, i + a] for b in (0, 1) for a in (0, 1))
    return (1 - v) * ((1 - u) * v00 + u * v10) + v * ((1 - u) * v01 + u * v11)


def test_shear_on_a_plane_is_that_of_the_angles_in_its_tangent_plane():
    flat = surface_of(lambda x, y: 0 * x)
    assert np.abs(shear_of(field(20.0, 110.0), flat, None).values).max() < 1e-5
    assert shear_of(field(0.0, 60.0), flat, None).values == pytest.approx(30.0, abs=1e-5)
    assert shear_of(field(0.0, 120.0), flat, None).values == pytest.approx(30.0, abs=1e-5)
    u, v = np.array([1.0, 0.0, 0.3]), np.array([0.0, 1.0, -0.2])
    exact = 90 - np.degrees(np.arccos(abs(u @ v) / np.linalg.norm(u) / np.linalg.norm(v)))
    assert shear_of(field(), PLANE, None).values == pytest.approx(exact, abs=1e-5)


def test_a_ply_draped_over_a_cylinder_does_not_shear():
    cylinder = surface_of(lambda x, y: np.sqrt(400.0**2 - y**2))
    for angles in ((0.0, 90.0), (30.0, 120.0)):  # at the crest, where the tangent plane is level
        shear = shear_of(checked_angles(net.Draping((0.0, 0.0), angles).on(cylinder)), cylinder, SQUARE)
        assert np.nanmax(shear.values) < 0.1


def crossing_on_a_sphere(s):
    """Solve s w'' + w' = -sin w, w(0) = pi / 2: the angle between fibres from great circles, s = u v / R²."""
    steps = np.linspace(0, s.max(), 4001)
    h, w, slope, out = steps[1], np.pi / 2, -1.0, [np.pi / 2]

    def bend(s, w, slope):
        return (-np.sin(w) - slope) / s if s > 0 else 0.0

    for at in steps[:-1]:
        a = slope, bend(at, w, slope)
        b = slope + h / 2 * a[1], bend(at + h / 2, w + h / 2 * a[0], slope + h / 2 * a[1])
        c = slope + h / 2 * b[1], bend(at + h / 2, w + h / 2 * b[0], slope + h / 2 * b[1])
        d = slope + h * c[1], bend(at + h, w + h * c[0], slope + h * c[1])
        w, slope = (x + h / 6 * (k + 2 * m + 2 * n + o) for x, k, m, n, o in zip((w, slope), a, b, c, d, strict=True))
        out.append(w)
    return np.interp(s, steps, out)


def test_shear_on_a_hemisphere_is_that_of_its_equation():
    known = 90 - np.degrees(crossing_on_a_sphere(np.array([0.25, 0.5, 1.0])))
    assert known == pytest.approx([14.274, 28.257, 54.318], abs=2e-3)  # docs/model.md, section 2
    radius = 250.0
    dome = surface_of(lambda x, y: np.sqrt(radius**2 - np.minimum(x**2 + y**2, 240.0**2)))
    ply = net.drape(dome, (0, 0), (0, 90), 4.0, [(-140, -140), (140, -140), (140, 140), (-140, 140)])
    # A chord of 4 mm is an arc of radius times the angle that it spans.
    steps = ply.lattice * 2 * np.arcsin(4.0 / (2 * radius))
    there = ply.inside & (np.abs(ply.nodes_mm[:, :2]) < 130).all(axis=1)
    s = np.abs(steps[there].prod(axis=1))
    exact = 90 - np.degrees(crossing_on_a_sphere(s))
    assert exact.max() > 16
    read = between(shear_of(checked_angles(ply), dome, None), ply.nodes_mm[there, :2])
    off = np.abs(read - exact)
    assert off[s > 0.02].max() < 0.25  # beside the first paths |90 - angle| has a kink, which no map resolves
    assert off.max() < 0.6


def test_a_shear_map_of_a_fine_field_is_no_finer_than_it_need_be():
    assert shear_of(field(spacing_mm=1.0), PLANE, None).spacing_mm == 5.0
    beyond = shear_of(field(half=300.0), PLANE, SQUARE)
    far = np.abs(points_of(beyond)).max(axis=2)
    assert np.isfinite(beyond.values[far < 85]).all() and np.isnan(beyond.values[far > 95]).all()


def test_the_gaps_of_measured_angles_are_filled_from_nominal_and_pairs_put_in_its_order():
    nominal, seen = field(0.0, 90.0), field(1.0, 271.0)
    seen.values[3] = seen.values[3, :, ::-1]  # a sensor does not know which family is the first
    seen.values[5, 6] = np.nan, 91.0
    both = completed(seen, nominal_on(np.array([0.0, 90.0]), seen))
    assert both.values[5, 6].tolist() == [0.0, 90.0]
    rest = np.delete(both.values.reshape(-1, 2), 5 * 21 + 6, axis=0)
    assert np.unique(rest, axis=0).tolist() == [[1.0, 271.0]]
    assert completed(seen, nominal).values == pytest.approx(both.values)
    with pytest.raises(InputError, match="only with a field of measured ones"):
        nominal_on(np.array([0.0, 90.0]), np.array([1.0, 91.0]))


@pytest.mark.parametrize("way", [1, -1])
def test_a_ply_laid_five_degrees_off_is_seen_through_a_sensors_noise(way):
    rng = np.random.default_rng(0)
    seen = field(30.0, 120.0)
    noise = rng.normal(0, 2.0, seen.values.shape) + 180 * rng.integers(-1, 2, seen.values.shape)
    off = turned(Grid(seen.values + 5.0 * way + noise, seen.origin_mm, 10.0), field(30.0, 120.0), SQUARE)
    assert off.median_deg == pytest.approx(5.0, abs=0.3) and off.signed_deg == pytest.approx(5.0 * way, abs=0.3)
    assert 17**2 <= off.places <= 19**2  # points within the ply
    right = turned(Grid(seen.values + noise, seen.origin_mm, 10.0), field(30.0, 120.0), SQUARE)
    assert right.median_deg < 2.0


def test_a_ply_turned_by_half_a_right_angle_is_off_in_either_order():
    rng = np.random.default_rng(1)
    seen = field(45.0, 135.0)
    off = turned(Grid(seen.values + rng.normal(0, 1, seen.values.shape), seen.origin_mm, 10.0), field(), None)
    assert off.median_deg == pytest.approx(45, abs=1.5)
    with pytest.raises(InputError, match="no place has both"):
        turned(seen, field(np.nan, np.nan), None)


def test_single_drop_outs_are_closed_and_wider_gaps_are_not():
    seen = field(10.0, 95.0)
    seen.values[4, 4, 1] = np.nan
    seen.values[10:13, 10:13] = np.nan
    whole = averaged(seen)
    assert np.argwhere(np.isnan(whole.values).any(axis=2)).tolist() == [[11, 11]]  # 20 mm from the next known one
    there = whole.values[np.isfinite(whole.values).all(axis=2)]
    assert there % 180 == pytest.approx(np.array([[10.0, 95.0]] * 440))  # of an axis, either direction
    coarse = field(spacing_mm=20.0)
    assert averaged(coarse) is coarse
    # How much a direction changes in 10 mm on a sphere of 400 mm, where the ply shears by up to 30 degrees.
    s = np.linspace(0.0, 0.53, 200)
    shear = 90 - np.degrees(crossing_on_a_sphere(s))
    assert shear[-1] == pytest.approx(30, abs=0.5)
    across = 2 * np.sqrt(s[1:]) * 10 / 400  # change of u v / R² along the diagonal, u = v
    assert (np.diff(shear) / np.diff(s) * across).max() / 2 < 1.0  # shared by the two families


def test_noise_is_averaged_whatever_half_turns_it_has_and_families_that_change_places_are_not():
    rng = np.random.default_rng(2)
    seen = field(88.0, 178.0, spacing_mm=5.0)
    noisy = Grid(seen.values + rng.normal(0, 3.0, seen.values.shape), seen.origin_mm, 5.0)
    noisy.values[...] += 180 * rng.integers(-1, 2, noisy.values.shape)
    mean = averaged(noisy).values
    assert np.abs(mean - noisy.values).max() < 20  # the same one of an axis's directions
    off = (mean - seen.values + 90) % 180 - 90
    assert off[2:-2, 2:-2].std() < 3.0 / 5 * 1.2  # 25 points
    mixed = seen.values.copy()
    swaps = rng.random((41, 20)) < 0.5  # in one half of the field
    mixed[:, :20][swaps] = mixed[:, :20][swaps][:, ::-1]
    known = np.isfinite(averaged(Grid(mixed, seen.origin_mm, 5.0)).values).all(axis=2)
    assert known[:, :18].mean() < 0.1 and known[:, 23:].all()
    turns = np.where(np.indices(seen.values.shape).sum(axis=0) % 2 == 0, 0.0, 90.0)
    with pytest.raises(InputError, match="give the same family first everywhere"):
        averaged(Grid(turns, seen.origin_mm, 5.0))
    # So it is where the directions are too far apart to be averaged: no line follows the one family, then the other.
    wide = Grid(mixed, seen.origin_mm, 20.0)
    wide.values[:, 30:] += np.linspace(0, 40, 11)[None, :, None]  # a field that turns by 4 degrees from place to place
    judged = averaged(wide).values
    known = np.isfinite(judged).all(axis=2)
    assert known[:, :18].mean() < 0.3 and known[:, 21:].all()
    assert np.array_equal(judged[known], wide.values[known])


def test_lines_go_on_across_a_gap_along_what_is_known_nearest():
    one = field(10.0, 80.0)
    one.values[:, 12:] = 40.0, 110.0
    one.values[8:12, 5:9] = np.nan
    across = across_gaps(one)
    assert across.values[9, 6].tolist() == [10.0, 100.0]  # at right angles in the gap
    assert np.isfinite(across.values).all()
    known = np.isfinite(one.values)
    assert np.array_equal(across.values[known], one.values[known])
    assert across_gaps(whole := field()) is whole


def test_parts_of_a_field_count_from_a_size_on_and_the_largest_is_named():
    marked = np.zeros((21, 21), dtype=bool)
    marked[2:4, 2:4], marked[10:15, 3:9], marked[18, 18] = True, True, True
    area_mm2, (x, y) = fibre_angles.marked_area(marked, field(), 400.0)
    assert area_mm2 == 3400.0  # not that of the single point
    assert -70 <= x <= -20 and 0 <= y <= 40
    assert fibre_angles.marked_area(marked, field(), 3000.0)[0] == 3000.0
    assert fibre_angles.marked_area(marked, field(), 3001.0) is None


def findings_of(ply, runs=None):
    return [(one.check, one.at_best) for one in fibre_angles.findings(runs, ply)]


def test_the_turn_is_judged_at_its_limit():
    def ply(off):
        return PlyOnMold(PLANE, SQUARE, field(), Recipe(verdict={"max_turn_deg": 4.0}), Turned(off, -off, 100))

    assert findings_of(ply(4.0)) == []
    assert findings_of(ply(4.01)) == [("fibre_angles", Verdict.INVALID)]
    (one,) = fibre_angles.findings(None, ply(5.0))
    assert "5.0 degrees clockwise from nominal" in one.reason and (one.measured, one.limit) == (5.0, 4.0)
    assert "lay the ply anew" in one.asks


def runs_over_a_bell(angles, high_mm):
    flat = surface_of(lambda x, y: 0 * x)
    x, y = np.meshgrid(np.arange(-90.0, 91.0), np.arange(-90.0, 91.0))
    r = np.minimum(np.hypot(x - 30, y), 30.0)
    heights = Grid(0.3 + high_mm * np.cos(np.pi * r / 60) ** 2, np.array([-90.0, -90.0]), 1.0)
    measured = fibre.measure(heights, flat, across_gaps(angles), SQUARE)
    return ScanRuns(measured.runs, measured.largest, None, None)


def test_a_fibre_that_may_be_too_long_where_nobody_knows_how_it_runs_is_invalid():
    gap = field()
    gap.values[np.abs(points_of(gap) - (30, 20)).max(axis=2) < 12] = np.nan  # on the bell's flank
    ply = PlyOnMold(PLANE, SQUARE, gap, Recipe())
    assert findings_of(ply, runs_over_a_bell(gap, 6.0)) == [("fibre_angles", Verdict.INVALID), ("fibre_angles", None)]
    assert findings_of(ply, runs_over_a_bell(gap, 1.5)) == [("fibre_angles", None)]  # 0.1 mm, whichever way it runs
    known = PlyOnMold(PLANE, SQUARE, field(), Recipe())
    assert findings_of(known, runs_over_a_bell(gap, 6.0)) == []
    aside = field()
    aside.values[np.abs(points_of(aside) - (-60, 0)).max(axis=2) < 12] = np.nan
    assert findings_of(PlyOnMold(PLANE, SQUARE, aside, Recipe()), runs_over_a_bell(aside, 6.0)) == [
        ("fibre_angles", None)
    ]


def test_angles_that_end_beside_the_ply_are_no_gap_and_those_that_end_on_it_are():
    def ply(half, outline):
        return PlyOnMold(PLANE, outline, field(half=half), Recipe())

    runs = runs_over_a_bell(field(), 6.0)
    assert findings_of(ply(90.0, SQUARE), runs) == []
    assert findings_of(ply(40.0, SQUARE), runs)[0] == ("fibre_angles", Verdict.INVALID)
    assert findings_of(ply(40.0, None), runs) == [("fibre_angles", Verdict.INVALID)]
    point = Grid(np.full((3, 3, 2), (0.0, 90.0)), np.array([1e9, 0.0]), 1e-6)  # of another frame, far too fine
    elsewhere = PlyOnMold.of(PLANE, SQUARE, point, None, Recipe())
    elsewhere.prepare()
    assert findings_of(elsewhere, runs)[0] == ("fibre_angles", Verdict.INVALID)
    assert np.isnan(elsewhere.shear.values).all() and fibre_angles.locked(elsewhere) == []


def test_a_locked_part_is_named_from_the_area_of_the_smallest_pocket_on():
    flat = surface_of(lambda x, y: 0 * x)
    sheared = field()
    sheared.values[3:5, 3:5, 1] = 40.0  # 50 degrees of shear on 4 cm²

    def ply(**recipe):
        return PlyOnMold(flat, SQUARE, sheared, Recipe(**recipe))

    (one,) = fibre_angles.locked(ply())
    assert one.at_best is None and one.measured == pytest.approx(50) and one.limit == 45
    assert one.place_mm in {(-70.0, -70.0), (-60.0, -60.0), (-70.0, -60.0), (-60.0, -70.0)}
    assert fibre_angles.locked(ply(material={"locking_deg": 50.5})) == []
    assert fibre_angles.locked(ply(segmentation={"area_tol_mm2": 401.0})) == []
    assert fibre_angles.locked(PlyOnMold(flat, SQUARE, np.array([0.0, 40.0]), Recipe())) == []


def test_a_hemisphere_draped_from_its_side_locks_and_is_not_all_reached():
    def dome(x, y):
        r = np.hypot(x, y)
        return np.sqrt(np.maximum(150.0**2 - r**2, 30.0**2))

    mold, corners = surface_of(dome), 140.0 / 90.0 * SQUARE

    def said(seed):
        ply = PlyOnMold.of(mold, corners, checked_angles(net.drape(mold, seed, (0, 90), 4.0, corners)), None, Recipe())
        return {one.check: one for one in (*fibre_angles.findings(None, ply), *fibre_angles.locked(ply))}

    from_top, from_side = said((0, 0)), said((100, -100))
    assert set(from_top) == {"locked"} and 45 < from_top["locked"].measured < 65
    assert set(from_side) == {"fibre_angles", "locked"} and from_side["fibre_angles"].at_best is None
    assert from_side["fibre_angles"].measured > 20_000 and from_side["locked"].measured > 75
