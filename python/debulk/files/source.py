"""The common part of all readers: bounded reads from an untrusted file, and errors that give place and remedy."""

from __future__ import annotations

import os
import stat
from codecs import BOM_UTF8
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from debulk import _core
from debulk._core import InputError
from debulk.origin import is_far, resolution_mm

MAX_POINTS = (1 << 31) - 1
MAX_COLUMNS = 1 << 12
MAX_HEADER_BYTES = 1 << 16
EXPORT_AGAIN = "export the cloud again"
_PRECISE = ("f8", "i4", "u4", "i8", "u8")  # types of numbers that float32 cannot hold
_RECORDS_AT_ONCE = 1 << 18


class Points(NamedTuple):
    """Points, (H, W, 3) or (N, 3) in mm, and the figures gathered while they were read, (0, 0, 0) left out.

    They are float32, or float64 where the file has such precision and they lie so far away that float32 would lose it.
    The notes are whole sentences about what the file holds and the points do not show.
    """

    values: NDArray[np.floating[Any]]
    low: list[float]
    high: list[float]
    at_origin: int
    notes: tuple[str, ...] = ()

    @property
    def far(self) -> bool:
        """Whether all points lie so far from the origin that float32 loses some of their precision."""
        return is_far(self.low, self.high)

    def organised(self, height: int, width: int) -> Points:
        """Return the same points as an image of this height and width."""
        return self._replace(values=self.values.reshape(height, width, 3))

    def noted(self, *notes: str) -> Points:
        """Return the same points with more notes; empty ones are left out."""
        return self._replace(notes=self.notes + tuple(note for note in notes if note))


class Layout(NamedTuple):
    """Where x, y, z are in a record of a binary file, and their types by NumPy's names without the byte order."""

    record_bytes: int
    offsets: Sequence[int]
    types: Sequence[str]
    big_endian: bool = False


def summarised(values: NDArray[Any], factor: float) -> Points:
    """Multiply points in memory, of any type of number, (H, W, 3) or (N, 3), by `factor`, and summarise them.

    The memory may be changed.
    """
    with np.errstate(over="ignore", invalid="ignore"):  # an overflow is found afterwards as an infinite value
        narrow = np.require(values, dtype=np.float32, requirements=["C", "W"])
    points = Points(narrow, *_core.files.scale_and_summarise(narrow.reshape(-1, 3), factor, 0))
    if not points.far or values.dtype == np.float32 or values.dtype.itemsize < 4:
        return points
    wide = np.multiply(values, factor, dtype=np.float64)
    flat = wide.reshape(-1, 3)
    flat[(flat == 0).all(axis=1)] = np.nan  # no measured point is there if the others are far
    low = np.fmin.reduce(flat, axis=0, initial=np.inf).tolist()  # NaN is ignored
    high = np.fmax.reduce(flat, axis=0, initial=-np.inf).tolist()
    return points._replace(values=wide, low=low, high=high)


