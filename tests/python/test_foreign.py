"""Clouds as other programs hold them in memory, by stand-ins that offer the same as theirs."""

import array
from types import SimpleNamespace

import numpy as np
import pytest

from debulk import InputError, cloud

POINTS = np.random.default_rng(5).normal(0, 300, (4, 6, 3)).astype(np.float32)
POINTS[1, 2] = np.nan
TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}  # sensor_msgs/PointField


def message(points, kind=7, order="<", row_gap=0, names="xyz", wrap=bytes, **changes):
    """Make a PointCloud2 whose fields lie apart, out of order, with gaps after each point and each row."""
    height, width = points.shape[:2] if points.ndim == 3 else (1, len(points))
    size = int(TYPES[kind][1])
    step, row = 3 * size + 7, width * (3 * size + 7) + row_gap
    places = {"z": 1, "intensity": 1 + size, "x": 5 + size, "y": 5 + 2 * size}
    data = bytearray(b"\x5a" * (height * row))
    for k, name in enumerate("xyz"):
        column = points[..., k].reshape(height, width).astype(order + TYPES[kind])
        for i in range(height):
            for j in range(width):
                at = i * row + j * step + places[name]
                data[at : at + size] = column[i, j : j + 1].tobytes()  # an element alone would lose its byte order
    renamed = dict(zip("xyz", names, strict=True))
    fields = [
        SimpleNamespace(name=renamed.get(name, name), offset=at, datatype=kind if name in "xyz" else 7, count=1)
        for name, at in places.items()
    ]
    return SimpleNamespace(
        **{
            "header": None, "height": height, "width": width, "fields": fields, "is_bigendian": order == ">",
            "point_step": step, "row_step": row, "data": wrap(data), "is_dense": False,
        } | changes
    )  # fmt: skip


@pytest.mark.parametrize("order", ["<", ">"])
@pytest.mark.parametrize("kind", [3, 5, 7, 8])
@pytest.mark.parametrize("points", [POINTS, POINTS.reshape(-1, 3)], ids=["organised", "unorganised"])
def test_messages_of_ros(points, kind, order):
    if kind < 7:
        points = np.nan_to_num(points).round()
    for wrap in (bytes, lambda data: array.array("B", data), lambda data: np.frombuffer(data, np.uint8), list):
        for names in ("xyz", "XYZ"):
            got = cloud.from_memory(message(points, kind, order, 11, names, wrap))
            assert got.dtype.kind == "f" and got.shape == points.shape
            np.testing.assert_array_equal(got, points)
    in_metres = cloud.from_memory(message(points, kind, order), unit="m")
    np.testing.assert_array_equal(in_metres, points.astype(got.dtype) * got.dtype.type(1000))


@pytest.mark.parametrize(
    ("changes", "part"),
    [
        ({"data": b"\0" * 50}, "a message of 6 x 4 points, 19 bytes each, 114 a row, in 50 bytes; was it cut off"),
        ({"width": 7}, "in 456 bytes"),
        ({"width": 0}, "a message of 0 x 4 points"),
        ({"row_step": 3}, "3 a row"),
        ({"point_step": 8}, "offset 9"),
        ({"fields": []}, "fields none"),
        ({"data": 7}, "that NumPy cannot read"),
        ({"height": "many"}, "that NumPy cannot read"),
    ],
)
def test_messages_that_lie(changes, part):
    with pytest.raises(InputError, match=r"^scan: expected an") as caught:
        cloud.checked(message(POINTS, **changes), "scan")
    assert part in str(caught.value)


def test_records():
    for kind, names in ((np.float32, ["x", "y", "z", "r"]), (np.float64, ["X", "Y", "Z", "r"])):
        records = np.zeros(POINTS.shape[:2], dtype=[(name, kind) for name in names])
        for k, name in enumerate(names[:3]):
            records[name] = POINTS[..., k]
        got = cloud.from_memory(records)
        np.testing.assert_array_equal(got, POINTS)
        assert np.shares_memory(got, records) and not got.flags.writeable
        np.testing.assert_array_equal(cloud.from_memory(records[::-1, ::2]), POINTS[::-1, ::2])
    plain = np.rec.fromarrays(POINTS.reshape(-1, 3).T, names="f0,f1,f2")
    np.testing.assert_array_equal(cloud.from_memory(plain), POINTS.reshape(-1, 3))
    triple = POINTS.view([("xyz", "<f4", 3)])[..., 0]
    np.testing.assert_array_equal(cloud.from_memory(triple), POINTS)
    shorts = np.array([(1, 2, 3)], dtype=[("x", "i2"), ("y", "i2"), ("z", "i2")])
    assert cloud.from_memory(shorts).tolist() == [[1, 2, 3]]
    for wrong in (np.zeros(3, dtype=[("x", "f4"), ("y", "f4")]), np.zeros((2, 2, 2), dtype=records.dtype)):
        with pytest.raises(InputError, match="records"):
            cloud.from_memory(wrong)


class Tensor:
    """What speaks DLPack and nothing else."""

    def __init__(self, values, device="cpu"):
        self.values, self.device = values, device

    def __dlpack__(self, **options):
        if self.device != "cpu":
            raise BufferError("the memory of a GPU")
        return self.values.__dlpack__(**options)

    def __dlpack_device__(self):
        return self.values.__dlpack_device__()


def test_tensors_and_clouds_of_open3d():
    np.testing.assert_array_equal(cloud.from_memory(Tensor(POINTS)), POINTS)
    with pytest.raises(InputError, match=r"a Tensor that NumPy cannot read \(the memory of a GPU\); pass"):
        cloud.from_memory(Tensor(POINTS, "gpu"))
    flat = POINTS.reshape(-1, 3).astype(np.float64)
    np.testing.assert_array_equal(cloud.from_memory(SimpleNamespace(points=flat.tolist())), flat)
    np.testing.assert_array_equal(cloud.from_memory(SimpleNamespace(point={"positions": Tensor(flat)})), flat)
    with pytest.raises(InputError, match="cannot read"):
        cloud.from_memory(SimpleNamespace(point={}))


def test_tables_are_read_by_the_names_of_their_columns():
    pandas = pytest.importorskip("pandas")
    flat = POINTS.reshape(-1, 3)
    for names in ("zyx", "ZYX"):
        table = pandas.DataFrame(flat[:, ::-1], columns=list(names)).assign(quality=1)
        np.testing.assert_array_equal(cloud.from_memory(table), flat)
    np.testing.assert_array_equal(cloud.from_memory(pandas.DataFrame(flat)), flat)


def test_a_cloud_too_far_away_is_not_rounded_silently():
    away = np.array([0, 0, 5e9])
    far = POINTS.astype(np.float64) + away
    with pytest.raises(InputError, match=r"about 5e\+09 mm away, where float32 resolves 5.1e\+02 mm only; subtract"):
        cloud.checked(far, "scan")
    np.testing.assert_array_equal(cloud.checked(far - away), POINTS)
