"""Text clouds of many writers: what each says, and what is refused because it may say something else."""

import time

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from debulk import InputError, files

SEEN = [[1.5, 2.5, 3.5], [30.5, 40, 50.25]]
PTX = "3\n2\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\n{} 20 30 1\n"


def load(tmp_path, text, name="a.csv", unit="mm"):
    (tmp_path / name).write_bytes(text.encode())
    return files.load_cloud(tmp_path / name, unit)


def error_for(tmp_path, text, name="a.csv"):
    with pytest.raises(InputError) as caught:
        load(tmp_path, text, name)
    said = str(caught.value)
    assert said.startswith(str(tmp_path / name)) and "\n" not in said
    return said


@pytest.mark.parametrize(
    "text",
    [
        "1,5;2,5;3,5\n30,5;40;50,25\n",
        "1,5\t2,5\t3,5\n30,5\t40\t50,25\n",
        "1,5 2,5  3,5\n30,5 40 50,25e0\n",
        '"1,5","2,5","3,5"\n"30,5",40,"50,25"\n',
        '"1,5","2,5","3,5",7\n"30,5",40,"50,25",7\n',
        '"1.5"," 2.5 ","3.5"\n30.5,40,"50.25"\n',
        "1.5|2.5|3.5\n30.5|40|50.25\n",
        "sep=;\r\nX;Y;Z\r\n1,5;2,5;3,5\r\n30,5;40;50,25\r\n",
        "2\n1.5 2.5 3.5 -1900 255 0 0\n30.5 40 50.25 -12 1 1 1\n",
        "Scan 7, by hand\n\nX [mm] Y [mm] Z [mm] I\n1.5 2.5 3.5 7\n30.5 40 50.25 7\n",
        "X_mm;Y_mm;Z_mm;Intensity;\n1.5;2.5;3.5;1;\n30.5;40;50.25;1;\n",
        "id,X,Y,Z\n-,mm,mm,mm\n1,1.5,2.5,3.5\n2,30.5,40,50.25\n",
        ",,\nx,y,z\n1.5,2.5,3.5\n30.5,40,50.25\n",
        ",0,1,2\n0,1.5,2.5,3.5\n1,30.5,40,50.25\n",
        "0,1,2\n1.5,2.5,3.5\n30.5,40,50.25\n",
        "export of mold\n1.5 2.5 3.5 4\n30.5 40 50.25 4\n",
        "//X Y Z R G B\n2\n1.5 2.5 3.5 1 2 3\n30.5 40 50.25 1 2 3\n",
        '"label, long",x,y,z\n"a, b",1.5,2.5,3.5\nc,30.5,40,50.25\n',
        "Pos X,Pos Y,Pos Z\n1.5,2.5,3.5\n30.5,40,50.25\n",
    ],
)
def test_what_writers_write(tmp_path, text):
    for name in ("a.csv", "a.pts", "a.asc"):
        np.testing.assert_array_equal(load(tmp_path, text, name), SEEN)


@pytest.mark.parametrize(
    "word",
    [
        "",
        "NA",
        "N/A",
        "#N/A",
        "null",
        "None",
        "---",
        "-",
        "nan",
        "-nan(ind)",
        "inf",
        "-Infinity",
        "1.#QNAN",
        "-1.#IND00",
    ],
)
def test_nothing_seen(tmp_path, word):
    expected = [[1.5, np.nan, 3.5], [np.nan] * 3, [30.5, 40, 50.25]]
    assert np.isnan(load(tmp_path, "1,#QNAN;-1,#IND;3,5\n1,5;2;3\n40;50;60\n")[0, :2]).all()
    for separator in ",;\t ":
        if word or separator != " ":
            rows = [["1.5", word, "3.5", "1"], [word, word, word, "1"], ["30.5", "40", "50.25", "1"]]
            text = "x y z i\n".replace(" ", separator) + "".join(separator.join(row) + "\n" for row in rows)
            np.testing.assert_array_equal(load(tmp_path, text), expected)


