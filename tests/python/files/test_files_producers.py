"""Clouds as other programs write them: each kind of file, made here, comes back with the right values and shape."""

import gzip
import struct
import tracemalloc

import numpy as np
import pytest

import cloud_files as made
from debulk import InputError, files


def cloud(*shape):
    points = np.random.default_rng(3).normal(0, 300, (*shape, 3)).astype(np.float32)
    points.reshape(-1, 3)[::5] = np.nan
    return points


def load(tmp_path, name, data, unit="mm"):
    (tmp_path / name).write_bytes(data)
    return files.load_cloud(tmp_path / name, unit)


def error_for(tmp_path, name, data, unit="mm"):
    with pytest.raises(InputError) as caught:
        load(tmp_path, name, data, unit)
    text = str(caught.value)
    assert text.startswith(str(tmp_path / name)) and "\n" not in text
    return text


POINTS = cloud(6, 9)
ORGANISED = made.of_producers(POINTS)
UNORGANISED = made.unorganised_of_producers(POINTS)


@pytest.mark.parametrize(("name", "data"), ORGANISED, ids=[name for name, _ in ORGANISED])
def test_organised(tmp_path, name, data):
    points = load(tmp_path, name, data)
    assert points.dtype == np.float32 and points.flags.c_contiguous and points.flags.writeable
    np.testing.assert_array_equal(points, POINTS)
    in_metres = dict(made.of_producers(POINTS / np.float32(128)))[name]
    np.testing.assert_allclose(load(tmp_path, name, in_metres, "m"), POINTS * (1000 / 128), rtol=2e-7)


@pytest.mark.parametrize(("name", "data"), UNORGANISED, ids=[name for name, _ in UNORGANISED])
def test_unorganised(tmp_path, name, data):
    np.testing.assert_array_equal(load(tmp_path, name, data), POINTS.reshape(-1, 3))


@pytest.mark.parametrize("kind", ["i1", "u1", "i2", "u2", "i4", "u4", "f8"])
@pytest.mark.parametrize("form", ["binary_little_endian", "binary_big_endian", "ascii"])
def test_numbers_of_any_type(tmp_path, kind, form):
    values = np.arange(30).reshape(10, 3) + 90 * (kind not in ("i1", "u1"))
    if kind.startswith("i"):
        values -= 100
    data = made.ply_of([("vertex", dict.fromkeys("xyz", kind), values.tolist())], form)
    np.testing.assert_array_equal(load(tmp_path, "a.ply", data), values)
    if form == "binary_little_endian":
        body = values.astype(f"<{kind}").tobytes()
        as_pcd = made.pcd(body, WIDTH="10", POINTS="10", TYPE=f"{kind[0].upper()} " * 3, SIZE=f"{kind[1]} " * 3)
        np.testing.assert_array_equal(load(tmp_path, "a.pcd", as_pcd), values)


def test_only_zeros_of_less_than_a_page_may_follow_a_pcd(tmp_path):
    data = made.pcd(POINTS.tobytes(), **made.shape_lines(POINTS))
    for page in (4096, 16384, 65536):  # of x86, of Apple, of some ARM and POWER
        np.testing.assert_array_equal(load(tmp_path, "a.pcd", made.page_padded(data, page)), POINTS)
    padded = made.page_padded(data)
    assert f"{len(padded) - len(data)} bytes follow" in error_for(tmp_path, "a.pcd", padded[:-1] + b"\1")
    assert "bytes follow" in error_for(tmp_path, "a.pcd", data + b"\0" * 65536)


def test_a_viewpoint_is_named_and_not_applied(tmp_path):
    def with_viewpoint(text):
        return made.pcd(POINTS.tobytes(), **made.shape_lines(POINTS), VIEWPOINT=text)

    for same in ("0 0 0 1 0 0 0", "0 0 0 -1 0 0 0", None):
        np.testing.assert_array_equal(load(tmp_path, "a.pcd", with_viewpoint(same)), POINTS)
    for other in ("0.1 0 0 1 0 0 0", "0 0 0 0.7071 -0.7071 0 0", "0 0 0 1 0 0 0 0"):
        with pytest.warns(files.CloudWarning, match=f"VIEWPOINT, {other}, is not applied"):
            np.testing.assert_array_equal(load(tmp_path, "a.pcd", with_viewpoint(other)), POINTS)


def test_a_camera_that_does_not_fit(tmp_path):
    flat = POINTS.reshape(-1, 3)
    with pytest.warns(files.CloudWarning, match="640 x 480 pixels, which 54 points do not fill"):
        assert load(tmp_path, "a.ply", made.pcl_camera(POINTS, viewport=(480, 640))).shape == flat.shape
    assert load(tmp_path, "a.ply", made.pcl_camera(flat, viewport=(1, len(flat)))).shape == flat.shape
    assert load(tmp_path, "a.ply", made.pcl_camera(flat, viewport=(0, 0))).shape == flat.shape
    with pytest.warns(files.CloudWarning, match="the pose of its camera"):
        load(tmp_path, "a.ply", made.pcl_camera(POINTS, axes=(0, 1, 0, -1, 0, 0, 0, 0, 1)))


