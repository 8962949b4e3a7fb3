"""Matrices of heights: places from the pitch, and nothing seen where the file says so."""

import os

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from debulk import InputError, files

Z = np.array([[1.5, 1.75, np.nan, 2.0], [1.25, 1.5, 1.75, 2.5], [2.0, 1.0, 1.5, 3.0]])


def load(tmp_path, name, data, *pitch, **how):
    (tmp_path / name).write_bytes(data if isinstance(data, bytes) else data.encode())
    return files.load_heights(tmp_path / name, *pitch, **how)


def error_for(tmp_path, name, data, *pitch, **how):
    with pytest.raises(InputError) as caught:
        load(tmp_path, name, data, *pitch, **how)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def table(separator, missing="", comma=False, end=""):
    text = "".join(
        separator.join(missing if np.isnan(v) else str(v).replace(".", "," if comma else ".") for v in row) + end + "\n"
        for row in Z
    )
    return text


@pytest.mark.parametrize(
    "text",
    [
        table(","),
        table(";", "---", comma=True),
        table("\t", comma=True),
        table(" ", "1.#QNAN"),
        table(" ", "NA", comma=True),
        table(",", end=","),
        "Gocator, surface\nheights in mm\n" + table(","),
        "X Resolution (mm),0.5\nY Resolution (mm),0.5\n\n" + table(","),
        '"Unit","mm"\n"XY Calibration","47.171","um"\n"Horizontal","4"\n"Vertical","3"\n\n"Height"\n' + table(","),
        ",0,1,2,3\n" + "".join(f"{k},{row}" for k, row in enumerate(table(",").splitlines(True))),
    ],
)
def test_text(tmp_path, text):
    points = load(tmp_path, "a.csv", text, (10.0, -20.0))
    assert points.shape == (3, 4, 3) and points.dtype == np.float32
    np.testing.assert_array_equal(points[..., 2], Z)
    np.testing.assert_array_equal(points[1:, :, 0], [[0, 10, 20, 30]] * 2)
    np.testing.assert_array_equal(points[..., 1].T, [[0, -20, -40]] * 4)
    in_metres = load(tmp_path, "a.csv", text, (10.0, 20.0), "m")
    np.testing.assert_allclose(in_metres[..., 2], 1000 * Z)
    assert in_metres[2, 0, 1] == 40


def test_lines_of_nothing_keep_their_place(tmp_path):
    points = load(tmp_path, "a.csv", ",,,\n" + table(",") + ",,,\n", (10.0, 20.0))
    assert points.shape == (5, 4, 3) and np.isnan(points[[0, 4], :, 2]).all()
    np.testing.assert_array_equal(points[1:4, :, 2], Z)


def test_the_pitch_that_a_file_says(tmp_path):
    esri = "ncols 4\nnrows 3\nxllcorner 7\nyllcorner 8\ncellsize 10\nNODATA_value -9999\n" + table(" ", "-9999")
    axes = "".join(
        f"{edge}{row}"
        for edge, row in zip(("Y/X,0,10,20,30\n0,", "-10,", "-20,"), table(",").splitlines(True), strict=False)
    )
    for text in (esri, axes, axes.replace("Y/X", "")):
        for pitch in (None, (10.0, -10.0)):
            points = load(tmp_path, "a.asc", text, pitch)
            np.testing.assert_array_equal(points[..., 2], Z)
            np.testing.assert_array_equal(points[2, 3, :2], [30, -20])
        assert "expected 10 and 10 mm, as" in error_for(tmp_path, "a.asc", text, (20.0, 10.0))
    assert "nrows and ncols to be 3 and 4" in error_for(tmp_path, "a.asc", esri.replace("nrows 3", "nrows 4"))


def test_numbers_over_and_beside_heights_are_no_heights(tmp_path):
    z = np.random.default_rng(4).normal(12, 1, (21, 22)).round(4)
    rows = [",".join(map(str, row)) for row in z]
    beside = [f"{0.5 * k},{row}" for k, row in enumerate(rows)]
    over = ",".join(map(str, 0.25 * np.arange(22)))
    points = load(tmp_path, "a.csv", "\n".join([f"0.0,{over}", *beside]))
    np.testing.assert_allclose(points[..., 2], z, rtol=1e-6)
    np.testing.assert_allclose(points[-1, -1, :2], [21 * 0.25, 10])
    assert "its first line rises evenly" in error_for(tmp_path, "a.csv", "\n".join([over, *rows]), (9, 9))
    assert "its first column rises evenly" in error_for(tmp_path, "a.csv", "\n".join(beside), (9, 9))
    plane = "\n".join(",".join(f"{5 + 0.25 * i + 0.5 * j}" for i in range(30)) for j in range(30))
    assert load(tmp_path, "a.csv", plane, (9, 9)).shape == (30, 30, 3)


