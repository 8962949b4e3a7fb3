"""PTX, as Leica's scanners write it: an image of points, column by column, under the scanner's place.

The first ten lines hold the number of columns, the number of rows, the scanner's place and axes (four lines of three)
and the same as a matrix of four lines of four. Then each line is x y z and an intensity, with or without a colour, in
the scanner's own frame; ``0 0 0`` means that nothing was seen.
"""

from __future__ import annotations

import math

import numpy as np

from debulk.files.source import EXPORT_AGAIN, MAX_COLUMNS, Points, Source, whole_number
from debulk.files.words import is_number

_LINES = (1, 1, 3, 3, 3, 3, 4, 4, 4, 4)  # numbers in each line of the header


def read_ptx(source: Source, factor: float) -> Points:
    """Read the points of a .ptx file, (H, W, 3)."""
    header: list[list[str]] = []
    for expected in _LINES:
        offset, text = source.header_line()
        words = text.split()
        if len(words) != expected or not all(map(is_number, words)):
            problem = f"line {len(header) + 1}: expected {expected} numbers of the header, got {text[:60]!r}"
            source.fail(offset, problem, EXPORT_AGAIN)
        header.append(words)
    width, height = (whole_number(source, 0, header[k][0], name) for k, name in enumerate(("columns", "rows")))
    body = source.file.tell()
    columns = len(source.header_line()[1].split()) if body < source.size else 0
    if not 3 <= columns <= MAX_COLUMNS:
        source.fail(body, f"line {len(_LINES) + 1}: expected x y z and more, got {columns} columns", EXPORT_AGAIN)
    points = source.text_points(body, columns, (0, 1, 2), factor, count=width * height)
    flat = points.values
    flat[(flat == 0).all(axis=1)] = np.nan
    values = np.ascontiguousarray(flat.reshape(width, height, 3).transpose(1, 0, 2))
    points = points._replace(values=values, at_origin=0)  # those mean nothing seen
    return points.noted(_motion_note(np.array(header[6:], dtype=np.float64).T, factor))


def _motion_note(motion: np.ndarray[tuple[int, int], np.dtype[np.float64]], factor: float) -> str:
    """Return a note about a motion that is not applied; it stands in the file by columns, as its last line shows."""
    if np.allclose(motion, np.eye(4), atol=1e-9):
        return ""
    shift_mm = float(np.linalg.norm(motion[:3, 3])) * factor
    turned = math.degrees(math.acos(min(max((float(np.trace(motion[:3, :3])) - 1) / 2, -1.0), 1.0)))
    return (
        f"its header moves the points by {shift_mm:.6g} mm and turns them by {turned:.4g} degrees; they are given in "
        "the scanner's frame, without that motion: if the pose needs it, multiply it in, and scan and reference need "
        "the same one"
    )
