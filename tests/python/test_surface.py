from __future__ import annotations

import doctest
import pickle

import numpy as np
import pytest

import debulk.surface
from debulk import Grid, InputError, cloud, surface


def mold(x, y):
    return x**2 / 4000 - y**2 / 6000 + 0.02 * x


def raised(x, y):
    r = np.hypot(x - 35, y + 50)
    return mold(x, y) + np.where(r < 30, 10 * np.cos(np.pi * np.minimum(r, 30) / 60) ** 2, 0)


def pinhole(surface_height, height=240, width=260, sigma=0.05, seed=0):
    """An exact scan by a tilted camera 2.4 m above, pitch 1 mm, with noise along the ray, in the mold frame."""
    rng = np.random.default_rng(seed)
    tilt = 0.22
    right, forward = np.array([1.0, 0, 0]), np.array([0, np.sin(tilt), -np.cos(tilt)])
    down = np.cross(forward, right)
    column, row = np.meshgrid(np.arange(width) - (width - 1) / 2, np.arange(height) - (height - 1) / 2)
    rays = column[..., None] * right + row[..., None] * down + 2400 * forward
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    eye = -2400 * forward
    along = -eye[2] / rays[..., 2]
    for _ in range(60):
        p = eye + along[..., None] * rays
        along -= (p[..., 2] - surface_height(p[..., 0], p[..., 1])) / rays[..., 2]
    along += rng.normal(0, sigma, along.shape) if sigma else 0
    return (eye + along[..., None] * rays).astype(np.float32)


@pytest.fixture(scope="module")
def scans():
    return pinhole(raised, seed=1), pinhole(mold, seed=2)


def area_above(heights: Grid, level: float) -> float:
    from cv2 import resize  # bilinear, to count finely

    fine = resize(heights.values, None, fx=8, fy=8)
    return float(np.count_nonzero(fine > level)) * (heights.spacing_mm / 8) ** 2


def test_bell_comes_back(scans) -> None:
    scan, before = scans
    heights = surface.height_map(scan, before)
    assert isinstance(heights, surface.HeightMap)
    assert heights.values.dtype == np.float32
    assert heights.measured.dtype == np.bool_
    assert heights.spacing_mm == pytest.approx(1.0, abs=0.03)
    true_area = np.pi * (60 / np.pi * np.arccos(np.sqrt(0.2))) ** 2
    assert area_above(heights, 2.0) == pytest.approx(true_area, rel=0.004)
    smooth = surface.median(heights, 3)
    assert isinstance(smooth, surface.HeightMap)
    assert smooth.measured is heights.measured
    assert np.nanmax(smooth.values) == pytest.approx(10, abs=0.1)


def test_smooth_reference_halves_the_noise(scans) -> None:
    scan, before = scans
    reference = surface.fit_reference(surface.grid_heights(before))
    heights = surface.height_map(scan, reference, 1.0)
    j, i = np.mgrid[: heights.values.shape[0], : heights.values.shape[1]]
    x, y = heights.origin_mm[0] + i * 1.0, heights.origin_mm[1] + j * 1.0
    flat = (np.hypot(x - 35, y + 50) > 32) & heights.measured
    assert np.abs(heights.values[flat].mean()) < 0.002
    against_scan = surface.height_map(scan, before, 1.0)
    assert heights.values[flat].std() < 0.8 * np.nanstd(against_scan.values[np.abs(against_scan.values) < 0.4])


def test_drop_outs_are_filled_and_marked(scans) -> None:
    scan, before = scans[0].copy(), scans[1]
    scan[np.hypot(scan[..., 0] - 35, scan[..., 1] + 50) < 8] = np.nan
    scan[np.hypot(scan[..., 0] + 50, scan[..., 1]) < 14] = np.nan
    heights = surface.height_map(scan, before, 1.0)
    column, row = np.round((np.array([35, -50]) - heights.origin_mm) / 1.0).astype(int)
    assert not heights.measured[row, column]
    assert heights.values[row, column] == pytest.approx(10, abs=0.1)
    column, row = np.round((np.array([-50, 0]) - heights.origin_mm) / 1.0).astype(int)
    assert np.isnan(heights.values[row, column])
    open_map = surface.height_map(scan, before, 1.0, hole_diameter_mm=0)
    np.testing.assert_array_equal(np.isfinite(open_map.values), open_map.measured)
    np.testing.assert_array_equal(open_map.measured, heights.measured)


