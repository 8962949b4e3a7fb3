"""PLY, in binary of either byte order and in text: the vertices are the points.

An organised cloud states its shape in one of these ways, which are tried in this order:

* an element ``range_grid``, as Stanford, PCL and MVE write it: for each cell of the image a list with the number of the
  vertex that was seen there, or an empty list; the image's size is in ``obj_info num_cols`` and ``obj_info num_rows``;
* ``comment debulk organised W H``, which must fit the number of vertices;
* ``obj_info num_cols W`` and ``obj_info num_rows H``, as of Zivid; the ``viewportx`` and ``viewporty`` of an element
  ``camera``, as PCL writes it; or a width and a height in any comment or ``obj_info``, as of Photoneo (``Width = W;
  Height = H``). A size that is not the number of vertices belongs to a picture, or points that were not seen have been
  left out: the points are then read as unorganised.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from debulk.files.ply_body import Body, Element, Property
from debulk.files.source import MAX_COLUMNS, Points, Source, check_unique_xyz, whole_number

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
_LENGTHS = ("i1", "u1", "i2", "u2", "i4", "u4")
_FORMATS = ("binary_little_endian", "binary_big_endian", "ascii")
_ORIGIN = ("view_px", "view_py", "view_pz")
_AXES = tuple(f"{of}_axis{along}" for of in "xyz" for along in "xyz")
_VIEWPORT = ("viewportx", "viewporty")
_SIDE = re.compile(r"\b(width|height)\b\W{0,4}(\d{1,9})\b", re.IGNORECASE)


@dataclass
class _Header:
    format: str = ""
    elements: list[Element] = field(default_factory=list)
    width: int = 0
    height: int = 0
    shape_offset: int = 0
    by_comment: bool = False
    sides: dict[str, int] = field(default_factory=dict)  # width and height as a comment names them
    end: int = 0


@dataclass
class _Read:
    """What was read of the elements that matter."""

    points: Points | None = None
    grid: NDArray[np.float64] | None = None
    camera: dict[str, float] | None = None


def read_ply(source: Source, factor: float) -> Points:
    """Read the vertices of a PLY file, (H, W, 3) if it states a width and a height."""
    header = _read_header(source)
    names = [element.name for element in header.elements]
    if "vertex" not in names:
        source.fail(header.end, "no element 'vertex' in the header")
    vertex = header.elements[names.index("vertex")]
    read = _elements(source, header, vertex, factor)
    assert read.points is not None  # the loop over the elements has passed the vertices
    points = _shaped(source, header, vertex, read)
    faces = sum(element.count for element in header.elements if element.name in ("face", "tristrips"))
    if faces:
        points = points.noted(f"it is a mesh of {faces} faces: its vertices are read as the points of a scan")
    return points.noted(_pose_note(read.camera or {}))


def _elements(source: Source, header: _Header, vertex: Element, factor: float) -> _Read:
    """Read the vertices, the grid and the camera, and pass over the elements between them."""
    body = Body(source, header.format, header.end)
    read = _Read()
    told = [element is vertex or element.name in ("range_grid", "camera") for element in header.elements]
    last = max(k for k, matters in enumerate(told) if matters)
    for element in header.elements[: last + 1]:
        if element is vertex:
            read.points = _vertices(source, body, element, factor, alone=element is header.elements[-1])
        elif element.name == "range_grid" and any(one.length for one in element.properties):
            lists = [one.name for one in element.properties if one.length]
            read.grid = body.values(element, lists[:1])[:, 0]
        elif element.name == "camera" and element.count == 1:
            known = [n for n in (*_ORIGIN, *_AXES, *_VIEWPORT) if element.names.count(n) == 1]
            numbers = body.values(element, known).reshape(-1).tolist()
            read.camera = dict(zip(known, numbers, strict=True)) if known else None
        else:
            body.skip(element)
    return read


def _vertices(source: Source, body: Body, element: Element, factor: float, *, alone: bool) -> Points:
    xyz = check_unique_xyz(source, element.offset, element.names)
    for place in xyz:
        if element.properties[place].length:
            source.fail(element.offset, f"expected {element.names[place]} as a number, got a list")
    if len(element.names) > MAX_COLUMNS:
        source.fail(element.offset, f"{len(element.names)} numbers a vertex, expected at most {MAX_COLUMNS}")
    return body.points(element, xyz, factor, alone=alone)


def _shaped(source: Source, header: _Header, vertex: Element, read: _Read) -> Points:
    points, rows, columns = read.points, header.height, header.width
    assert points is not None
    if read.grid is not None:
        if not rows or not columns:
            return points.noted("its range_grid has no num_cols and num_rows: the points are read as unorganised")
        return _on_grid(source, header, points, read.grid)
    if header.by_comment and columns * rows != vertex.count:
        source.fail(
            header.shape_offset,
            f"organised as {columns} x {rows}, but there are {vertex.count} points",
            "mend or remove the line",
        )
    viewport = tuple((read.camera or {}).get(name, 0.0) for name in _VIEWPORT)
    named = tuple(header.sides.get(side, 0) for side in ("width", "height"))
    images = [(wide, high) for wide, high in ((columns, rows), viewport, named) if high > 1]
    for wide, high in images:
        if wide * high == vertex.count and float(wide).is_integer() and float(high).is_integer():
            return points.organised(int(high), int(wide))
    if not images:
        return points
    wide, high = images[0]
    return points.noted(
        f"it names an image of {wide:g} x {high:g} pixels, which {vertex.count} points do not fill: they are read as "
        "unorganised"
    )


def _on_grid(source: Source, header: _Header, points: Points, grid: NDArray[np.float64]) -> Points:
    """Return the image whose cells hold the vertices that the grid names; NaN where it names none."""
    if len(grid) != header.width * header.height:
        source.fail(
            header.shape_offset,
            f"organised as {header.width} x {header.height}, but its range_grid has {len(grid)} cells",
            "mend or remove the line",
        )
    seen = ~np.isnan(grid)
    known = (grid[seen] >= 0) & (grid[seen] < len(points.values))
    if not known.all():
        wrong = grid[seen][~known][0]
        source.fail(header.end, f"its range_grid names vertex {wrong:.0f} of {len(points.values)}")
    image = np.full((len(grid), 3), np.nan, dtype=points.values.dtype)
    image[seen] = points.values[grid[seen].astype(np.int64)]
    return points._replace(values=image.reshape(header.height, header.width, 3))


def _pose_note(camera: dict[str, float]) -> str:
    """Return a note about a camera's pose other than the identity."""
    origin = [camera.get(name, 0.0) for name in _ORIGIN]
    axes: NDArray[Any] = np.array([camera.get(name, 0.0) for name in _AXES]).reshape(3, 3)
    turned = axes.any() and not np.allclose(axes, np.eye(3), rtol=0, atol=1e-6)
    if not turned and not any(origin):
        return ""
    return "the pose of its camera (view_p and axes) is not applied: the points are read as they are stored"