def test_range_grids_that_lie(tmp_path):
    data = made.range_grid(POINTS)
    assert "9 x 7, but its range_grid has 54 cells" in error_for(
        tmp_path, "a.ply", data.replace(b"num_rows 6", b"num_rows 7")
    )
    last = struct.pack("<i", np.isfinite(POINTS[..., 0]).sum() - 1)
    wrong = struct.pack("<i", len(POINTS) * 100)
    assert "names vertex 600 of 43" in error_for(tmp_path, "a.ply", data.replace(last, wrong))
    assert "the file ends" in error_for(tmp_path, "a.ply", data[:-1])
    with pytest.warns(files.CloudWarning, match="no num_cols and num_rows"):
        assert load(tmp_path, "a.ply", data.replace(b"obj_info", b"comment ")).shape == (43, 3)


def test_a_row_of_obj_info_is_no_image(tmp_path):
    """PCL states 1 row for unorganised points, with the number of all points, of which it may leave some out."""
    flat = POINTS.reshape(-1, 3)
    lines = "obj_info num_cols {}\nobj_info num_rows 1\n"
    for columns in (len(flat), len(flat) + 5):
        data = made.ply_of([("vertex", dict.fromkeys("xyz", "f4"), flat.tolist())], lines=lines.format(columns))
        np.testing.assert_array_equal(load(tmp_path, "a.ply", data), flat)


def test_lists_that_lie(tmp_path):
    rows = [(1.0, 2.0, 3.0, [1, 2]), (40.0, 50.0, 60.0, [])]
    kinds = dict.fromkeys("xyz", "f4") | {"q": ("i4", "u1")}
    data = made.ply_of([("vertex", kinds, rows)])
    np.testing.assert_array_equal(load(tmp_path, "a.ply", data), [[1, 2, 3], [40, 50, 60]])
    for length, part in ((-1, "a list of negative length"), (2**31 - 1, "the file ends inside an element")):
        wrong = data.replace(struct.pack("<i", 2), struct.pack("<i", length))
        assert part in error_for(tmp_path, "a.ply", wrong)
    assert "1 bytes follow" in error_for(tmp_path, "a.ply", data + b"\0")
    text = made.ply_of([("vertex", kinds, rows)], "ascii")
    assert "expected the numbers of an element 'vertex', got '1.0 2.0 3.0 9 1 2'" in error_for(
        tmp_path, "a.ply", text.replace(b"3.0 2", b"3.0 9")
    )
    many = text.replace(b"vertex 2", b"vertex 3")
    assert "1 of 3 elements 'vertex' lack" in error_for(tmp_path, "a.ply", many + b" " * 100)
    assert "bytes follow the 2 points" in error_for(tmp_path, "a.ply", text + b"1 2 3 0\n")


def test_arrays_that_are_ambiguous(tmp_path):
    both = made.npz_of(points=POINTS, xyz=POINTS)
    assert "only one of these, got points, xyz" in error_for(tmp_path, "a.npz", both)
    assert "only one of these" in error_for(tmp_path, "a.npz", made.npz_of(scan=POINTS, x=POINTS, y=POINTS, z=POINTS))
    assert "got arr_0, arr_1" in error_for(tmp_path, "a.npz", made.npz_of(arr_0=POINTS, arr_1=POINTS))
    apart = made.npz_of(X=POINTS[..., 0], Y=POINTS[..., 1], Z=POINTS[:3, :, 2])
    assert "X, Y and Z of one shape" in error_for(tmp_path, "a.npz", apart)
    assert "(3, 4) is ambiguous" in error_for(tmp_path, "a.npy", made.npy(np.zeros((3, 4))))
    assert "give it as the pose" in error_for(tmp_path, "a.npy", made.npy(np.eye(4)))
    assert "got (5, 6)" in error_for(tmp_path, "a.npy", made.npy(np.zeros((5, 6))))
    square = np.arange(9.0).reshape(3, 3) * 10
    np.testing.assert_array_equal(load(tmp_path, "a.npy", made.npy(square)), square)  # by rows, as ever
    halves = np.zeros(4, dtype=[("x", "f2"), ("y", "f2"), ("z", "f2")])
    assert "expected records with fields x, y, z" in error_for(tmp_path, "a.npy", made.npy(halves))


def test_gzip_that_cannot_be_unpacked(tmp_path):
    data = gzip.compress(made.npy(POINTS))
    assert "not readable gzip data" in error_for(tmp_path, "a.npy.gz", data[:-9])
    assert "not readable gzip data" in error_for(tmp_path, "a.npy.gz", data[:40] + b"\xff" + data[41:])
    assert "not readable gzip data" in error_for(tmp_path, "a.npy.gz", made.npy(POINTS))
    assert "holds .npy data; rename it to end in .npy" in error_for(tmp_path, "a.ply.gz", data)
    assert ".ptx before .gz, got '.q'; rename it" in error_for(tmp_path, "a.q.gz", data)
    bomb = gzip.compress(b"\0" * (40 << 20))
    tracemalloc.start()
    assert "unpack to more than" in error_for(tmp_path, "a.npy.gz", bomb)
    assert tracemalloc.get_traced_memory()[1] < 8 << 20
    tracemalloc.stop()