def test_pictures_and_arrays(tmp_path):
    steps = np.arange(12, dtype=np.uint16).reshape(3, 4) * 100 + 20_000
    steps[0, :2] = 0
    np.save(tmp_path / "a.npy", steps)
    cv2.imwrite(str(tmp_path / "a.png"), steps)
    for name in ("a.npy", "a.png"):
        data = (tmp_path / name).read_bytes()
        points = load(tmp_path, name, data, (10.0, -10.0), missing=0, scale_mm=0.001, offset_mm=-20.0)
        expected = np.where(steps == 0, np.nan, steps * 0.001 - 20)
        np.testing.assert_allclose(points[..., 2], expected, atol=1e-6)
        assert "give scale_mm, the height of one step" in error_for(tmp_path, name, data, (10.0, 10.0))
        far = error_for(tmp_path, name, data, (10.0, 10.0), scale_mm=0.001)
        assert "0 stands at 16.67% of the places, far from all other heights" in far and "missing=0" in far
    np.save(tmp_path / "b.npy", np.asfortranarray(Z))
    np.testing.assert_array_equal(files.load_heights(tmp_path / "b.npy", (10.0, 10.0))[..., 2], Z)


@pytest.mark.parametrize(
    ("name", "data", "how", "part"),
    [
        (
            "a.csv",
            table(","),
            {},
            "expected pitch_mm, the distances of columns and of rows in mm, since the file has none",
        ),
        ("a.csv", table(","), {"pitch_mm": (0.0, 1.0)}, "that are not 0"),
        ("a.csv", table(","), {"pitch_mm": 1.0}, "pitch_mm: expected the distances"),
        ("a.csv", table(",").replace(".", ","), {"pitch_mm": (9, 9)}, "expected 7 heights, got 8"),
        ("a.csv", "1,5,1,6\n1,4,1,5\n", {"pitch_mm": (9, 9)}, "the commas may be decimal commas"),
        ("a.csv", "1,5;1,6\n1,4;1.5\n", {"pitch_mm": (9, 9)}, "decimal points or decimal commas in all heights"),
        ("a.csv", "1_5;1_6\n1_4;1_5\n", {"pitch_mm": (9, 9)}, "line 1: expected heights, got"),
        ("a.csv", "1.5,1.6\n1.7\n", {"pitch_mm": (9, 9)}, "line 2: expected 2 heights, got 1"),
        ("a.csv", "1.5,1.6\n1.7,1.O\n", {"pitch_mm": (9, 9)}, "line 2: expected a height in column 2, got '1.O'"),
        ("a.csv", "1.5,1.6\n", {"pitch_mm": (9, 9)}, "two lines and two columns at least"),
        ("a.csv", "nan,nan\nnan,nan\n", {"pitch_mm": (9, 9)}, "nothing was seen"),
        (
            "a.csv",
            "-99999.99,1.5\n1.6,1.7\n",
            {"pitch_mm": (9, 9)},
            "if it means that nothing was seen, give missing=",
        ),
        ("a.csv", table(","), {"pitch_mm": (0.01, 0.01)}, "too small for a scanned ply"),
        ("a.csv", "", {"pitch_mm": (9, 9)}, "expected a matrix of heights"),
        ("a.tif", "II*", {"pitch_mm": (9, 9)}, "save it as a 16-bit .png"),
        ("a.png", "junk", {"pitch_mm": (9, 9)}, "does not start like a .png"),
        ("a.npy", "junk", {"pitch_mm": (9, 9)}, "not a readable .npy header"),
    ],
)
def test_what_is_refused(tmp_path, name, data, how, part):
    assert part in error_for(tmp_path, name, data, **how)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    parts=st.lists(
        st.sampled_from(
            [
                "1.5",
                "2",
                ",",
                ";",
                "\t",
                " ",
                "\n",
                "\n",
                "-",
                "NA",
                '"',
                "ncols 2\n",
                "cellsize 1\n",
                "x",
                "1e999",
                "#",
                "_",
            ]
        ),
        max_size=40,
    ),
    before=st.booleans(),
)
def test_anything_else_is_one_error(tmp_path, parts, before):
    text = "".join(parts)
    try:
        points = load(tmp_path, "a.csv", text + table(",") if before else table(",") + text, (10.0, 10.0))
        assert points.ndim == 3 and points.size <= 3 * (len(text) + 99)
    except InputError as error:
        assert str(error).startswith(str(tmp_path / "a.csv"))


@pytest.mark.parametrize("kind", ["heights", "mask", "cloud"])
def test_an_array_that_is_cut_while_it_is_read_is_named(tmp_path, monkeypatch, kind):
    path = tmp_path / "a.npy"
    array, load = {
        "heights": (Z, lambda: files.load_heights(path, 0.5)),
        "mask": (Z > 1.5, lambda: files.load_mask(path)),
        "cloud": (np.asfortranarray(np.dstack([Z, Z, Z])), lambda: files.load_cloud(path)),
    }[kind]
    np.save(path, array)
    whole = np.fromfile

    def cut(file, **how):
        os.truncate(path, path.stat().st_size - array.itemsize)
        return whole(file, **how)

    monkeypatch.setattr(np, "fromfile", cut)
    with pytest.raises(InputError, match=r"a\.npy: .*the file ended while it was read"):
        load()