@pytest.mark.parametrize(
    ("text", "part"),
    [
        (
            "1,5,2,5,3,5\n30,5,40,5,50,25\n",
            "line 1: no number has a decimal point, so the commas may be decimal commas",
        ),
        ("1,5, 2,5, 3,5\n30,5, 40,5, 50,2\n", "may be decimal commas"),
        ("1,5,2,3,5\n30,5,40,5,50\n", "may be decimal commas"),
        ("1,-5,2,5\n30,5,40,5\n", "may be decimal commas"),
        ("x,y,z\n1,5,2,5,3,5\n", "3 names over 6 columns (decimal commas?)"),
        (
            "1,5;2,5;3,5\n30,5;4.5;50\n",
            "line 2: expected a number for y, got '4.5', but other numbers have decimal commas",
        ),
        ("0;10;20\n30;4,5;50.5\n", "'50.5', but other numbers have decimal commas"),
        ("1.234,5;2;3\n1;2;3\n", "'1.234,5' (with a sign between thousands?)"),
        ("1,234.5 2 3\n1 2 3\n", "'1,234.5' (with a sign between thousands?)"),
        ("1,234,567;2;3\n1;2;3\n", "(with a sign between thousands?)"),
        ("1O 20 30\n0 10 20\n30 40 50\n", "line 1: expected at least 3 numbers, got '1O 20 30'"),
        ("0 10 20\n30 4O 50\n", "line 2: expected a number for y, got '4O'"),
        ("3\n0 10 20\n30 40 50\n", "expected 3 lines of 3 numbers after the header, found 2"),
        (
            "2\n0 10 20 1\n30 40 50 1\n2\n0 10 20 1\n30 40 50 1\n",
            "expected 2 lines of 4 numbers after the header, found 5",
        ),
        ("99999999999\n0 10 20\n", "the file ends, but its header promises 99999999999 points"),
        ("x,y,z\n[m],[m],[m]\n0,10,20\n", "line 2: its columns are in m; load it with that unit (--unit m)"),
        ("X (µm),Y (µm),Z (µm)\n0,10,20\n", "line 1: its columns are in µm; convert it to mm or m"),
        ("East;North;Up;\n0;10;20;\n", "expected columns named x, y and z, got 'East;North;Up;'; name them"),
        (" ".join(["1.5"] * 640), "640 columns without the names x, y and z; debulk.files.load_heights reads a matrix"),
        ("ncols 40\nnrows 2\ncellsize 1\n" + " ".join(["1.5"] * 40), "load_heights"),
    ],
)
def test_nothing_is_guessed(tmp_path, text, part):
    assert part in error_for(tmp_path, text)


def test_whole_numbers_between_commas_need_names(tmp_path):
    expected = [[1, 5, 2], [30, 5, 40]]
    np.testing.assert_array_equal(load(tmp_path, "x,y,z,i\n1,5,2,5\n30,5,40,5\n"), expected)
    np.testing.assert_array_equal(load(tmp_path, "1, 5, 2, 5\n30, 5, 40, 5\n"), expected)
    np.testing.assert_array_equal(load(tmp_path, "1,5,2,5\n30,5,40.0,5\n"), expected)  # one point says it all


def test_a_long_line_of_blanks_takes_no_time(tmp_path):
    began = time.process_time()
    load(tmp_path, f"x{' ' * 60_000}y\n0,10,20\n30,40,50\n")
    assert time.process_time() - began < 5  # 25 s where a regular expression starts again at each blank


def rows_of(points, before):
    return "".join(
        " ".join([*map(str, place), *(f"{v:.3f}" for v in row)]) + "\n"
        for place, row in zip(before, points, strict=True)
    )


