"""PLY, in binary of either byte order and in text. An organised cloud states its width and height in a comment.

The shape comes from ``comment debulk organised W H``, or from ``obj_info num_cols W`` and ``obj_info num_rows H``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import accumulate
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from debulk.files.source import MAX_COLUMNS, Layout, Points, Source, check_unique_xyz, whole_number

_WIDTHS = {
    "char": 1, "int8": 1, "uchar": 1, "uint8": 1, "short": 2, "int16": 2, "ushort": 2, "uint16": 2, "int": 4,
    "int32": 4, "uint": 4, "uint32": 4, "float": 4, "float32": 4, "double": 8, "float64": 8,
}  # fmt: skip
_FLOATS = ("float", "float32", "double", "float64")
_FORMATS = ("binary_little_endian", "binary_big_endian", "ascii")


@dataclass
class _Element:
    name: str
    count: int
    offset: int
    names: list[str] = field(default_factory=list)
    types: list[str] = field(default_factory=list)
    has_list: bool = False

    @property
    def item_bytes(self) -> int:
        return sum(_WIDTHS[kind] for kind in self.types)

    def layout(self, xyz: list[int], *, big_endian: bool) -> Layout:
        widths = [_WIDTHS[kind] for kind in self.types]
        starts = [0, *accumulate(widths)]
        return Layout(starts[-1], [starts[place] for place in xyz], [widths[place] for place in xyz], big_endian)


@dataclass
class _Header:
    format: str = ""
    elements: list[_Element] = field(default_factory=list)
    width: int = 0
    height: int = 0
    shape_offset: int = 0
    end: int = 0


def read_ply(source: Source, factor: float) -> Points:
    """Read the vertices of a PLY file, (H, W, 3) if its header states a width and a height."""
    header = _read_header(source)
    offset, before = header.end, 0
    for element in header.elements:
        if element.name == "vertex":
            break
        if element.has_list or header.format == "ascii":
            source.fail(element.offset, f"element {element.name!r} before the vertices", "export the points alone")
        offset += element.count * element.item_bytes
        before += 1
    else:
        source.fail(header.end, "no element 'vertex' in the header")
    if element.has_list:
        source.fail(element.offset, "a list among the properties of a vertex", "export the points alone")
    xyz = check_unique_xyz(source, element.offset, element.names)
    for place in xyz:
        if element.types[place] not in _FLOATS:
            name, kind = element.names[place], element.types[place]
            source.fail(element.offset, f"expected {name} as float or double, got {kind}")
    alone = len(header.elements) == before + 1
    if header.format == "ascii":
        columns = len(element.names)
        if columns > MAX_COLUMNS:
            source.fail(element.offset, f"{columns} numbers a vertex, expected at most {MAX_COLUMNS}")
        points = source.text_points(offset, columns, xyz, factor, count=element.count, exact=alone)
    else:
        layout = element.layout(xyz, big_endian=header.format == "binary_big_endian")
        source.check_size(offset, element.count, layout.record_bytes, exact=alone)
        points = source.points(offset, element.count, layout, factor)
    # A range grid lists only the vertices that were seen; its num_cols and num_rows count cells, not vertices.
    if header.width and not any(other.name == "range_grid" for other in header.elements):
        if not header.height or header.width * header.height != element.count:
            source.fail(
                header.shape_offset,
                f"organised as {header.width} x {header.height}, but there are {element.count} points",
                "mend or remove the line",
            )
        return points.organised(header.height, header.width)
    return points


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
                header.shape_offset = offset
            case ["obj_info", ("num_cols" | "num_rows") as key, number]:
                length = whole_number(source, offset, number, key)
                setattr(header, "width" if key == "num_cols" else "height", length)
                header.shape_offset = offset
            case ["comment" | "obj_info", *_] | []:
                pass
            case ["element", name, number]:
                count = whole_number(source, offset, number, f"element {name[:40]}")
                header.elements.append(_Element(name, count, offset))
            case ["property", "list", _, _, _] if header.elements:
                header.elements[-1].has_list = True
            case ["property", kind, name] if header.elements and kind in _WIDTHS:
                header.elements[-1].names.append(name)
                header.elements[-1].types.append(kind)
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