@dataclass(frozen=True)
class Source:
    """An open, regular file of known size."""

    path: Path
    file: BinaryIO
    size: int

    def fail(self, offset: int, problem: str, remedy: str = EXPORT_AGAIN) -> NoReturn:
        """Raise the one error for a bad file: its name, the byte, what is wrong, and what to do."""
        raise InputError(f"{self.path}: byte {offset}: {problem}; {remedy}")

    def header_line(self) -> tuple[int, str]:
        """Return the next line of a text header and the offset where it starts."""
        offset = self.file.tell()
        line = self.file.readline(MAX_HEADER_BYTES)
        if not line.endswith(b"\n") or offset + len(line) > MAX_HEADER_BYTES:
            self.fail(offset, "the header does not end")
        line = line if offset else line.removeprefix(BOM_UTF8)
        return offset, line.decode("utf-8", errors="replace").strip()  # comments and names may be in any language

    def check_size(
        self, offset: int, count: int, item_bytes: int, *, exact: bool, what: str = "points", least: int | None = None
    ) -> None:
        """Compare the size that the header declares with the size of the file, before anything is allocated.

        `least` is the fewest bytes that the items can take, if they do not all take the same number.
        """
        if count < 1:
            self.fail(offset, f"no {what} in the file")
        need, have = count * item_bytes if least is None else least, self.size - offset
        if have < need:
            self.fail(
                self.size,
                f"the file ends, but its header promises {count} {what} of {item_bytes} bytes: {need - have} lack",
                "the file was cut off or its header is wrong: copy or export it again",
            )
        if count > MAX_POINTS:
            self.fail(offset, f"{count} {what}, expected at most {MAX_POINTS}", "export fewer points")
        if exact and have > need:
            self.fail(
                offset + need,
                f"{have - need} bytes follow the {count} {what} of {item_bytes} bytes that the header promises",
                f"the header does not fit the data: {EXPORT_AGAIN}",
            )

    def points(self, offset: int, count: int, layout: Layout, factor: float) -> Points:
        """Read x, y, z from records of fixed size, multiplied by `factor`."""
        points = np.empty((count, 3), dtype=np.float32)
        with self.faults():
            summary = _core.files.read_records(
                self.file.fileno(), offset, layout.record_bytes, layout.offsets, layout.types, layout.big_endian,
                factor, points, 0,
            )  # fmt: skip
        read = Points(points, *summary)
        precise = any(kind in _PRECISE for kind in layout.types)
        return summarised(self._doubles(offset, count, layout), factor) if precise and read.far else read

    def _doubles(self, offset: int, count: int, layout: Layout) -> NDArray[np.float64]:
        """Read x, y, z without loss, which takes longer."""
        formats = [(">" if layout.big_endian else "<") + kind for kind in layout.types]
        names = ["x", "y", "z"]
        record = np.dtype(
            {"names": names, "formats": formats, "offsets": list(layout.offsets), "itemsize": layout.record_bytes}
        )
        values = np.empty((count, 3))
        self.file.seek(offset)
        for first in range(0, count, _RECORDS_AT_ONCE):
            part = np.fromfile(self.file, dtype=record, count=min(_RECORDS_AT_ONCE, count - first))
            if len(part) < min(_RECORDS_AT_ONCE, count - first):
                self.fail(self.size, "the file ended while it was read")
            for k, name in enumerate(names):
                values[first : first + len(part), k] = part[name]
        return values

    def text_points(
        self, offset: int, columns: int, xyz: Sequence[int], factor: float, *, count: int | None = None,
        separator: str = " ", comments: bool = False, exact: bool = True,
    ) -> Points:  # fmt: skip
        """Read x, y, z from lines of numbers, multiplied by `factor`, from the columns at the given places.

        `count` is the number of lines that the header declares; None means as many as there are.
        """
        if count is not None:  # a number takes at least one digit and one separator
            self.check_size(offset, count, 2 * columns, exact=False, least=2 * columns * count - 1)
        with self.faults():
            rows, points, summary = _core.files.read_text(
                self.file.fileno(), offset, self.size, self.line(offset), columns, xyz, separator, comments,
                -1 if count is None else count, factor, 0,
            )  # fmt: skip
        if points is None or summary is None or (exact and count not in (None, rows)):
            more = count is not None and rows > count
            cause = "it holds several scans" if more else "the file was cut off"
            self.fail(
                offset,
                f"expected {count} lines of {columns} numbers after the header, found {rows}",
                f"{cause}, or its header is wrong: {EXPORT_AGAIN}",
            )
        if rows == 0:
            self.fail(offset, "no points in the file")
        read = Points(points, *summary)
        return self._far_text(offset, read, xyz, factor, separator) if read.far else read

    def _far_text(self, offset: int, read: Points, xyz: Sequence[int], factor: float, separator: str) -> Points:
        """Read the lines again without loss, by NumPy's reader, which takes longer and knows numbers only."""
        self.file.seek(offset)
        lines = (line.decode("utf-8", errors="replace") for line in self.file)
        comments, delimiter = ["#", "//"], None if separator.isspace() else separator
        try:
            values = np.loadtxt(
                lines, comments=comments, delimiter=delimiter, usecols=xyz, max_rows=len(read.values), ndmin=2
            )
        except ValueError:
            values = np.empty((0, 3))
        if values.shape != read.values.shape:
            step = resolution_mm(max(map(abs, read.low)))
            self.fail(
                offset,
                f"its points lie so far from the origin that they are known to {step:.2g} mm only",
                "subtract the same offset from all files, or save the cloud as .npy of float64",
            )
        return summarised(values, factor)

    def line(self, offset: int) -> int:
        """Return the number of the line in which the body starts."""
        self.file.seek(0)
        return self.file.read(offset).count(b"\n") + 1

    @contextmanager
    def faults(self, after: int = 0) -> Iterator[None]:
        """Turn faults that the compiled readers find into this file's error; their byte offsets count from `after`."""
        try:
            yield
        except _core.files.FileFault as fault:
            byte, problem = fault.args
            self.fail(after + byte, problem)


@contextmanager
def open_source(path: Path) -> Iterator[Source]:
    """Open a regular file; any error of the system becomes an InputError."""
    try:
        # Without O_NONBLOCK, opening a pipe that nobody writes to would wait until someone does.
        number = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        try:
            status = os.fstat(number)
            if not stat.S_ISREG(status.st_mode):
                raise InputError(f"{path}: expected a file, got {_what(status.st_mode)}")
            with open(number, "rb", closefd=False) as file:
                yield Source(path, file, status.st_size)
        finally:
            os.close(number)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except ValueError as error:  # a zero byte in the name
        if isinstance(error, InputError):
            raise
        raise InputError(f"{str(path)!r}: cannot be read: {error}") from None
    except MemoryError:
        raise InputError(f"{path}: does not fit into this machine's memory; export fewer points") from None


def _what(mode: int) -> str:
    kinds = {"a folder": stat.S_ISDIR, "a pipe": stat.S_ISFIFO, "a socket": stat.S_ISSOCK}
    return next((name for name, is_kind in kinds.items() if is_kind(mode)), "a device")


def whole_number(source: Source, offset: int, text: str, what: str) -> int:
    """Parse a count from a header: a plain, non-negative number that is not absurdly large."""
    if not (text.isascii() and text.isdigit()) or len(text) > 12:
        source.fail(offset, f"{what}: expected a whole number, got {text[:40]!r}")
    return int(text)


def check_unique_xyz(source: Source, offset: int, names: list[str]) -> list[int]:
    """Return the places of x, y, z among the fields of a header, or of X, Y, Z if there is no small letter."""
    axes = "xyz" if any(axis in names for axis in "xyz") else "XYZ"
    for axis in axes:
        if names.count(axis) != 1:
            problem = "more than one field" if axis in names else "no field"
            source.fail(offset, f"{problem} {axis.lower()!r} among {', '.join(names)[:80] or 'none'}")
    return [names.index(axis) for axis in axes]
