"""Clouds as other programs hold them in memory: ROS messages, arrays of records, Open3D's clouds, DLPack's tensors.

They are recognised by what they offer, so that none of those packages has to be installed. The result is a view of the
same memory where that can be.
"""

from __future__ import annotations

from collections.abc import Mapping
from os import PathLike
from typing import Any, NoReturn

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from debulk import arrays
from debulk._core import InputError

_CLOUD = "an (H, W, 3) or (N, 3) array of points"
_NAMES = (("x", "y", "z"), ("X", "Y", "Z"))
_UNNAMED = ("f0", "f1", "f2")  # as RealSense's get_vertices() calls them
_TRIPLES = ("xyz", "points", "position")
_MESSAGE = ("height", "width", "fields", "point_step", "row_step", "is_bigendian", "data")
_MESSAGE_TYPES = ("", "i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8")  # by sensor_msgs/PointField's datatype


def plain(points: Any, name: str) -> Any:
    """Return a cloud of a known other form as an array (H, W, 3) or (N, 3); everything else as it came.

    Known are a ``sensor_msgs/PointCloud2`` message, of ROS or rosbags; a NumPy array of records with fields x, y, z, or
    X, Y, Z, or f0, f1, f2, or one field xyz of three numbers; a point cloud of Open3D, or anything else with
    ``points``; a table of pandas or Polars with columns x, y, z; anything that speaks DLPack. Whole numbers become
    floats. Units are left as they are.
    """
    if isinstance(points, np.ndarray):
        return _of_records(points, name) if points.dtype.names else points
    try:
        if all(hasattr(points, part) for part in _MESSAGE):
            return _of_message(points, name)
        listed = [str(column) for column in getattr(points, "columns", ())]
        for names in _NAMES:
            if set(names) <= set(listed):
                return points[list(names)].to_numpy()
        inner = getattr(points, "points", None)
        if inner is None and hasattr(points, "point"):  # Open3D's clouds of tensors
            inner = points.point["positions"]
        if inner is not None and not callable(inner):
            return plain(inner, name) if hasattr(inner, "__dlpack__") else np.asarray(inner)
        if hasattr(points, "__dlpack__"):
            return np.from_dlpack(points)
    except InputError:
        raise
    except Exception as error:  # another package's object may raise anything, such as for memory of another device
        shown = " ".join(str(error).split())[:100]
        _fail(name, f"a {type(points).__name__} that NumPy cannot read ({shown})", "pass a NumPy array")
    return points


def points_of(points: Any, name: str) -> NDArray[Any]:
    """Return the points as an array of float32 or float64, (H, W, 3) or (N, 3), without a copy where that can be."""
    points = plain(points, name)
    if isinstance(points, np.ma.MaskedArray):  # masked points were not seen
        if points.dtype.kind != "f":
            raise InputError(
                f"{name}: expected float32 or float64 coordinates, but got {points.dtype}{_convert(points)}"
            )
        points = points.filled(np.nan)
    try:
        array: NDArray[Any] = np.asarray(points)
    except ValueError:  # lists of different lengths
        raise InputError(f"{name}: expected {_CLOUD}, but got rows of different lengths") from None
    if array.ndim not in (2, 3) or array.shape[-1] != 3:
        raise InputError(f"{name}: expected {_CLOUD}, but got {arrays.came(points, array)}{_reshape(points, array)}")
    if array.dtype.newbyteorder("=") not in (np.float32, np.float64):  # in either byte order
        raise InputError(f"{name}: expected float32 or float64 coordinates, but got {array.dtype}{_convert(array)}")
    return array


def _reshape(points: Any, array: NDArray[Any]) -> str:
    """Say how points are had from what came, where that is plain."""
    if isinstance(points, (str, PathLike)):
        return "; debulk.files.load_cloud() reads one"
    if array.ndim in (2, 3) and array.shape[0] == 3:
        return "; where x, y, z are its first axis, pass numpy.moveaxis(points, 0, -1)"
    if array.ndim in (2, 3) and array.shape[-1] > 3:
        return "; where x, y, z are its first columns, pass points[..., :3]"
    return ""


def _convert(array: NDArray[Any]) -> str:
    """Say how numbers of another type are converted; empty if the array holds no numbers."""
    return "; pass them as .astype(numpy.float32)" if array.dtype.kind in "fiu" else ""


