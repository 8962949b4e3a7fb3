"""PCD, the Point Cloud Library's format: binary, compressed and text. HEIGHT above 1 makes the cloud organised.

VIEWPOINT is not applied: the points are returned as they are stored in the file. If it is not the identity, a note
says so, because CloudCompare keeps the result of a registration there and nowhere else.
"""

from __future__ import annotations

import struct
from itertools import accumulate
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk.files.source import (
    EXPORT_AGAIN,
    MAX_COLUMNS,
    Layout,
    Points,
    Source,
    check_unique_xyz,
    summarised,
    whole_number,
)

_SIZES = {"F": (4, 8), "I": (1, 2, 4, 8), "U": (1, 2, 4, 8)}
_PAGE_BYTES = 1 << 16  # the largest page of the systems that PCL runs on
_KEYS = ("VERSION", "FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA")


def read_pcd(source: Source, factor: float) -> Points:
    """Read the points of a PCD file: (HEIGHT, WIDTH, 3) if HEIGHT is above 1, otherwise (N, 3)."""
    lines = _read_header(source)
    offset = source.file.tell()
    for key in ("FIELDS", "SIZE", "TYPE", "WIDTH", "HEIGHT"):
        if key not in lines:
            source.fail(offset, f"no line {key} in the header")
    where, fields = lines["FIELDS"]
    columns: list[tuple[int, list[str]]] = [
        lines["SIZE"],
        lines["TYPE"],
        lines.get("COUNT", (where, ["1"] * len(fields))),
    ]
    for line_offset, words in columns:
        if len(words) != len(fields):
            source.fail(line_offset, f"expected {len(fields)} entries, one a field, got {len(words)}")
    sizes = [whole_number(source, columns[0][0], word, "SIZE") for word in columns[0][1]]
    counts = [whole_number(source, columns[2][0], word, "COUNT") for word in columns[2][1]]
    kinds = columns[1][1]
    places = check_unique_xyz(source, where, fields)
    for i in range(len(fields)):
        if i in places and counts[i] != 1:
            source.fail(columns[2][0], f"expected {fields[i]} as one number, got COUNT {counts[i]}")
        # A COUNT of 0 marks padding of no bytes, as in clouds of Ouster's sensors.
        if sizes[i] not in _SIZES.get(kinds[i], ()) or counts[i] > 4096:
            source.fail(
                columns[1][0], f"field {fields[i][:40]!r}: TYPE {kinds[i][:9]}, SIZE {sizes[i]}, COUNT {counts[i]}"
            )
    width, height = (whole_number(source, lines[key][0], " ".join(lines[key][1]), key) for key in ("WIDTH", "HEIGHT"))
    count = width * height
    if "POINTS" in lines and whole_number(source, lines["POINTS"][0], " ".join(lines["POINTS"][1]), "POINTS") != count:
        source.fail(lines["POINTS"][0], f"POINTS is not WIDTH x HEIGHT = {count}")
    points = _points(source, lines["DATA"], offset, factor, _Fields(kinds, sizes, counts, places), count)
    points = points.noted(_viewpoint_note(lines.get("VIEWPOINT", (0, []))[1]))
    return points.organised(height, width) if height > 1 else points


def _viewpoint_note(words: list[str]) -> str:
    """Return a note about a viewpoint, a translation and a quaternion w x y z, that is not the identity."""
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    identity = not any(numbers[:3] + numbers[4:])
    if not words or (len(numbers) == 7 and identity):
        return ""
    return (
        f"its VIEWPOINT, {' '.join(words)[:100]}, is not applied: the points are read as they are stored; if it is the "
        "result of a registration, as CloudCompare stores it, apply it and export again"
    )


class _Fields(NamedTuple):
    kinds: list[str]
    sizes: list[int]
    counts: list[int]
    xyz: list[int]

    @property
    def types(self) -> list[str]:
        return [f"{self.kinds[place].lower()}{self.sizes[place]}" for place in self.xyz]

    def starts(self, item_sizes: list[int]) -> tuple[int, list[int]]:
        """Return the length of a point and where its x, y, z start, for the given item sizes of the fields."""
        ends = [0, *accumulate(size * count for size, count in zip(item_sizes, self.counts, strict=True))]
        return ends[-1], [ends[place] for place in self.xyz]