def test_an_index(tmp_path):
    points = np.random.default_rng(2).uniform(0.1, 90, (60, 3)).round(3).astype(np.float32)
    for start in (0, 1):
        for unit, factor in (("mm", 1), ("m", 1000)):
            found = load(tmp_path, rows_of(points, [(k + start,) for k in range(60)]), unit=unit)
            np.testing.assert_allclose(found, points * factor, rtol=1e-6)
    for before in ([(2 * k,) for k in range(60)], [(k + 5,) for k in range(60)], [(k + (k > 40),) for k in range(60)]):
        assert "is the first column an index, or x?" in error_for(tmp_path, rows_of(points, before))
    assert "is the first column" in error_for(tmp_path, rows_of(points[:9], [(k,) for k in range(9)]))
    of_an_image = rows_of(points, [(k // 8, k % 8) for k in range(60)])
    assert "the row and the column of an image, or x and y?" in error_for(tmp_path, of_an_image)
    assert load(tmp_path, f"row column x y z\n{of_an_image}").shape == (60, 3)
    raster = "".join(f"{k % 10} {k // 10} {z:.2f} 7\n" for k, z in enumerate(points[:, 2]))  # x, y, z and an intensity
    np.testing.assert_array_equal(load(tmp_path, raster)[:12, 0], [*range(10), 0, 1])


def test_decimal_commas_and_points_say_the_same_of_any_size(tmp_path):
    points = np.random.default_rng(3).normal(0, 300, (40_000, 3)).astype(np.float32)
    points[7] = np.nan
    files.save_cloud(tmp_path / "a.txt", points)
    text = (tmp_path / "a.txt").read_text()
    assert load(tmp_path, text.replace(".", ","), "b.txt").tobytes() == points.tobytes()
    assert load(tmp_path, text.replace(".", ",").replace(" ", ";"), "b.txt").tobytes() == points.tobytes()


def test_ptx(tmp_path):
    rows = [f"{v} 1 {v / 7:.6f} 0.5 9 9 9" for v in range(10, 70, 10)]
    rows[2] = "0 0 0 0.5 0 0 0"
    body = "".join(f"{row}\n" for row in rows)
    points = load(tmp_path, PTX.format(0).replace("20 30", "0 0") + body, "a.ptx", "m")
    assert points.shape == (2, 3, 3) and np.isnan(points[0, 1]).all()
    np.testing.assert_array_equal(points[:, 2, 0], [50_000, 60_000])
    with pytest.warns(files.CloudWarning, match=r"moves the points by 36055.5 mm and turns them by 0 degrees"):
        np.testing.assert_array_equal(load(tmp_path, PTX.format(0) + body, "a.ptx", "m"), points)
    for text, part in (
        (PTX.format(0) + body[:-40], "expected 6 lines of 7 numbers after the header, found 5"),
        (PTX.format(0) + body + rows[0], "expected 6 lines of 7 numbers after the header, found 7"),
        (PTX.format("x") + body, "line 10: expected 4 numbers of the header, got 'x 20 30 1'"),
        (PTX.format(0).replace("3\n2\n", "99999999\n99999999\n") + body, "the file ends"),
        (PTX.format(0), "line 11: expected x y z and more"),
    ):
        assert part in error_for(tmp_path, text, "a.ptx")


WORDS = st.sampled_from(
    ["1.5", "2,5", "-3", "40", "1e3", "1e400", "nan", "1.#QNAN", "NA", "---", "", '"', '"7,5"', "x", "y", "z", "X [mm]",
     "mm", "sep=", "#", "//", "0", "1", "2", "\0", "\u00e9", "1.2.3", "1,2,3", "+-1", "\ufeff"]
)  # fmt: skip


@settings(max_examples=600, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    lines=st.lists(st.lists(WORDS, max_size=7), max_size=30),
    separator=st.sampled_from([",", ";", "\t", " ", ", ", "|"]),
    ending=st.sampled_from(["csv", "pts", "asc", "ptx", "xyz"]),
    head=st.sampled_from(["", "x;y;z\n", "2\n", "sep=;\n", PTX.format(0)]),
)
def test_anything_is_a_cloud_or_one_error(tmp_path, lines, separator, ending, head):
    text = head + "".join(separator.join(line) + "\n" for line in lines)
    try:
        points = load(tmp_path, text, f"a.{ending}")
        assert points.size <= 3 * text.count("\n") and not np.isinf(points).any()
    except InputError as error:
        assert str(error).startswith(str(tmp_path / f"a.{ending}")) and "\n" not in str(error)
