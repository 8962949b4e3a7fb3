"""Values of a grid at places."""

import numpy as np
import pytest

from debulk import _core
from debulk.grid import Grid


def one_by_one(grid: Grid, xy: np.ndarray, beyond: float) -> np.ndarray:
    """Return what `Grid.at` does, for one place after the other."""
    out = np.full(xy.shape[:-1], beyond)
    for place in np.ndindex(out.shape):
        column, row = (round(float(c)) for c in (xy[place] - grid.origin_mm) / grid.spacing_mm)  # halves: to even
        if 0 <= row < grid.values.shape[0] and 0 <= column < grid.values.shape[1]:
            out[place] = grid.values[row, column]
    return out


@pytest.mark.parametrize("kind", [np.float32, np.float64, np.bool_, np.uint8])
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("shape", [(2,), (400, 2), (7, 9, 2), (0, 2)])
def test_the_value_is_that_of_the_nearest_grid_point(kind, turned, shape):
    rng = np.random.default_rng(3)
    values = (3 * rng.random((11, 14))).astype(kind)
    grid = Grid(values.T if turned else values, np.array([-2.0, 5.0]), 0.5)
    inside = np.array([-2.0, 5.0]) + 0.25 * rng.integers(0, 20, shape)  # also halfway between grid points
    for xy in (inside, np.asfortranarray(inside), inside + 4.0 * rng.integers(-1, 2, shape)):
        for beyond in (np.nan, -1.0):
            at = grid.at(xy, beyond)
            assert isinstance(at, np.ndarray)
            assert at.dtype == np.float64
            np.testing.assert_array_equal(at, one_by_one(grid, xy, beyond))


def test_a_grid_without_points_has_no_value():
    grid = Grid(np.zeros((0, 5)), np.zeros(2), 1.0)
    assert np.isnan(grid.at(np.array([[1.0, 0.0], [3.0, 2.0]]))).all()


def test_points_over_marks_are_those_at_which_the_grid_has_them():
    random = np.random.default_rng(3)
    grid = Grid(random.random((40, 50)) > 0.4, np.array([-7.3, 12.1]), 1.7)
    points = (random.random((20_000, 3)) * 130 - 40).astype(np.float32)
    points[::11, 2] = np.nan
    box = np.array([[-20.0, 0.0], [70.0, 60.0]])
    marks = [(grid.values, grid.origin_mm, grid.spacing_mm)]
    moved, on = _core.cloud.points_over(points, None, box, marks, threads=2, stop=_core.Stop())
    xy = points[:, :2].astype(np.float64)
    inside = ((xy >= box[0]) & (xy <= box[1])).all(axis=1) & np.isfinite(points[:, 2])
    assert np.array_equal(moved, points, equal_nan=True)
    assert np.array_equal(on > 0, inside & (grid.at(xy, beyond=0.0) > 0))
    assert 0.1 < np.mean(on) < 0.5
    assert not len(_core.cloud.points_over(points[:0], np.eye(4), box, marks, threads=2, stop=_core.Stop())[1])
