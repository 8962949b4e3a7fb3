"""PCD, the Point Cloud Library's format: binary and text. HEIGHT above 1 makes the cloud organised.

VIEWPOINT is not applied: the points come as they stand in the file.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from debulk.formats.source import Source, check_unique_xyz, whole_number

_KINDS = {"F": "f", "I": "i", "U": "u"}
_KEYS = ("VERSION", "FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA")


def read_pcd(source: Source) -> NDArray[np.float32]:
    """Read the points of a PCD file, (HEIGHT, WIDTH, 3) if HEIGHT is above 1, else (N, 3)."""
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
        if kinds[i] not in _KINDS or sizes[i] not in (1, 2, 4, 8) or not 1 <= counts[i] <= 4096:
            source.fail(
                columns[1][0], f"field {fields[i][:40]!r}: TYPE {kinds[i][:9]}, SIZE {sizes[i]}, COUNT {counts[i]}"
            )
        if i in places and (kinds[i] != "F" or sizes[i] < 4 or counts[i] != 1):
            source.fail(columns[1][0], f"expected {fields[i]} as one F of 4 or 8 bytes, got {kinds[i]} of {sizes[i]}")
    width, height = (whole_number(source, lines[key][0], " ".join(lines[key][1]), key) for key in ("WIDTH", "HEIGHT"))
    count = width * height
    if "POINTS" in lines and whole_number(source, lines["POINTS"][0], " ".join(lines["POINTS"][1]), "POINTS") != count:
        source.fail(lines["POINTS"][0], f"POINTS is not WIDTH x HEIGHT = {count}")
    match lines["DATA"][1]:
        case ["binary"]:
            keys = [name if i in places else f"skip_{i}" for i, name in enumerate(fields)]
            layout = [(keys[i], f"<{_KINDS[kinds[i]]}{sizes[i]}", (counts[i],)) for i in range(len(fields))]
            plain = [(entry[0], entry[1]) if i in places else entry for i, entry in enumerate(layout)]
            try:
                dtype = np.dtype(plain)
            except TypeError:  # F of 1 byte, say
                source.fail(columns[1][0], "a combination of TYPE and SIZE that does not exist")
            source.check_size(offset, count, dtype.itemsize, exact=True)
            points = source.points(offset, count, dtype)
        case ["ascii"]:
            starts = np.cumsum([0, *counts])
            if count < 1:
                source.check_size(offset, count, 1, exact=False)
            points = source.text_points(offset, count, int(starts[-1]), [int(starts[i]) for i in places])
        case words:
            remedy = "export it as binary (PCL: pcl_convert_pcd_ascii_binary in.pcd out.pcd 1)"
            source.fail(lines["DATA"][0], f"expected DATA binary or ascii, got {' '.join(words)[:40]!r}", remedy)
    return points.reshape(height, width, 3) if height > 1 else points


def _read_header(source: Source) -> dict[str, tuple[int, list[str]]]:
    lines: dict[str, tuple[int, list[str]]] = {}
    while "DATA" not in lines:
        offset, line = source.header_line()
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        if words[0] not in _KEYS or words[0] in lines:
            source.fail(offset, f"a header line that is not PCD, or comes twice: {line[:60]!r}")
        lines[words[0]] = (offset, words[1:])
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