def coordinates(dtype: np.dtype[Any]) -> tuple[list[np.dtype[Any]], list[int]] | None:
    """Return the types of x, y, z in a record, and where they are, in bytes; None if it has no such fields."""
    fields: Mapping[str, Any] = dtype.fields or {}
    for triple in _TRIPLES:
        base, shape = fields[triple][0].subdtype or (dtype, ()) if triple in fields else (dtype, ())
        if shape == (3,) and _is_number(base):
            return [base] * 3, [fields[triple][1] + k * base.itemsize for k in range(3)]
    choices = _NAMES + ((_UNNAMED,) if (dtype.names or ())[:3] == _UNNAMED else ())
    for names in choices:
        if all(name in fields for name in names):
            types = [fields[name][0] for name in names]
            return (types, [fields[name][1] for name in names]) if all(map(_is_number, types)) else None
    return None


def _is_number(dtype: np.dtype[Any]) -> bool:
    return dtype.kind in "iu" or (dtype.kind == "f" and dtype.itemsize in (4, 8))


def _of_records(records: NDArray[Any], name: str) -> NDArray[Any]:
    listed = ", ".join(records.dtype.names or ())[:80]
    found = coordinates(records.dtype)
    if found is None or records.ndim not in (1, 2) or records.dtype.hasobject or isinstance(records, np.ma.MaskedArray):
        shape = f"{'masked ' * isinstance(records, np.ma.MaskedArray)}records ({listed}), shape {records.shape}"
        _fail(name, shape, "pass an array of their x, y, z")
    types, offsets = found
    same = len(set(types)) == 1 and types[0].kind == "f"
    step = offsets[1] - offsets[0]
    form = np.dtype({"names": list("xyz"), "formats": types, "offsets": offsets, "itemsize": records.dtype.itemsize})
    parts = np.asarray(records).view(form)
    if same and offsets[2] - offsets[1] == step:  # inside a record, so the view stays inside the array
        x = parts["x"]
        return as_strided(x, (*x.shape, 3), (*x.strides, step), writeable=False)
    kind = np.result_type(*types)
    return np.stack([parts[axis] for axis in "xyz"], axis=-1, dtype=kind if kind.kind == "f" else np.float64)


def _of_message(message: Any, name: str) -> NDArray[Any]:
    """Read a PointCloud2, whose points lie `point_step` and whose rows `row_step` bytes apart."""
    fields: dict[str, Any] = {str(field.name): field for field in message.fields}
    names = next((names for names in _NAMES if all(axis in fields for axis in names)), None)
    if names is None:
        _fail(name, f"a message with the fields {', '.join(fields)[:80] or 'none'}", "its fields must be x, y, z")
    order = ">" if message.is_bigendian else "<"
    height, width, step, row = (int(v) for v in (message.height, message.width, message.point_step, message.row_step))
    formats, offsets = [], []
    for axis in names:
        kind, offset = int(fields[axis].datatype), int(fields[axis].offset)
        if not 1 <= kind < len(_MESSAGE_TYPES) or not 0 <= offset <= step - int(_MESSAGE_TYPES[kind][1]):
            _fail(name, f"a message whose field {axis} has datatype {kind}, offset {offset}", "check who sent it")
        formats.append(order + _MESSAGE_TYPES[kind])
        offsets.append(offset)
    given = message.data
    data = (
        np.asarray(given, dtype=np.uint8)
        if isinstance(given, (list, tuple, np.ndarray))
        else np.frombuffer(given, np.uint8)
    )
    need = (height - 1) * row + width * step
    if min(height, width) < 1 or row < width * step or data.size < need:
        what = f"a message of {width} x {height} points, {step} bytes each, {row} a row, in {data.size} bytes"
        _fail(name, what, "was it cut off?")
    form = np.dtype({"names": list("xyz"), "formats": formats, "offsets": offsets, "itemsize": step})
    records = np.ndarray((height, width), form, np.ascontiguousarray(data), strides=(row, step))
    return _of_records(records if height > 1 else records[0], name)


def _fail(name: str, came: str, remedy: str) -> NoReturn:
    raise InputError(f"{name}: expected {_CLOUD}, but got {came}; {remedy}")