FAR = np.array([691_000_000.0, 5_334_000_000.0, 520_000.0])


@pytest.mark.parametrize(
    "make",
    [
        lambda p: ("a.npy", made.npy(p)),
        lambda p: ("a.npy", made.npy(np.asfortranarray(p))),
        lambda p: ("a.npz", made.npz(p)),
        lambda p: ("a.npy", made.npy(made.records(p, kind=">f8"))),
        lambda p: ("a.pcd", made.pcd(p.tobytes(), SIZE="8 8 8", **made.shape_lines(p))),
        lambda p: ("a.pcd", made.pcd(made.lines_of(p), "ascii", SIZE="8 8 8", **made.shape_lines(p))),
        lambda p: ("a.ply", made.ply(p, "binary_big_endian", "double")),
        lambda p: ("a.ply", made.ply(p, "ascii", "double")),
        lambda p: ("a.csv", b"x,y,z\n" + made.lines_of(p, ",")),
        lambda p: ("a.xyz.gz", gzip.compress(b"# made by hand\n" + made.lines_of(p))),
    ],
)  # fmt: skip
def test_far_from_the_origin_no_precision_is_lost(tmp_path, make):
    far = POINTS.astype(np.float64) + FAR  # as easting and northing of a map, in mm
    points = load(tmp_path, *make(far))
    assert points.dtype == np.float64
    np.testing.assert_array_equal(points.reshape(-1, 3), far.reshape(-1, 3))
    metres = load(tmp_path, *make(far / 1000), "m")
    assert np.nanmax(np.abs(metres.reshape(-1, 3) - far.reshape(-1, 3))) < 1e-5


def test_far_text_that_only_the_other_reader_knows(tmp_path):
    lines = b"691000000.5,5334000000.25,1,a\n691000500.5,5334000000.25,1,b\n"
    np.testing.assert_array_equal(load(tmp_path, "a.csv", lines)[0], [691000000.5, 5334000000.25, 1])
    one = np.array([[40_000.0, 5, 5], [41_000, 5, 5], [20_000, 5, 5]])  # one point is near
    assert load(tmp_path, "a.npy", made.npy(one)).dtype == np.float32


@pytest.mark.parametrize(
    ("name", "data", "part"),
    [
        ("a.e57", b"ASTM-E57\1\0\0\0", "E57 data; export the cloud as .ply or .pcd"),
        ("a.laz", b"LASF\0\0", "LAS or LAZ data"),
        ("a.stl", b"solid part\n  facet normal 0 0 1\n", "STL data"),
        ("a.stl", b"\0" * 80 + struct.pack("<I", 2) + b"\0" * 100, "STL data"),
        ("a.obj", b"# by hand\nmtllib a.mtl\nv 1 2 3\n", "OBJ data"),
        ("a.glb", b"glTF\2\0\0\0", "glTF data"),
        ("a.gltf", b'{"asset": {"version": "2.0"}}', "glTF data"),
        ("a.bag", b"#ROSBAG V2.0\n", "ROS bag, as ROS and RealSense write it"),
        ("a.db3", b"SQLite format 3\0", "bag of ROS 2"),
        ("a.mcap", b"\x89MCAP0\r\n", "MCAP file of ROS 2"),
        ("a.mat", b"MATLAB 5.0 MAT-file, Platform: GLNXA64", "MATLAB data; write the cloud by pcwrite"),
        ("a.zdf", b"\x89HDF\r\n\x1a\n", "as Zivid's .zdf is"),
        ("a.vtk", b"# vtk DataFile Version 3.0\n", "VTK data"),
        ("a.vtp", b'<?xml version="1.0"?>\n<VTKFile type="PolyData">', "VTK data"),
        ("a.tif", b"II*\0\x08\0\0\0", "a TIFF picture, perhaps of heights; write points"),
        ("a.om3", b"\x01\x02\x03\x04", "an object model of HALCON"),
        ("a.3mf", b"PK\x03\x04", "3MF data"),
        ("a.xlsx", b"PK\x03\x04" + bytes(26) + b"[Content_Types].xml", "a ZIP archive, as .xlsx and .ods are"),
        ("a", made.ply(POINTS), "holds .ply data; rename it to end in .ply"),
        ("a.PCD2", made.pcd(b""), "rename it to end in .pcd"),
    ],
)
def test_other_formats_are_named_with_the_way_out(tmp_path, name, data, part):
    assert part in error_for(tmp_path, name, data)
    if not data.startswith((b"ply", b"PK", b"VERSION", b"\1\2")) and data:  # the content tells it under any name
        assert part[:8] in error_for(tmp_path, "a.ply", data)
