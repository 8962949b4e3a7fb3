from __future__ import annotations

import doctest

import numpy as np
import pytest
from scipy.spatial import cKDTree

import debulk.cloud
from debulk import InputError, cloud


def sheet(height: int, width: int, seed: int) -> np.ndarray:
    """A noisy sheet with flying pixels and missing points."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(0.55 * np.arange(width), 0.55 * np.arange(height))
    points = np.dstack([x, y, 0.001 * x * y]) + rng.normal(0, 0.03, (height, width, 3))
    points[rng.random((height, width)) < 0.005, 2] += rng.uniform(-20, 20)
    points[rng.random((height, width)) < 0.02, 1] = np.nan
    return points.astype(np.float32)


def pcdenoise(points: np.ndarray, neighbours: int, std_ratio: float) -> np.ndarray:
    flat = points.reshape(-1, 3).astype(np.float64)
    seen = np.isfinite(flat).all(axis=1)
    distances = cKDTree(flat[seen]).query(flat[seen], neighbours + 1)[0][:, 1:].mean(axis=1)
    keep = np.zeros(len(flat), dtype=bool)
    keep[seen] = distances <= distances.mean() + std_ratio * distances.std(ddof=1)
    return keep.reshape(points.shape[:-1])


@pytest.mark.parametrize(("neighbours", "std_ratio"), [(4, 1.0), (1, 0.5), (8, 2.0)])
def test_removal_agrees_with_an_independent_pcdenoise(neighbours: int, std_ratio: float) -> None:
    points = sheet(90, 120, 1)
    expected = pcdenoise(points, neighbours, std_ratio)
    keep = cloud.remove_outliers(points, neighbours, std_ratio)
    assert keep.dtype == np.bool_
    assert keep.shape == (90, 120)
    np.testing.assert_array_equal(keep, expected)
    np.testing.assert_array_equal(cloud.remove_outliers(points.reshape(-1, 3), neighbours, std_ratio), expected.ravel())


def test_the_same_bits_on_any_number_of_threads() -> None:
    points = sheet(120, 150, 2)
    one = cloud.remove_outliers(points, threads=1)
    for threads in (2, 4):
        np.testing.assert_array_equal(cloud.remove_outliers(points, threads=threads), one)


def test_types_and_layouts_make_no_difference_and_input_stays() -> None:
    points = sheet(40, 50, 3)
    before = points.copy()
    keep = cloud.remove_outliers(points)
    np.testing.assert_array_equal(cloud.remove_outliers(points.astype(np.float64)), keep)
    np.testing.assert_array_equal(cloud.remove_outliers(np.asfortranarray(points)), keep)
    np.testing.assert_array_equal(cloud.remove_outliers(points[::-1, ::-1])[::-1, ::-1], keep)
    np.testing.assert_array_equal(points, before)


def test_a_pinhole_camera_makes_no_difference_to_what_is_removed() -> None:
    rng = np.random.default_rng(5)
    column, row = np.meshgrid(np.arange(160.0), np.arange(120.0))
    depth = 900 + 6 * np.sin(column / 17) + rng.normal(0, 0.05, column.shape)
    depth[rng.random(depth.shape) < 0.01] += 8.0
    depth[rng.random(depth.shape) < 0.05] = np.nan
    points = (depth[..., None] * np.dstack([(column - 80) / 700, (row - 61) / 700, np.ones_like(row)])).astype(
        np.float32
    )
    anywhere = cloud.remove_outliers(points.reshape(-1, 3)).reshape(depth.shape)  # no image: searched in space
    assert 50 < np.count_nonzero(np.isfinite(depth) & ~anywhere) < 1000
    for camera in (None, (700.0, 80.0, 61.0), (300.0, 0.0, 0.0)):  # fitted, right, wrong
        np.testing.assert_array_equal(cloud.remove_outliers(points, camera=camera), anywhere)


def test_removal_stops_when_told() -> None:
    stop = debulk._core.Stop()
    stop.cancel()
    with pytest.raises(RuntimeError, match="stopped"):
        cloud.remove_outliers(sheet(30, 30, 4), stop=stop)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"neighbours": 0}, "neighbours: expected 1 to 1000, but got 0"),
        ({"neighbours": 2.5}, "neighbours.*whole.*2.5"),
        ({"std_ratio": -1}, "std_ratio"),
        ({"std_ratio": np.nan}, "std_ratio"),
        ({"least_ratio": -1}, "least_ratio"),
        ({"camera": (700.0, 80.0)}, "camera: expected .f, cx, cy. in pixels"),
        ({"camera": (0.0, 80.0, 61.0)}, "camera: expected a positive focal length"),
    ],
)
def test_removal_refuses_bad_options(options: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        cloud.remove_outliers(sheet(5, 5, 1), **options)


@pytest.mark.parametrize(
    "points",
    [
        np.zeros(3),
        np.zeros((4, 2)),
        np.zeros((2, 2, 2, 3)),
        np.zeros((4, 3), dtype=int),
        np.zeros((4, 3), dtype=object),
        np.zeros((4, 3), dtype=complex),
        "cloud",
    ],
)
@pytest.mark.parametrize(
    "function",
    [cloud.checked, cloud.remove_outliers, cloud.median_pitch, lambda points: cloud.transform(points, np.eye(4))],
)
def test_every_function_names_a_cloud_that_is_none(function, points) -> None:
    with pytest.raises(InputError, match="points: expected"):
        function(points)


def test_checked_copies_only_what_it_must() -> None:
    points = sheet(30, 40, 5)
    assert cloud.checked(points) is points
    assert cloud.checked(points.astype(np.float64)).dtype == np.float32


def test_checked_tells_metres_and_empty_clouds() -> None:
    with pytest.raises(InputError, match=r"scan: .*metres.*times 1000.*--unit m"):
        cloud.checked(sheet(30, 40, 5) / 1000, "scan")
    cloud.checked(sheet(30, 40, 5) / 1000, check_unit=False)
    with pytest.raises(InputError, match=r"scan: .*finite.*none of 12"):
        cloud.checked(np.full((3, 4, 3), np.nan), "scan")
    with pytest.raises(InputError, match="none of 0"):
        cloud.checked(np.zeros((0, 3)))


def test_transform_is_the_matrix_product() -> None:
    points = sheet(30, 40, 6)
    angle = 0.3
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    matrix[:3, 3] = 100, 200, -2400
    moved = cloud.transform(points, matrix)
    expected = (points.astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)
    seen = np.isfinite(points).all(axis=-1)
    np.testing.assert_allclose(moved[seen], expected[seen], rtol=1e-6)
    assert np.isnan(moved[~seen]).all()


@pytest.mark.parametrize(
    ("matrix", "message"),
    [
        (np.eye(3), r"shape \(3, 3\)"),
        (2 * np.eye(4), "bottom row"),
        (np.diag([2.0, 2, 2, 1]), "orthonormal"),
        (np.diag([1.0, 1, -1, 1]), "mirror"),
        (np.full((4, 4), np.nan), "finite"),
        (np.array([["a"] * 4] * 4), "numbers"),
    ],
)
def test_transform_refuses_what_is_not_rigid(matrix: np.ndarray, message: str) -> None:
    with pytest.raises(InputError, match=message):
        cloud.transform(np.zeros((4, 3)), matrix)


def test_doctests() -> None:
    assert doctest.testmod(debulk.cloud).failed == 0


def test_the_median_pitch_of_many_points_is_exact() -> None:
    noise = np.random.default_rng(0)
    places = np.dstack(np.meshgrid(np.arange(400.0), np.arange(300.0))) + noise.uniform(-0.4, 0.4, (300, 400, 2))
    places[:, 200:, 0] *= 3
    places[noise.random((300, 400)) < 0.1] = np.nan
    points = np.dstack([places, np.zeros((300, 400))]).astype(np.float32)
    beside = [points[:-1, 1:, :2] - points[:-1, :-1, :2], points[1:, :-1, :2] - points[:-1, :-1, :2]]
    apart = np.concatenate([np.hypot(d[..., 0], d[..., 1]).ravel() for d in beside])
    apart = np.sort(apart[np.isfinite(apart)])
    assert len(apart) > 100_000
    assert cloud.median_pitch(points) == apart[len(apart) // 2]