def _points(
    source: Source, data: tuple[int, list[str]], offset: int, factor: float, fields: _Fields, count: int
) -> Points:
    line, words = data
    point_bytes, starts = fields.starts(fields.sizes)
    match words:
        case ["binary"]:
            source.check_size(offset, count, point_bytes, exact=not _padded(source, offset, count * point_bytes))
            return source.points(offset, count, Layout(point_bytes, starts, fields.types), factor)
        case ["ascii"]:
            columns, xyz = fields.starts([1] * len(fields.sizes))
            if columns > MAX_COLUMNS:
                source.fail(line, f"{columns} numbers a line, expected at most {MAX_COLUMNS}")
            return source.text_points(offset, columns, xyz, factor, count=count)
        case ["binary_compressed"]:
            return _compressed_points(source, offset, count, point_bytes, starts, fields.types, factor)
    return source.fail(
        line, f"expected DATA binary, binary_compressed or ascii, got {' '.join(words)[:40]!r}", "export it as binary"
    )


def _compressed_points(
    source: Source, offset: int, count: int, point_bytes: int, starts: list[int], types: list[str], factor: float
) -> Points:
    """Read the block that follows the two sizes: field by field, of all points, compressed as a whole."""
    if count < 1 or source.size - offset < 8:
        source.check_size(offset, count, 8, exact=False, least=8)
    source.file.seek(offset)
    packed, unpacked = struct.unpack("<II", source.file.read(8))
    offset += 8
    if unpacked != count * point_bytes:
        source.fail(
            offset - 4,
            f"the header promises {count} points of {point_bytes} bytes, the compressed data {unpacked} bytes in all",
            f"the header does not fit the data: {EXPORT_AGAIN}",
        )
    if packed > source.size - offset:
        source.fail(
            source.size,
            f"the file ends, but {packed} bytes of compressed data are promised: {packed - source.size + offset} lack",
            "the file was cut off or its header is wrong: copy or export it again",
        )
    if unpacked > packed * _core.files.MAX_LZF_RATIO:
        source.fail(offset - 8, f"{packed} compressed bytes cannot hold {unpacked}")
    # PCL pads the file to whole pages.
    if source.size - offset - packed > _PAGE_BYTES:
        source.fail(offset + packed, f"{source.size - offset - packed} bytes follow the compressed data")
    source.file.seek(offset)
    data = np.fromfile(source.file, dtype=np.uint8, count=packed)
    columns, points = np.empty(unpacked, dtype=np.uint8), np.empty((count, 3), dtype=np.float32)
    with source.faults(after=offset):
        first = [count * start for start in starts]
        summary = _core.files.read_compressed(data, columns, first, types, factor, points, 0)
    read = Points(points, *summary)
    if not read.far:
        return read
    exact = [columns[at : at + count * int(kind[1])].view(f"<{kind}") for at, kind in zip(first, types, strict=True)]
    return summarised(np.stack(exact, axis=1), factor)


def _padded(source: Source, offset: int, data_bytes: int) -> bool:
    """Whether only zeros follow the data, fewer than a page, as in files that PCL's PCDWriter makes outside Windows.

    PCL first stretches the file to the length of the data and a whole page, in which the header then takes its room.
    """
    end = offset + data_bytes
    if not 0 < source.size - end < _PAGE_BYTES:
        return False
    source.file.seek(end)
    return not any(source.file.read(source.size - end))


def _read_header(source: Source) -> dict[str, tuple[int, list[str]]]:
    lines: dict[str, tuple[int, list[str]]] = {}
    while "DATA" not in lines:
        offset, line = source.header_line()
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        key = "FIELDS" if words[0] == "COLUMNS" else words[0]  # its name up to version .5, which PCL reads as well
        if key not in _KEYS or key in lines:
            source.fail(offset, f"a header line that is not PCD, or comes twice: {line[:60]!r}")
        lines[key] = (offset, words[1:])
    return lines


def write_pcd(path: Path, points: NDArray[np.float32]) -> None:
    """Write a binary PCD file."""
    height, width = points.shape[:2] if points.ndim == 3 else (1, len(points))
    header = (
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
        f"WIDTH {width}\nHEIGHT {height}\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {width * height}\nDATA binary\n"
    )
    with path.open("wb") as file:
        file.write(header.encode("ascii"))
        np.ascontiguousarray(points, dtype="<f4").tofile(file)
