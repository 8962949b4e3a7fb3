"""Every kind of cloud file: what comes out, and what is said of files that are not what they seem."""

import bz2
import gzip
import lzma
import os
import pickle
import socket
import struct
import warnings
import zipfile
from codecs import BOM_UTF8
from pathlib import Path

import numpy as np
import pytest

import cloud_files as made
from debulk import InputError, files

HERE = Path(__file__).resolve().parents[1]
CAPTURES = HERE.parents[2] / "shared" / "data" / "organised_clouds"


def cloud(*shape):
    points = np.random.default_rng(1).normal(0, 300, (*shape, 3)).astype(np.float32)
    points.reshape(-1, 3)[::5] = np.nan
    return points


def same_bits(a, b):
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def load(tmp_path, name, data, unit="mm"):
    (tmp_path / name).write_bytes(data)
    return files.load_cloud(tmp_path / name, unit)


def error_for(tmp_path, name, data, unit="mm"):
    with pytest.raises(InputError) as caught:
        load(tmp_path, name, data, unit)
    text = str(caught.value)
    assert text.startswith(str(tmp_path / name)) and "\n" not in text
    return text.removeprefix(str(tmp_path / name))


ORGANISED = made.all_kinds(cloud(7, 9))
UNORGANISED = made.all_kinds(cloud(40))


@pytest.mark.parametrize(("name", "data"), ORGANISED, ids=[name for name, _ in ORGANISED])
def test_organised(tmp_path, name, data):
    points = load(tmp_path, name, data)
    expected = cloud(7, 9)
    if name.endswith(made.TEXT_ENDINGS):
        expected = expected.reshape(-1, 3)
    assert same_bits(points, expected)
    assert points.flags.c_contiguous and points.flags.writeable


@pytest.mark.parametrize(("name", "data"), UNORGANISED, ids=[name for name, _ in UNORGANISED])
def test_unorganised_and_metres(tmp_path, name, data):
    assert same_bits(load(tmp_path, name, data), cloud(40))
    in_metres = made.all_kinds(cloud(40) / np.float32(128))
    points = load(tmp_path, name, dict(in_metres)[name], "m")
    np.testing.assert_array_equal(points, (cloud(40).astype(float) * (1000 / 128)).astype(np.float32))


@pytest.mark.parametrize("name", ["office1", "milk_cartoon_all_small_clorox"])
def test_captures_of_a_depth_camera(name):
    path = CAPTURES / f"{name}.pcd"
    if not path.is_file():
        pytest.skip("the captures in ../shared/data are not there")
    with warnings.catch_warnings():  # old versions of PCL wrote half a turn where they meant the identity
        warnings.simplefilter("ignore", files.CloudWarning)
        points = files.load_cloud(path, unit="m")
    assert points.shape == (480, 640, 3) and points.dtype == np.float32
    seen = np.isfinite(points).all(axis=2)
    assert np.isnan(points[~seen]).any() and 0.3 < seen.mean() < 0.95
    # A pinhole camera of some 525 pixels: x = (u - cx) z / f. So rows and columns are in their places.
    v, u = np.nonzero(seen)
    x, y, z = points[seen].astype(float).T
    for place, side, centre in ((u, x, 319.5), (v, y, 239.5)):
        focal, middle = np.polyfit(side / z, place, 1)
        residual = place - (focal * side / z + middle)
        assert 500 < focal < 600 and abs(middle - centre) < 30 and np.abs(residual).max() < 1.0
    assert 300 < np.median(z) < 10_000
    with pytest.raises(InputError, match=r"give unit=\"m\" \(--unit m\)"):
        files.load_cloud(path)


@pytest.mark.parametrize("ending", [".ply", ".pcd", ".xyz", ".csv"])
def test_an_editors_byte_order_mark_is_passed_over(tmp_path, ending):
    points = np.random.default_rng(1).normal(0, 300, (60, 3)).astype(np.float32)
    files.save_cloud(tmp_path / f"a{ending}", points)
    data = (tmp_path / f"a{ending}").read_bytes()
    assert same_bits(load(tmp_path, f"b{ending}", BOM_UTF8 + data), points)
    assert "does not start like" in error_for(tmp_path, "a.npy", BOM_UTF8 + b"\x93NUMPY")


def test_pages_after_a_compressed_pcd_are_passed_over(tmp_path):
    data = made.compressed_pcd(cloud(7, 9))
    assert same_bits(load(tmp_path, "a.pcd", data + b"\0" * 4000), cloud(7, 9))
    assert "70000 bytes follow" in error_for(tmp_path, "a.pcd", data + b"\0" * 70_000)