def test_the_whole_front_end_on_a_dirty_scan() -> None:
    rng = np.random.default_rng(3)
    scan, before = pinhole(raised, seed=4), pinhole(mold, seed=5)
    for points in (scan, before):
        flying = rng.random(points.shape[:2]) < 0.005
        points[flying] += rng.uniform(-20, 20, (np.count_nonzero(flying), 1)).astype(np.float32) * np.float32(
            [0, 0.2, 0.98]
        )
        points[rng.random(points.shape[:2]) < 0.01] = np.nan
        points[~cloud.remove_outliers(points)] = np.nan
    heights = surface.median(surface.height_map(scan, before), 3)
    true_area = np.pi * (60 / np.pi * np.arccos(np.sqrt(0.2))) ** 2
    assert area_above(heights, 2.0) == pytest.approx(true_area, rel=0.005)
    assert np.nanmax(heights.values) == pytest.approx(10, abs=0.15)


def test_flanks_survive_in_a_scan_without_outliers(scans) -> None:
    scan, before = scans[0].copy(), scans[1].copy()
    for points in (scan, before):
        points[~cloud.remove_outliers(points, least_ratio=2.0)] = np.nan
    heights = surface.height_map(scan, before)
    assert np.count_nonzero(heights.measured) > 0.995 * np.count_nonzero(surface.height_map(*scans).measured)


def test_the_same_bits_on_any_number_of_threads(scans) -> None:
    one = surface.height_map(*scans, threads=1)
    for threads in (2, 4):
        other = surface.height_map(*scans, threads=threads)
        np.testing.assert_array_equal(one.values, other.values)
        np.testing.assert_array_equal(one.measured, other.measured)


def test_unorganised_clouds_give_the_same_heights_within_noise(scans) -> None:
    scan, before = scans
    organised = surface.height_map(scan, before, 1.0)
    flat = surface.height_map(scan.reshape(-1, 3), before.reshape(-1, 3), 1.0)
    assert flat.values.shape == organised.values.shape
    both = organised.measured & flat.measured
    assert np.count_nonzero(both) > 0.97 * np.count_nonzero(organised.measured)
    assert np.std((flat.values - organised.values)[both]) < 0.05


def test_grid_heights_on_a_given_and_on_its_own_grid() -> None:
    x, y = np.meshgrid(np.arange(40.0), np.arange(30.0))
    points = np.dstack([x, y, 0.25 * x - 0.5 * y])
    given = surface.grid_heights(points, (1.5, 2.5), 0.5, (10, 20))
    np.testing.assert_allclose(given.values, 0.25 * given.x_mm[None, :] - 0.5 * given.y_mm[:, None], atol=1e-5)
    assert surface.grid_heights(points).values.shape == (30, 40)
    assert np.isnan(surface.grid_heights(points, (100, 100), 1.0, (2, 2)).values).all()


def reference() -> surface.Reference:
    x, y = np.meshgrid(np.arange(0.0, 60.0, 5.0), np.arange(0.0, 50.0, 5.0))
    return surface.Reference(1e-4 * x**3 + 1e-3 * x * y, np.array([0.0, 0.0]), 5.0)


def test_reference_has_the_cubics_value_and_derivatives() -> None:
    ref = reference()
    xy = np.array([[12.3, 7.7], [55.0, 45.0], [0.0, 0.0]])
    x, y = xy.T
    np.testing.assert_allclose(ref.height(xy), 1e-4 * x**3 + 1e-3 * x * y, atol=1e-12)
    np.testing.assert_allclose(ref.gradient(xy), np.stack([3e-4 * x**2 + 1e-3 * y, 1e-3 * x], axis=1), atol=1e-12)
    np.testing.assert_allclose(ref.hessian(xy)[:, 0, 0], 6e-4 * x, atol=1e-12)
    np.testing.assert_allclose(ref.hessian(xy)[:, [0, 1], [1, 0]], 1e-3, atol=1e-12)
    assert isinstance(ref.height((12.3, 7.7)), float)
    assert ref.gradient((12.3, 7.7)).shape == (2,)
    assert ref.hessian((12.3, 7.7)).shape == (2, 2)
    assert ref.height(np.zeros((0, 2))).shape == (0,)


