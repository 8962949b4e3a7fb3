"""Fibre directions in a table: the grid of the places, and one clear error for what is none."""

import numpy as np
import pytest

from debulk import InputError, files

PLACES = [(x, y) for y in (10.0, 13.333, 16.667, 20.0) for x in (-5.0, -1.667, 1.667, 5.0, 8.333, 11.667)]


def written(tmp_path, lines):
    path = tmp_path / "angles.csv"
    path.write_text("\n".join(lines))
    return path


def test_the_grid_is_that_of_the_places_in_any_order_whatever_the_file_rounded(tmp_path):
    lines = [f"{x},{y},{x + y},{90 + y}" for x, y in PLACES if (x, y) != (5.0, 13.333)]
    found = files.load_angles(written(tmp_path, ["x [mm],y [mm],warp,weft", *reversed(lines)]))
    assert found.values.shape == (4, 6, 2) and found.spacing_mm == pytest.approx(10 / 3, abs=1e-4)
    np.testing.assert_array_equal(found.origin_mm, [-5, 10])
    assert np.isnan(found.values[1, 3]).all() and np.isnan(found.values).sum() == 2
    np.testing.assert_allclose(found.values[..., 1][:, 0], [100, 103.333, 106.667, 110])
    np.testing.assert_allclose(found.values[0, :, 0], [5, 8.333, 11.667, 15, 18.333, 21.667])
    metres = files.load_angles(written(tmp_path, [f"{x},{y},0,90" for x in (0.0, 0.5) for y in (0.0, 0.5)]), "m")
    assert metres.spacing_mm == 500.0


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        (["0,0,1", "20,0,1"], "expected four columns, x,y,first,second, got 3"),
        (["y,x,first,second", "0,0,0,90", "20,0,0,90"], "expected the columns x,y,first,second in this order"),
        (["x [m],y [m],first,second", "0,0,0,90", "20,0,0,90"], "its columns are in m"),
        (["0,0,0,90", "20,0,0,90", "27,0,0,90"], "expected places of one regular grid"),
        (["0,0,0,90", "0.01,0,0,90", "20000,20000,0,90"], "expected places of one regular grid"),
        (["0,0,0,90", "20,0,0,90", "20,0,1,90"], "one line for each place, but some have two"),
        (["0,0,0,90"], "the ply is 0 mm across"),
        (["0,0,0,nan", "20,0,0,90"], "line 1: expected finite numbers"),
    ],
)
def test_what_is_no_grid_of_directions_is_named(tmp_path, lines, told):
    with pytest.raises(InputError) as error:
        files.load_angles(written(tmp_path, lines))
    assert told in str(error.value) and "angles.csv" in str(error.value)