def test_a_compressed_pcd_that_lies(tmp_path):
    data = made.compressed_pcd(cloud(7, 9))
    start = data.index(b"compressed\n") + len(b"compressed\n")
    packed, unpacked = struct.unpack_from("<II", data, start)

    def sizes(a, b):
        return data[:start] + struct.pack("<II", a, b) + data[start + 8 :]

    assert "1 lack" in error_for(tmp_path, "a.pcd", sizes(packed + 1, unpacked))
    assert "1 lack" in error_for(tmp_path, "a.pcd", data[:-1])
    assert "the compressed data 4294967295 bytes" in error_for(tmp_path, "a.pcd", sizes(packed, 2**32 - 1))
    assert f"byte {start}: 3 compressed bytes cannot hold" in error_for(tmp_path, "a.pcd", sizes(3, unpacked))
    assert "the compressed data end inside" in error_for(tmp_path, "a.pcd", sizes(packed - 30, unpacked))
    assert "the file ends" in error_for(tmp_path, "a.pcd", data[: start + 5])
    wrong = bytearray(data)
    wrong[start + 8] = 0xFF
    text = error_for(tmp_path, "a.pcd", bytes(wrong))
    assert f"byte {start + 11}: the compressed data refer to what is before their start" in text


@pytest.mark.parametrize(
    ("text", "rows"),
    [
        ("0 10 20\n30 40 50", 2),
        ("0\t10\t20\r\n30\t40\t50\r\n", 2),
        ("\ufeffX;Y;Z\n0;10;20\n30;40;50\n", 2),
        ('"x (mm)" , "y (mm)","z (mm)"\n0, 10, 20\n\n30 ,40 ,50\n', 2),
        ("// by CloudCompare\n//X Y Z R G B\n0 10 20 255 0 9\n30 40 50 255 0 9\n", 2),
        ("# z y x\n# mm\n20 10 0\n50 40 30\n", 2),
        ("# z y x\n20 10 0 7\n50 40 30 7\n", 2),
        ("# the columns are x y z\n0 10 20\n30 40 50\n", 2),
        ("quality,z,label,x,y\nhigh,20,a b,0,10\n,50,,30,40\n", 2),
        ("x y z nx\n0 10 20 1 # first\n# none\n30 40 50 1\n", 2),
        ("Points:0,Points:1,Points:2,Normals:0\n0,10,20,1\n30,40,50,1\n", 2),
        ("0,10,20,\n30,40,50,\n", 2),
        ("+0 1e1 .2E2\nnan NaN -nan\n30 40 50\n", 3),
    ],
)
def test_text(tmp_path, text, rows):
    points = load(tmp_path, "a.txt", text.encode())
    assert points.shape == (rows, 3)
    np.testing.assert_array_equal(points[[0, -1]], [[0, 10, 20], [30, 40, 50]])


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("x y z\n0 10 20\n\n30 forty 50\n", "line 4: expected a number for y, got 'forty'"),
        ("0 10 20\n30 40\n", "line 2: expected 3 numbers, found 2"),
        ("0 10 20\n30 40 50 60\n", "line 2: expected 3 numbers, found more"),
        ("0 10\n30 40\n", "line 1: expected at least 3 numbers"),
        ("x y z\na b c\n0 10 20\n", "line 2: expected at least 3 numbers, got 'a b c'"),
        ("east north up\n0 10 20\n", "line 1: expected columns named x, y and z, got 'east north up'; name them"),
        ("x y x\n0 10 20\n", "expected columns named"),
        ("x y z r\n0 10 20\n", "line 1: 4 names over 3 columns"),
        ("x_m,y_m,z_m\n0,10,20\n", "line 1: its columns are in m; load it with that unit (--unit m)"),
        ("x y z\n", "no points"),
        ("# nothing\n", "no points"),
        ("\n" * 70_000, "no points"),
        ("0 10 20\n30 4\0 50\n", "line 2: expected a number"),
        ("\0" * 50, "byte 0: a zero byte in a text file"),
        ("0 10 20\n" + "3" * 2_000_000, "a line of more than"),
        ("5" * 70_000, "line 1: a line of more than"),
        ("1 " * 5000, "5000 columns"),
    ],
)
def test_text_that_cannot_be_read(tmp_path, text, part):
    answer = error_for(tmp_path, "a.csv", text.encode())
    assert part in answer and answer.startswith(": byte ") and ";" in answer


