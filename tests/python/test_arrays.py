from __future__ import annotations

import time

import numpy as np
import pytest

from debulk import InputError, arrays, cloud


def circle(count, radius=100.0):
    turn = np.linspace(0, 2 * np.pi, count, endpoint=False)
    return radius * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def test_an_outline_comes_back_as_a_copy_without_repeated_corners():
    given = np.array([[0, 0], [0, 0], [10, 0], [10, 10], [10, 10], [0, 0]], dtype=float)
    got = arrays.outline(given, "ply_outline")
    assert got.tolist() == [[0, 0], [10, 0], [10, 10]]
    given[:] = 7
    assert got.max() == 10


@pytest.mark.parametrize("count", [3, 4, 700, 20_000])
def test_a_round_outline_does_not_cross_itself(count):
    assert len(arrays.outline(circle(count), "o")) == count


def plain_crossing(outline):
    """Hold every side against every other."""
    ends = np.roll(outline, -1, axis=0)
    i, j = np.triu_indices(len(outline), 1)
    a, b, c, d = outline[i], ends[i], outline[j], ends[j]

    def side(p, q, r):
        return (q[:, 0] - p[:, 0]) * (r[:, 1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (r[:, 0] - p[:, 0])

    return bool(((side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0)).any())


@pytest.mark.parametrize("seed", range(40))
def test_a_shaken_outline_crosses_itself_where_every_side_held_against_every_other_says_so(seed):
    rng = np.random.default_rng(seed)
    outline = circle(int(rng.integers(3, 300)))
    outline += rng.normal(0, rng.choice([0.01, 0.3, 1.0, 5.0]), outline.shape)
    if plain_crossing(outline):
        with pytest.raises(InputError, match=r"its sides .* cross near"):
            arrays.outline(outline, "o")
    else:
        arrays.outline(outline, "o")


def test_an_outline_of_many_corners_takes_no_long_time():
    along = np.linspace(0, 1, 20_000, endpoint=False)[:, None]
    box = np.array([[0.0, 0.0], [900.0, 0.0], [900.0, 600.0], [0.0, 600.0]])
    outline = np.concatenate([a + (b - a) * along for a, b in zip(box, np.roll(box, -1, axis=0), strict=True)])
    begin = time.process_time()
    assert len(arrays.outline(outline, "o")) == 80_000
    assert time.process_time() - begin < 10  # 0.6 s; every side against all at its x took minutes


@pytest.mark.parametrize("seed", range(20))
def test_two_swapped_corners_cross(seed):
    rng = np.random.default_rng(seed)
    outline = circle(int(rng.integers(4, 3000)))
    i, j = rng.choice(len(outline), 2, replace=False)
    outline[[i, j]] = outline[[j, i]]
    with pytest.raises(InputError, match=r"its sides .* cross near"):
        arrays.outline(outline, "o")


def test_a_crossing_is_found_where_it_is():
    with pytest.raises(InputError, match=r"sides 1 and 3 cross near \(5, 5\) mm"):
        arrays.outline([[0, 0], [10, 10], [10, 0], [0, 10]], "o")


def test_sides_that_only_touch_do_not_cross():
    arrays.outline([[0, 0], [10, 0], [10, 10], [5, 0], [0, 10]], "o")


@pytest.mark.parametrize(
    ("value", "reason"),
    [
        ([[0, 0], [1, 1]], "at least 3 corners"),
        ([[0, 0], [0.1, 0], [0, 0.1]], "round an area in mm"),
        ([[0, 0], [1e9, 0], [0, 1e9]], "within 100 m"),
        ([[0, 0], [np.nan, 0], [0, 1]], "finite"),
        ([[0, 0, 0]] * 4, "shape"),
        (np.ma.masked_equal([[0.0, 0], [9, 0], [0, 9]], 9), "masked array"),
    ],
)
def test_what_is_no_outline(value, reason):
    with pytest.raises(InputError, match=rf"^o: .*{reason}"):
        arrays.outline(value, "o")


@pytest.mark.parametrize(
    "matrix", [np.diag([1, 1, -1, 1]), np.diag([2, 2, 2, 1]), np.eye(4) + 0.1, np.full((4, 4), np.nan), np.eye(3)]
)
def test_what_is_no_rigid_motion(matrix):
    with pytest.raises(InputError, match=r"^pose: "):
        arrays.rigid(matrix, "pose")


def test_masked_points_were_not_seen():
    points = np.ma.masked_array(np.ones((5, 3)), mask=[[0] * 3, [1, 0, 0], [0] * 3, [0] * 3, [0] * 3])
    got = cloud.as_cloud(points, "scan")
    assert np.isnan(got[1, 0])
    assert np.isfinite(np.delete(got, 1, axis=0)).all()
    with pytest.raises(InputError, match=r"^scan: expected float32 or float64"):
        cloud.as_cloud(np.ma.masked_array(np.ones((5, 3), dtype=int)), "scan")


@pytest.mark.parametrize("kind", [">f4", ">f8"])
def test_floats_of_the_other_byte_order_are_taken(kind):
    points = np.array([[1.5, 2.5, np.nan], [3.25, 4.0, 5.0]])
    got = cloud.as_cloud(points.astype(kind), "scan")
    assert got.dtype == np.dtype("=f4")
    np.testing.assert_array_equal(got, points.astype(np.float32))
    swapped = np.ma.masked_array(points.astype(kind), mask=[[0, 0, 0], [1, 1, 1]])
    assert np.isnan(cloud.as_cloud(swapped, "scan")[1]).all()


@pytest.mark.parametrize("kind", [np.float16, int, np.uint8])
def test_numbers_of_another_type_are_refused_with_a_remedy(kind):
    with pytest.raises(
        InputError, match=r"^scan: expected float32 or float64 .*; pass them as \.astype\(numpy\.float32\)"
    ):
        cloud.as_cloud(np.ones((5, 3), dtype=kind), "scan")