def _read_header(source: Source) -> _Header:
    header = _Header()
    offset, line = source.header_line()
    if line != "ply":
        source.fail(0, "expected the line 'ply'")
    while True:
        offset, line = source.header_line()
        words = line.split()
        match words:
            case ["end_header"]:
                header.end = source.file.tell()
                if not header.format:
                    source.fail(offset, "no line 'format' in the header")
                break
            case ["format", name, _]:
                if name not in _FORMATS:
                    source.fail(offset, f"unknown format {name[:40]!r}", "export as binary_little_endian")
                header.format = name
            case ["comment", "debulk", "organised", width, height]:
                header.width = whole_number(source, offset, width, "width")
                header.height = whole_number(source, offset, height, "height")
                header.shape_offset, header.by_comment = offset, True
            case ["obj_info", ("num_cols" | "num_rows") as key, number] if not header.by_comment:
                length = whole_number(source, offset, number, key)
                setattr(header, "width" if key == "num_cols" else "height", length)
                header.shape_offset = offset
            case ["comment" | "obj_info", *_] | []:
                header.sides |= {side.lower(): int(number) for side, number in _SIDE.findall(line)}
            case ["element", name, number]:
                count = whole_number(source, offset, number, f"element {name[:40]}")
                header.elements.append(Element(name, count, offset))
            case ["property", "list", length, kind, name] if (
                header.elements and kind in _TYPES and _TYPES.get(length) in _LENGTHS
            ):
                header.elements[-1].properties.append(Property(name, _TYPES[kind], _TYPES[length]))
            case ["property", kind, name] if header.elements and kind in _TYPES:
                header.elements[-1].properties.append(Property(name, _TYPES[kind]))
            case _:
                source.fail(offset, f"a header line that is not PLY: {line[:60]!r}")
    return header


def write_ply(path: Path, points: NDArray[np.float32]) -> None:
    """Write a binary little-endian PLY file; the shape of an organised cloud goes into a comment."""
    organised = f"comment debulk organised {points.shape[1]} {points.shape[0]}\n" if points.ndim == 3 else ""
    header = (
        f"ply\nformat binary_little_endian 1.0\ncomment mm\n{organised}element vertex {points.size // 3}\n"
        "property float x\nproperty float y\nproperty float z\nend_header\n"
    )
    with path.open("wb") as file:
        file.write(header.encode("ascii"))
        np.ascontiguousarray(points, dtype="<f4").tofile(file)