def test_lines_are_counted_in_files_with_a_header(tmp_path):
    data = made.pcd(b"1 2 3\n4 5 oops\n", "ascii")
    line = data[: data.index(b"oops")].count(b"\n") + 1
    assert f"byte {data.index(b'oops')}: line {line}: expected a number for z" in error_for(tmp_path, "a.pcd", data)


def test_a_unit_that_cannot_be_right(tmp_path):
    points = cloud(40) / 500
    data = made.npy(points)
    text = error_for(tmp_path, "a.npy", data)
    assert "mm across, too small for a scanned ply" in text and 'give unit="m" (--unit m)' in text
    assert load(tmp_path, "a.npy", data, "m").shape == (40, 3)
    text = error_for(tmp_path, "a.npy", made.npy(cloud(40)), "m")
    assert "m across, too large for a scanned ply" in text and 'give unit="mm" (--unit mm)' in text
    assert "check the unit of the export" in error_for(tmp_path, "a.npy", made.npy(points / 1000), "m")


@pytest.mark.parametrize("name", [name for name, _ in UNORGANISED])
@pytest.mark.parametrize(
    ("value", "part"),
    [
        (7.0, "all points seen lie at (7, 7, 7)"),
        (0.0, "nothing was seen"),
        (np.nan, "nothing was seen"),
        (np.inf, "point 0: x = inf"),
    ],
)
def test_clouds_that_are_no_scan(tmp_path, name, value, part):
    data = dict(made.all_kinds(np.full((40, 3), value, dtype=np.float32)))[name]
    if np.isinf(value) and (name.endswith(made.TEXT_ENDINGS) or name.startswith("ascii")):
        part = "nothing was seen"  # as text says it
    assert part in error_for(tmp_path, name, data)


@pytest.mark.parametrize("away_mm", [0.0, 5e6])
def test_zeros_where_nothing_was_seen(tmp_path, away_mm):
    points = cloud(30, 40).astype(np.float64) + away_mm
    points[3, 4] = 0  # up to three may lie there by rounding
    if not away_mm:
        assert not np.isnan(load(tmp_path, "a.npy", made.npy(points))[3, 4]).any()
    points[5, 1:5] = 0  # and a few in one place are a mark, too
    expected = np.where((points == 0).all(axis=2, keepdims=True), np.nan, points)
    for name, data in (("a.npy", made.npy(points)), ("a.ply", made.ply(points, kind="double"))):
        with pytest.warns(files.CloudWarning, match=r"5 of its points lie at \(0, 0, 0\): they are read as NaN"):
            read = load(tmp_path, name, data)
        np.testing.assert_array_equal(read, expected if away_mm else expected.astype(np.float32))


def test_integers_are_refused_in_plain_arrays(tmp_path):
    integers = np.arange(30, dtype=np.int32).reshape(10, 3)  # which may be a picture, as in (H, W, 3) uint8
    assert "expected float32 or float64, got int32" in error_for(tmp_path, "a.npy", made.npy(integers))


PCD = made.pcd(cloud(2, 3).tobytes(), WIDTH="3", HEIGHT="2", POINTS="6")


@pytest.mark.parametrize("extension", ["npy", "npz", "ply", "pcd", "xyz", "csv", "txt", "pts", "ptx"])
@pytest.mark.parametrize(
    ("data", "part"),
    [
        (gzip.compress(PCD), "gzip data; let its name end in .gz"),
        (bz2.compress(PCD), "bzip2 data; unpack it first"),
        (lzma.compress(PCD), "xz data; unpack it first"),
        (b"\n <!DOCTYPE html><html><body>404</body></html>", "a web page; the download went wrong"),
        (b"<html>", "a web page"),
        (b"version https://git-lfs.github.com/spec/v1\n", "a Git LFS pointer"),
        (pickle.dumps(np.zeros(3)), "a Python pickle; pickles are never read"),
        (b"\x89PNG\r\n\x1a\n", "a picture"),
        ("1 2 3\n".encode("utf-16"), "UTF-16 text; save it as UTF-8"),
        (b"", "the file is empty"),
        (made.ply(cloud(4)), "holds .ply data; rename it to end in .ply"),
        (PCD, "holds .pcd data; rename it to end in .pcd"),
        (made.npy(cloud(4)), "holds .npy data; rename it to end in .npy"),
        (made.npz(cloud(4)), "holds .npz data; rename it to end in .npz"),
    ],
)
def test_files_that_hold_something_else(tmp_path, extension, data, part):
    if f"holds .{extension} " in part:
        return
    text = error_for(tmp_path, f"a.{extension}", data)
    assert part in text and "byte 0" in text


