import io
import os
import struct
import zipfile

import numpy as np
import pytest

from cloud_files import pcd
from debulk import InputError, files

KINDS = ["npy", "npz", "ply", "pcd"]


def cloud(*shape):
    points = np.random.default_rng(1).normal(0, 300, (*shape, 3)).astype(np.float32)
    points[..., 2][points[..., 0] > 200] = np.nan
    points.reshape(-1, 3)[: len(points) // 2] = np.nan
    return points


def same_bits(a, b):
    return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()


def error_of(call, *args, **kwargs):
    with pytest.raises(InputError) as caught:
        call(*args, **kwargs)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def error_for(tmp_path, name, data):
    path = tmp_path / name
    path.write_bytes(data)
    text = error_of(files.load_cloud, path)
    assert text.startswith(str(path))
    return text


def ply(header, body=b""):
    return ("ply\n" + header + "end_header\n").encode() + body


XYZ = "property float x\nproperty float y\nproperty float z\n"
LE = "format binary_little_endian 1.0\n"


TWO = np.array([[10, 20, 30], [40, np.nan, 60]], dtype="<f4")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("shape", [(7, 5), (12,), (1,)])
def test_shape_and_nan_come_back(tmp_path, kind, shape):
    points = cloud(*shape)
    files.save_cloud(tmp_path / f"a.{kind}", points)
    assert same_bits(files.load_cloud(tmp_path / f"a.{kind}"), points)
    assert [path.name for path in tmp_path.iterdir()] == [f"a.{kind}"]


@pytest.mark.parametrize("kind", ["xyz", "csv", "txt", "asc", "CSV"])
def test_text_comes_back_to_the_bit(tmp_path, kind):
    points = cloud(40_000)
    points[7] = np.float32(1e-30), np.nextafter(np.float32(1), np.float32(2)), -0.0
    files.save_cloud(tmp_path / f"a.{kind}", points)
    assert same_bits(files.load_cloud(tmp_path / f"a.{kind}"), points)
    assert "give points.reshape(-1, 3)" in error_of(files.save_cloud, tmp_path / f"b.{kind}", cloud(3, 4))


@pytest.mark.parametrize("kind", KINDS)
def test_metres_become_millimetres(tmp_path, kind):
    files.save_cloud(tmp_path / f"a.{kind}", TWO)
    np.testing.assert_array_equal(files.load_cloud(tmp_path / f"a.{kind}", unit="m"), TWO * np.float32(1000))
    assert 'unit: expected "mm" or "m"' in error_of(files.load_cloud, tmp_path / f"a.{kind}", unit="inch")


def test_more_points_than_a_chunk(tmp_path):
    points = cloud(301, 407)
    for kind in KINDS:
        files.save_cloud(tmp_path / f"a.{kind}", points)
        assert same_bits(files.load_cloud(tmp_path / f"a.{kind}"), points)


@pytest.mark.parametrize("dtype", ["<f4", "<f8", ">f4", ">f8"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_npy_of_any_float_and_order(tmp_path, dtype, order):
    points = np.asarray(cloud(4, 6), dtype=dtype, order=order)
    np.save(tmp_path / "a.npy", points)
    np.savez_compressed(tmp_path / "a.npz", scan=points, other=np.zeros(3))
    for name in ("a.npy", "a.npz"):
        assert same_bits(files.load_cloud(tmp_path / name), points.astype("f4", order="C"))


def test_ply_fields_in_any_order_and_more_of_them(tmp_path):
    rows = np.zeros(2, dtype=[("r", "u1"), ("z", "<f8"), ("r2", "<i2"), ("x", "<f4"), ("y", "<f4")])
    for k, axis in enumerate("xyz"):
        rows[axis] = TWO[:, k]
    header = (
        f"{LE}comment made by hand\nelement camera 1\nproperty int x\nproperty int x\n"
        "element vertex 2\nproperty uchar red\n"
        "property double z\nproperty short red\nproperty float32 x\nproperty float y\n"
        "element face 1\nproperty list uchar int vertex_indices\n"
    )
    (tmp_path / "a.ply").write_bytes(ply(header, b"\0" * 8 + rows.tobytes() + b"\x01\0\0\0\0"))
    with pytest.warns(files.CloudWarning, match="a mesh of 1 faces"):
        np.testing.assert_array_equal(files.load_cloud(tmp_path / "a.ply"), TWO)


def test_ply_big_endian_text_and_windows_lines(tmp_path):
    big = ply(f"format binary_big_endian 1.0\nelement vertex 2\n{XYZ}", TWO.astype(">f4").tobytes())
    text = ply(f"format ascii 1.0\nelement vertex 2\n{XYZ}property uchar q\n", b"10 20 30 9\n40 nan 60 9\n")
    windows = ply(f"{LE}element vertex 2\n{XYZ}").replace(b"\n", b"\r\n") + TWO.tobytes()
    for data in (big, text, windows):
        (tmp_path / "a.ply").write_bytes(data)
        np.testing.assert_array_equal(files.load_cloud(tmp_path / "a.ply"), TWO)


def test_ply_organised_by_obj_info_or_comment(tmp_path):
    body = np.arange(18, dtype="<f4").tobytes()
    sizes = [
        "obj_info num_cols 3\nobj_info num_rows 2\n", "comment debulk organised 3 2\n", "comment height: 2, width: 3\n",
        "obj_info Photoneo PLY PointCloud (Width = 3; Height = 2; Ordered)\n", "obj_info width 3\nobj_info height 2\n",
    ]  # fmt: skip
    for size in sizes:
        (tmp_path / "a.ply").write_bytes(ply(f"{LE}{size}element vertex 6\n{XYZ}", body))
        np.testing.assert_array_equal(files.load_cloud(tmp_path / "a.ply"), np.arange(18).reshape(2, 3, 3))
        (tmp_path / "a.ply").write_bytes(ply(f"{LE}{size}element vertex 5\n{XYZ}", body[:60]))
        if "debulk" in size:
            assert "organised as 3 x 2" in error_of(files.load_cloud, tmp_path / "a.ply")
            continue
        with pytest.warns(files.CloudWarning, match="3 x 2 pixels, which 5 points do not fill"):
            assert files.load_cloud(tmp_path / "a.ply").shape == (5, 3)


def test_pcd_padded_text_and_double(tmp_path):
    rows = np.zeros(2, dtype=[("_", "u1", 4), ("z", "<f8"), ("y", "<f4"), ("x", "<f8"), ("n", "<f4", 3)])
    for k, axis in enumerate("xyz"):
        rows[axis] = TWO[:, k]
    wide = pcd(rows.tobytes(), FIELDS="_ z y x n", SIZE="1 8 4 8 4", TYPE="U F F F F", COUNT="4 1 1 1 3")
    text = pcd(
        b"9 9 30 20 10\n9 9 60 nan 40\n", "ascii", FIELDS="n z y x", SIZE="4 4 4 4", TYPE="F F F F", COUNT="2 1 1 1"
    )
    old = pcd(TWO.tobytes()).replace(b"FIELDS", b"COLUMNS")
    bare = b"# a comment\n" + pcd(TWO.tobytes(), COUNT=None, VIEWPOINT=None, POINTS=None)
    for data in (wide, text, old, bare.replace(b"# a comment", b"# .PCD v0.7")):
        (tmp_path / "a.pcd").write_bytes(data)
        np.testing.assert_array_equal(files.load_cloud(tmp_path / "a.pcd"), TWO)


@pytest.mark.parametrize("kind", KINDS)
def test_a_file_cut_anywhere_is_refused(tmp_path, kind):
    files.save_cloud(tmp_path / f"a.{kind}", cloud(3, 4))
    data = (tmp_path / f"a.{kind}").read_bytes()
    for length in range(0, len(data), 7):
        assert ": " in error_for(tmp_path, f"cut.{kind}", data[:length])
    # The end of a .npz is a comment's length, and an archive with bytes before it is still one.
    if kind != "npz":
        assert "1 bytes follow" in error_for(tmp_path, f"long.{kind}", data + b"\1")


@pytest.mark.parametrize(
    ("name", "data", "parts"),
    [
        ("a.ply", ply(f"{LE}element vertex 2\n{XYZ}", TWO.tobytes()[:-1]), ["1 lack", "copy or export it again"]),
        ("a.ply", ply(f"{LE}element vertex 999999999999\n{XYZ}", b"\0" * 24), ["the file ends"]),
        ("a.ply", ply(f"{LE}element vertex 9999999999999\n{XYZ}"), ["byte 36", "whole number"]),
        ("a.ply", ply(f"{LE}element vertex -2\n{XYZ}"), ["whole number"]),
        ("a.ply", ply(f"{LE}element vertex 0\n{XYZ}"), ["no points"]),
        ("a.ply", ply(f"{LE}element face 2\n{XYZ}"), ["no element 'vertex'"]),
        ("a.ply", ply(f"{LE}element vertex 2\nproperty float x\nproperty float y\n", b"\0" * 16), ["no field 'z'"]),
        ("a.ply", ply(f"{LE}element vertex 2\n{XYZ}property float z\n", b"\0" * 32), ["more than one field 'z'"]),
        ("a.ply", ply(f"{LE}element vertex 2\n{XYZ}".replace("float y", "list int y"), b"\0" * 24), ["not PLY"]),
        ("a.ply", ply(f"{LE}element vertex 2\n{XYZ}property list uchar int q\n"), ["26 lack"]),
        (
            "a.ply",
            ply(f"{LE}element face 2\nproperty list uchar int q\nelement vertex 2\n{XYZ}"),
            ["2 elements 'face'", "2 lack"],
        ),
        ("a.ply", ply(f"{LE}element vertex 2\nproperty quad x\n"), ["not PLY"]),
        (
            "a.ply",
            ply(f"{LE}comment debulk organised 3 1\nelement vertex 2\n{XYZ}", TWO.tobytes()),
            ["3 x 1", "2 points"],
        ),
        ("a.ply", ply(f"format weird 1.0\nelement vertex 2\n{XYZ}"), ["unknown format"]),
        ("a.ply", b"ply\n" + b"comment x\n" * 10_000, ["does not end"]),
        ("a.ply", b"ply\n" + b"c" * 70_000, ["does not end"]),
        ("a.ply", b"ply\nformat \xe9\n", ["not PLY"]),
        ("a.ply", ply(f"format ascii 1.0\nelement vertex 3\n{XYZ}", b"1 2 3\n4 5 6\n"), ["lack"]),
        ("a.ply", ply(f"format ascii 1.0\nelement vertex 2\n{XYZ}", b"1 2 3\n4 five 6\n"), ["line 9", "y, got 'five'"]),
        ("a.ply", ply(f"format ascii 1.0\nelement vertex 2\n{XYZ}", b"1 2 3\n4 5 6\n7 8 9\n"), ["2 lines", "found 3"]),
        ("a.ply", ply(f"format ascii 1.0\nelement vertex 2\n{XYZ}", b"1 2 3 4 5 6 7 8 9\n"), ["2 lines", "found 1"]),
        ("a.ply", ply(f"element vertex 2\n{XYZ}", TWO.tobytes()), ["no line 'format'"]),
        ("a.ply", ply(f"{LE}comment debulk organised 2 0\nelement vertex 2\n{XYZ}", TWO.tobytes()), ["2 x 0"]),
        ("a.pcd", pcd(TWO.tobytes(), WIDTH="3"), ["POINTS is not WIDTH x HEIGHT = 3"]),
        ("a.pcd", pcd(TWO.tobytes(), WIDTH="999999999", HEIGHT="999999999", POINTS=None), ["the file ends"]),
        ("a.pcd", pcd(TWO.tobytes(), WIDTH="0", POINTS="0"), ["no points"]),
        ("a.pcd", pcd(TWO.tobytes(), SIZE="4 4"), ["expected 3 entries"]),
        ("a.pcd", pcd(TWO.tobytes(), SIZE="4 4 2"), ["field 'z': TYPE F, SIZE 2"]),
        ("a.pcd", pcd(TWO.tobytes(), FIELDS="x y q z", SIZE="4 4 1 4", TYPE="F F F F", COUNT="1 1 1 1"), ["TYPE"]),
        ("a.pcd", pcd(TWO.tobytes(), COUNT="1 1 2"), ["expected z as one number, got COUNT 2"]),
        ("a.pcd", pcd(TWO.tobytes(), FIELDS="x y y"), ["more than one field 'y'"]),
        ("a.pcd", pcd(TWO.tobytes(), "binary_squashed"), ["export it as binary"]),
        ("a.pcd", pcd(TWO.tobytes(), TYPE=None), ["no line TYPE"]),
        ("a.pcd", pcd(TWO.tobytes(), WIDTH="two"), ["WIDTH: expected a whole number, got 'two'"]),
        ("a.pcd", b"VERSION 0.7\nHELLO\n", ["not PCD"]),
        ("a.pcd", b"VERSION 0.7\nVERSION 0.7\n", ["twice"]),
        ("a.pcd", b"hello", ["byte 0", "does not start like .pcd"]),
        ("a.pcd", b"", ["byte 0", "the file is empty"]),
        ("a.pcd", ply(f"{LE}element vertex 2\n{XYZ}", TWO.tobytes()), ["holds .ply data", "rename it"]),
        ("a.npy", b"\x93NUMPY\x01\x00\xff\xff", ["not a readable .npy header"]),
        ("a.q", b"1 2 3\n", ["expected a file ending in .npy, .npz, .ply, .pcd, .xyz, .csv, .txt", "got '.q'"]),
        ("a", b"1 2 3\n", ["got 'no ending'"]),
        ("a.npz", b"PK\x03\x04junk", ["not a readable .npz archive"]),
    ],
)
def test_a_bad_file_gives_one_clear_error(tmp_path, name, data, parts):
    text = error_for(tmp_path, name, data)
    for part in parts:
        assert part in text


@pytest.mark.parametrize(
    ("array", "part"),
    [
        (np.zeros((4, 4)), "(H, W, 3) or (N, 3)"),
        (np.zeros(3), "(H, W, 3) or (N, 3)"),
        (np.zeros((2, 2, 2, 3)), "(H, W, 3) or (N, 3)"),
        (np.zeros((0, 3)), "no points"),
        (np.zeros((2, 3), int), "expected float32 or float64, got int64"),
        (np.zeros((2, 3), complex), "expected float32 or float64"),
        (np.zeros(2, [("x", "f4")]), "expected records with fields x, y, z, got x"),
        (np.array([[1, 2, {}]], dtype=object), "expected float32 or float64, got object"),
    ],
)
def test_other_arrays_are_refused(tmp_path, array, part):
    np.save(tmp_path / "a.npy", array)
    np.savez(tmp_path / "a.npz", points=array)
    assert part in error_of(files.load_cloud, tmp_path / "a.npy")
    if array.size:
        assert part in error_of(files.load_cloud, tmp_path / "a.npz")


def npy_header(text):
    data = text.encode().ljust(117) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(data)) + data


@pytest.mark.parametrize(
    "header",
    [
        "{'descr': '<f4', 'fortran_order': False, 'shape': (99999999999, 3)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (-2, 3)}",
        "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3, True)}",
        "{'descr': '<f4', 'fortran_order': False}",
        "{'descr': __import__('os').system('x'), 'fortran_order': False, 'shape': (2, 3)}",
        "((((((((((((((((((((((((((((((((((((((((((((((((((",
    ],
)
def test_hostile_npy_headers(tmp_path, header):
    assert "byte" in error_for(tmp_path, "a.npy", npy_header(header) + b"\0" * 24)
    with zipfile.ZipFile(tmp_path / "b.npz", "w") as archive:
        archive.writestr("points.npy", npy_header(header) + b"\0" * 24)
    assert "byte" in error_of(files.load_cloud, tmp_path / "b.npz")


def test_npz_with_several_arrays_needs_a_name(tmp_path):
    np.savez(tmp_path / "a.npz", a=TWO, b=TWO)
    assert "one called points, or X, Y and Z, got a, b" in error_of(files.load_cloud, tmp_path / "a.npz")
    np.savez(tmp_path / "a.npz", a=TWO, points=TWO + 1)
    np.testing.assert_array_equal(files.load_cloud(tmp_path / "a.npz"), TWO + 1)


def test_a_damaged_npz_is_refused(tmp_path):
    np.savez_compressed(tmp_path / "a.npz", points=cloud(30, 30))
    data = bytearray((tmp_path / "a.npz").read_bytes())
    data[len(data) // 2] ^= 0xFF
    assert "npz" in error_for(tmp_path, "a.npz", bytes(data))


def test_infinite_and_far_points_are_refused(tmp_path):
    points = cloud(4, 5)
    points[2, 3, 1] = -np.inf
    np.save(tmp_path / "a.npy", points)
    assert "point 13: y = -inf mm" in error_of(files.load_cloud, tmp_path / "a.npy")
    np.save(tmp_path / "a.npy", np.array([[1.0, 2.0, 1e300]]))
    assert "point 0: z = 1e+300 mm" in error_of(files.load_cloud, tmp_path / "a.npy")
    np.save(tmp_path / "a.npy", np.array([[1.0, 2.0, 2e4]]))
    assert files.load_cloud(tmp_path / "a.npy").shape == (1, 3)
    np.save(tmp_path / "a.npy", np.array([[1.0, 2.0, 2e8]]))
    assert "check the unit (m)" in error_of(files.load_cloud, tmp_path / "a.npy", unit="m")


def test_what_is_no_file_is_refused(tmp_path):
    (tmp_path / "d.npy").mkdir()
    assert "d.npy" in error_of(files.load_cloud, tmp_path / "d.npy")
    assert "No such file" in error_of(files.load_cloud, tmp_path / "none.npy")
    (tmp_path / "l.npy").symlink_to("/dev/zero")
    assert "expected a file" in error_of(files.load_cloud, tmp_path / "l.npy")


def test_masked_points_and_tables_are_saved_as_they_are_meant(tmp_path):
    points = cloud(7, 5)
    hidden = np.ma.masked_array(np.nan_to_num(points, nan=77.0), np.isnan(points))
    files.save_cloud(tmp_path / "a.ply", hidden)
    assert same_bits(files.load_cloud(tmp_path / "a.ply"), points)


def test_saving_refuses_what_loading_would(tmp_path):
    assert "(H, W, 3)" in error_of(files.save_cloud, tmp_path / "a.npy", np.zeros((3, 4)))
    assert "float32 or float64" in error_of(files.save_cloud, tmp_path / "a.npy", [[1, 2, 3]])
    assert "(0, 3)" in error_of(files.save_cloud, tmp_path / "a.npy", TWO[:0])
    far = TWO.astype(np.float64) + 5e9
    assert "float32 rounds by up to 5.1e+02 mm" in error_of(files.save_cloud, tmp_path / "a.npy", far)
    assert "ending" in error_of(files.save_cloud, tmp_path / "a.las", TWO)
    assert "cannot be written" in error_of(files.save_cloud, tmp_path / "none" / "a.ply", TWO)
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_leaves_the_old_file(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(RuntimeError), files.replacing(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a.txt"]


POSE = "# cell 7\n0 -1 0 10\n1 0 0 20\n\n0, 0, 1, 30\n0 0 0 1\n"


def test_pose(tmp_path):
    (tmp_path / "p.txt").write_text(POSE)
    expected = [[0, -1, 0, 10], [1, 0, 0, 20], [0, 0, 1, 30], [0, 0, 0, 1]]
    np.testing.assert_array_equal(files.load_pose(tmp_path / "p.txt"), expected)
    np.testing.assert_array_equal(files.load_pose(tmp_path / "p.txt", unit="m")[:3, 3], [10000, 20000, 30000])


@pytest.mark.parametrize(
    ("old", "new", "part"),
    [
        ("0 -1 0 10", "0 1 0 10", "mirrors"),
        ("0 -1 0 10", "0 -2 0 10", "scales"),
        ("0 -1 0 10", "0 -1 0 nan", "line 2: expected finite numbers"),
        ("0 -1 0 10", "0 -1 0", "line 3: expected finite numbers, as many as above"),
        ("0 -1 0 10", "0 -1 0 ten", "line 2: expected numbers, got '0 -1 0 ten'"),
        ("0 -1 0 10\n", "", "four lines of four numbers, got 3 of 4 that end with 0 0 0 1"),
        ("0 0 0 1", "0 0 1 1", "last line 0 0 0 1"),
        (POSE, "", "none"),
    ],
)
def test_a_bad_pose_is_refused(tmp_path, old, new, part):
    (tmp_path / "p.txt").write_text(POSE.replace(old, new))
    assert part in error_of(files.load_pose, tmp_path / "p.txt")


def test_outline(tmp_path):
    (tmp_path / "o.csv").write_text("\ufeffx,y\n0,0\n100,0\n100,50\n0,0\n", encoding="utf-8")
    np.testing.assert_array_equal(files.load_outline(tmp_path / "o.csv"), [[0, 0], [100, 0], [100, 50]])
    (tmp_path / "o.csv").write_text("0 0\n200 0\n200 100\n")
    assert 'the outline is 200 m across, too large for a scanned ply; if its numbers are in mm, give unit="mm"' in (
        error_of(files.load_outline, tmp_path / "o.csv", "m")
    )
    (tmp_path / "o.csv").write_text("0 0\n2 0\n2 1\n")
    np.testing.assert_array_equal(files.load_outline(tmp_path / "o.csv", "m"), [[0, 0], [2000, 0], [2000, 1000]])
    assert "2 mm across, too small" in error_of(files.load_outline, tmp_path / "o.csv")


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("x,y\n0,0\n1,1\n", "at least 3 corners"),
        ("0,0\n10,10\n20,20\n", "3 corners go there and back over 20 by 20 mm and enclose 0 mm"),
        ("0,0,0\n1,0,0\n0,1,0\n", "two columns x,y, got 3"),
        ("x,y\nx,y\n", "none"),
        ("0,0\n1,inf\n0,1\n", "line 2: expected finite"),
        ("", "none"),
    ],
)
def test_a_bad_outline_is_refused(tmp_path, text, part):
    (tmp_path / "o.csv").write_text(text)
    assert part in error_of(files.load_outline, tmp_path / "o.csv")


def test_npz_of_numpy_itself(tmp_path):
    files.save_cloud(tmp_path / "a.npz", TWO)
    with np.load(io.BytesIO((tmp_path / "a.npz").read_bytes())) as archive:
        assert same_bits(archive["points"], TWO.astype(np.float32))
