"""Windows of a grid and marks that grow, against what plain loops say."""

import numpy as np
import pytest

from debulk.grid import Grid
from debulk.inspection.clouds.thinning import window_of
from debulk.inspection.evidence.pieces import grown

pytestmark = pytest.mark.unit


def _plain(marks, cells):
    out = np.zeros_like(marks)
    for j, i in np.argwhere(marks):
        out[max(0, j - cells) : j + cells + 1, max(0, i - cells) : i + cells + 1] = True
    return out


@pytest.mark.parametrize("cells", [0, 1, 2, 3, 4, 5, 12, 13, 14, 40, 41])
def test_marks_grow_by_so_many_cells_along_each_axis(cells):
    marks = np.random.default_rng(cells).random((37, 29)) < 0.004
    marks[0, 0] = marks[20, 28] = True
    before = marks.copy()
    np.testing.assert_array_equal(grown(marks, cells), _plain(marks, cells))
    np.testing.assert_array_equal(marks, before)
    assert not grown(np.zeros((5, 6), dtype=bool), cells).any()


def test_a_window_holds_the_box_and_its_margin_as_far_as_the_grid_goes():
    grid = Grid(np.arange(20.0 * 30).reshape(20, 30), np.array([-5.0, 100.0]), 0.5)
    rows, columns = grid.around(np.array([[-3.0, 102.0], [0.0, 104.0]]), 1.0)
    assert (rows, columns) == (slice(2, 11), slice(2, 13))
    window = grid.part(rows, columns)
    assert (window.x_mm[0], window.x_mm[-1], window.y_mm[0], window.y_mm[-1]) == (-4.0, 1.0, 101.0, 105.0)
    np.testing.assert_array_equal(window.values, grid.values[2:11, 2:13])
    assert grid.around(np.array([[-3.0, 102.0], [0.0, 104.0]]), 99.0) == (slice(0, 20), slice(0, 30))


@pytest.mark.parametrize("box_mm", [(-20, 102, -10, 104), (20, 102, 30, 104), (-3, 80, 0, 90), (-3, 120, 0, 130)])
def test_a_window_off_the_grid_is_empty(box_mm):
    """An end before the first row or column would count from the last one."""
    grid = Grid(np.zeros((20, 30)), np.array([-5.0, 100.0]), 0.5)
    assert not grid.values[grid.around(np.array(box_mm, dtype=np.float64).reshape(2, 2), 1.0)].size


@pytest.mark.parametrize("box_mm", [(-3, 102, 0, 104), (-7, 99, -4, 101), (8, 108, 12, 111), (-20, 80, -10, 90)])
def test_a_part_over_a_box_is_what_a_wider_grid_holds_with_nan_beyond(box_mm):
    values = np.arange(20.0 * 30, dtype=np.float32).reshape(20, 30)
    wide = Grid(np.pad(values, 50, constant_values=np.nan), np.array([-30.0, 75.0]), 0.5)
    box = np.array(box_mm, dtype=np.float64).reshape(2, 2)
    part, whole = Grid(values, np.array([-5.0, 100.0]), 0.5).over(box, 1.0), wide.part(*wide.around(box, 1.0))
    np.testing.assert_array_equal(part.values, whole.values)
    np.testing.assert_array_equal(part.origin_mm, whole.origin_mm)
    assert part.values.dtype == np.float32
    xy = np.stack(np.meshgrid(whole.x_mm + 0.2, whole.y_mm - 0.2), axis=-1)
    np.testing.assert_array_equal(wide.on_grid(whole.x_mm + 0.2, whole.y_mm - 0.2), wide.at(xy))


def test_a_window_is_a_copy_also_where_it_is_the_whole_grid():
    grid = Grid(np.zeros((4, 5)), np.zeros(2), 1.0)
    grid.part(slice(0, 4), slice(0, 5)).values[:] = np.nan
    assert np.isfinite(grid.values).all()


@pytest.mark.parametrize("every", [1, 3])
def test_the_window_of_an_image_holds_all_that_is_wanted_and_little_more(every):
    """Also where only every third row and column was seen."""
    row, column = np.mgrid[:700, :900].astype(np.float32)
    image = np.dstack([column, row, 0 * row])
    image[(row % every != 1 % every) | (column % every != 1 % every)] = np.nan

    def wanted(points):
        return np.hypot(points[:, 0] - 640, points[:, 1] - 250) < 120

    marks = np.zeros(row.shape, dtype=bool)
    marks[window_of(image, wanted)] = True
    assert marks[np.hypot(column - 640, row - 250) < 120].all()
    assert 240**2 < np.count_nonzero(marks) < 270**2
    assert window_of(image, lambda points: np.zeros(len(points), dtype=bool)) == np.s_[:, :]