def test_numbers_that_never_end_in_headers(tmp_path):
    big = "9" * 5000
    assert "whole number" in error_for(tmp_path, "a.pcd", made.pcd(b"", WIDTH=big))
    assert "whole number" in error_for(tmp_path, "a.pcd", made.pcd(b"", SIZE=f"4 4 {big}"))
    assert "COUNT 99999" in error_for(
        tmp_path, "a.pcd", made.pcd(b"", FIELDS="x y z q", SIZE="4 4 4 4", TYPE="F F F F", COUNT="1 1 1 99999")
    )
    fields = " ".join(f"f{k}" for k in range(3000))
    many = {"FIELDS": f"x y z {fields}", "SIZE": "4 " * 3003, "TYPE": "F " * 3003, "COUNT": "1 1 1 " + "4096 " * 3000}
    assert "the file ends" in error_for(tmp_path, "a.pcd", made.pcd(b"\0" * 50, **many))
    assert "numbers a line" in error_for(tmp_path, "a.pcd", made.pcd(b"1 2 3\n", "ascii", **many))
    assert "the header does not end" in error_for(tmp_path, "a.pcd", b"VERSION " + b"7" * 100_000)


def test_points_that_are_too_many(tmp_path):
    with open(tmp_path / "a.pcd", "wb") as file:  # a file of holes, which takes no room on the disk
        file.write(made.pcd(b"", WIDTH=str(2**31), POINTS=str(2**31)))
        file.truncate(file.tell() + 12 * 2**31)
    with pytest.raises(InputError, match="2147483648 points, expected at most 2147483647"):
        files.load_cloud(tmp_path / "a.pcd")


def test_archives_that_are_not_numpys(tmp_path):
    for method, part in ((zipfile.ZIP_LZMA, "a method that NumPy does not use"), (zipfile.ZIP_BZIP2, "a method")):
        with zipfile.ZipFile(tmp_path / "a.npz", "w", method) as archive:
            archive.writestr("points.npy", made.npy(cloud(40)))
        with pytest.raises(InputError, match=part):
            files.load_cloud(tmp_path / "a.npz")
    data = made.npz(cloud(40))
    place = data.index(b"\x93NUMPY") + 300
    assert "Bad CRC-32" in error_for(tmp_path, "a.npz", data[:place] + bytes([data[place] ^ 1]) + data[place + 1 :])


def test_what_is_no_file(tmp_path):
    (tmp_path / "d.pcd").mkdir()
    os.mkfifo(tmp_path / "p.pcd")
    (tmp_path / "z.pcd").symlink_to("/dev/zero")
    (tmp_path / "loop.pcd").symlink_to("loop.pcd")
    (tmp_path / "dangling.pcd").symlink_to("nowhere.pcd")
    (tmp_path / "file").write_bytes(b"x")
    listener = socket.socket(socket.AF_UNIX)
    with listener:
        listener.bind(os.path.relpath(tmp_path / "s.pcd"))
        for name, part in (
            ("d.pcd", "a folder"), ("p.pcd", "a pipe"), ("z.pcd", "a device"), ("s.pcd", "cannot be read"),
            ("loop.pcd", "symbolic links"), ("dangling.pcd", "No such file"), ("file/a.pcd", "Not a directory"),
            ("a" * 300 + ".pcd", "too long"), ("a\0b.pcd", "null byte"),
        ):  # fmt: skip
            with pytest.raises(InputError, match=part):
                files.load_cloud(tmp_path / name)


def test_a_symlink_to_a_cloud_is_one(tmp_path):
    (tmp_path / "real.pcd").write_bytes(PCD)
    (tmp_path / "link.pcd").symlink_to("real.pcd")
    assert files.load_cloud(tmp_path / "link.pcd").shape == (2, 3, 3)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_may_not_be_read(tmp_path):
    (tmp_path / "a.pcd").write_bytes(PCD)
    (tmp_path / "a.pcd").chmod(0)
    with pytest.raises(InputError, match="Permission denied"):
        files.load_cloud(tmp_path / "a.pcd")


def test_a_refusal_of_the_system_is_one_error(tmp_path, monkeypatch):
    (tmp_path / "a.pcd").write_bytes(PCD)

    def refuse(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "open", refuse)
    with pytest.raises(InputError, match=r"a\.pcd: cannot be read: Permission denied"):
        files.load_cloud(tmp_path / "a.pcd")