def test_reference_keeps_its_attributes_and_pickles() -> None:
    ref = reference()
    assert isinstance(ref, debulk._core.surface.Surface)
    assert ref.heights_mm.shape == (10, 12)
    assert ref.origin_mm.tolist() == [0, 0]
    assert ref.spacing_mm == 5.0
    again = pickle.loads(pickle.dumps(ref))
    assert again.height((12.3, 7.7)) == ref.height((12.3, 7.7))


@pytest.mark.parametrize(
    ("xy", "message"),
    [
        ((56.0, 10.0), r"\(56, 10\) at index 0"),
        ([[1.0, 1.0], [1.0, -0.1]], r"\(1, -0.1\) at index 1"),
        ((np.nan, 1.0), "nan"),
        ((1.0, 2.0, 3.0), r"shape \(3,\)"),
        ([["a", "b"]], "xy"),
    ],
)
def test_reference_refuses_points_outside(xy, message: str) -> None:
    for ask in (reference().height, reference().gradient, reference().hessian):
        with pytest.raises(InputError, match=message):
            ask(xy)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((np.zeros((3, 8)), (0, 0), 1.0), "heights_mm.*4 by 4"),
        ((np.zeros(8), (0, 0), 1.0), "heights_mm"),
        ((np.full((5, 5), np.nan), (0, 0), 1.0), "row 0, column 0"),
        ((np.zeros((5, 5)), (0, 0, 0), 1.0), "origin_mm"),
        ((np.zeros((5, 5)), (0, np.inf), 1.0), "origin_mm"),
        ((np.zeros((5, 5)), (0, 0), 0.0), "spacing_mm"),
    ],
)
def test_reference_names_what_is_wrong(arguments, message: str) -> None:
    with pytest.raises(InputError, match=message):
        surface.Reference(*arguments)


def test_bad_input_is_named(scans) -> None:
    scan, before = scans
    nothing = np.full((4, 4, 3), np.nan)
    cases = [
        (lambda: surface.height_map(scan[..., :2], before), "scan: expected an"),
        (lambda: surface.height_map(scan, before.astype(int)), "reference_cloud: expected float"),
        (lambda: surface.height_map(nothing, before), "scan: .*none"),
        (lambda: surface.height_map(scan, nothing), "reference: .*none"),
        (lambda: surface.height_map(scan, before + np.float32(1e4)), "overlap"),
        (lambda: surface.height_map(scan, before, 0.0), "spacing_mm"),
        (lambda: surface.height_map(scan, before, 1e-3), "spacing_mm.*2e8"),
        (lambda: surface.height_map(scan, before, hole_diameter_mm=-1), "hole_diameter_mm"),
        (lambda: surface.height_map(scan, before, jump_ratio=1), "jump_ratio"),
        (lambda: surface.grid_heights(scan, (0, 0), 1.0), "both or neither"),
        (lambda: surface.grid_heights(scan, (0, 0), 1.0, (0, 5)), "shape"),
        (lambda: surface.grid_heights(nothing), "points"),
        (lambda: surface.median(Grid(np.zeros((5, 5)), np.zeros(2), 1.0), 4), "size: expected 3 or 5"),
        (lambda: surface.median(Grid(np.zeros((5, 5), dtype=int), np.zeros(2), 1.0)), "grid"),
        (lambda: surface.fit_reference(Grid(np.full((50, 50), np.nan), np.zeros(2), 1.0)), "heights"),
        (lambda: surface.fit_reference(Grid(np.zeros((50, 50)), np.zeros(2), 1.0), -4.0), "spacing_mm"),
    ]
    for call, message in cases:
        with pytest.raises(InputError, match=message):
            call()


def test_doctests() -> None:
    assert doctest.testmod(debulk.surface).failed == 0
