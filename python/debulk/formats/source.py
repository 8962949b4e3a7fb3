"""What all readers share: bounded reads from a file that is not trusted, and errors that say where and what to do."""

from __future__ import annotations

import os
import stat
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError

CHUNK_POINTS = 1 << 20
MAX_HEADER_BYTES = 1 << 16
EXPORT_AGAIN = "export the cloud again"


@dataclass(frozen=True)
class Source:
    """An open, regular file of known size."""

    path: Path
    file: BinaryIO
    size: int

    def fail(self, offset: int, problem: str, remedy: str = EXPORT_AGAIN) -> NoReturn:
        """Raise the one error of a bad file: its name, the byte, what is wrong, what to do."""
        raise InputError(f"{self.path}: byte {offset}: {problem}; {remedy}")

    def header_line(self) -> tuple[int, str]:
        """Return the next line of a text header and the offset where it starts."""
        offset = self.file.tell()
        line = self.file.readline(MAX_HEADER_BYTES)
        if not line.endswith(b"\n") or offset + len(line) > MAX_HEADER_BYTES:
            self.fail(offset, "the header does not end")
        try:
            return offset, line.decode("ascii").strip()
        except UnicodeDecodeError:
            return self.fail(offset, "the header is not plain text")

    def check_size(self, offset: int, count: int, item_bytes: int, *, exact: bool, what: str = "points") -> None:
        """Compare the size that the header promises with the size that the file has, before anything is allocated."""
        if count < 1:
            self.fail(offset, f"no {what} in the file")
        need, have = count * item_bytes, self.size - offset
        if have < need:
            self.fail(
                self.size,
                f"the file ends, but its header promises {count} {what} of {item_bytes} bytes: {need - have} lack",
                "the file was cut off or its header is wrong: copy or export it again",
            )
        if exact and have > need:
            self.fail(
                offset + need,
                f"{have - need} bytes follow the {count} {what} of {item_bytes} bytes that the header promises",
                f"the header does not fit the data: {EXPORT_AGAIN}",
            )

    def records(self, offset: int, count: int, dtype: np.dtype[Any]) -> Iterator[tuple[int, NDArray[Any]]]:
        """Read fixed-size records in chunks, each with the number of its first."""
        self.file.seek(offset)
        for first in range(0, count, CHUNK_POINTS):
            chunk = np.fromfile(self.file, dtype=dtype, count=min(CHUNK_POINTS, count - first))
            if len(chunk) != min(CHUNK_POINTS, count - first):
                self.fail(offset + (first + len(chunk)) * dtype.itemsize, "the file ended while it was read")
            yield first, chunk

    def points(self, offset: int, count: int, dtype: np.dtype[Any]) -> NDArray[np.float32]:
        """Read the fields x, y, z of fixed-size records as (count, 3) float32."""
        points = np.empty((count, 3), dtype=np.float32)
        with np.errstate(over="ignore", invalid="ignore"):  # found as an infinite value afterwards
            for first, chunk in self.records(offset, count, dtype):
                for k, name in enumerate("xyz"):
                    points[first : first + len(chunk), k] = chunk[name]
        return points

    def text_points(self, offset: int, count: int, columns: int, xyz: list[int]) -> NDArray[np.float32]:
        """Read x, y, z from lines of numbers; the columns come in the given places."""
        if count * columns * 2 - 1 > self.size - offset:  # a digit and a separator is the least that a value takes
            self.check_size(offset, count, 2 * columns, exact=False)
        self.file.seek(offset)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error", DeprecationWarning)
                values = np.fromfile(self.file, dtype=np.float64, count=count * columns, sep=" ")
        except (ValueError, DeprecationWarning):  # NumPy's word for text that is not a number
            values = np.empty(0)
        if values.size != count * columns:
            self.fail(
                offset, f"expected {count} lines of {columns} numbers after the header, found others or fewer numbers"
            )
        with np.errstate(over="ignore", invalid="ignore"):
            return np.ascontiguousarray(values.reshape(count, columns)[:, xyz], dtype=np.float32)


@contextmanager
def open_source(path: Path) -> Iterator[Source]:
    """Open a regular file; whatever the system says against it becomes one InputError."""
    try:
        # Not blocking: a pipe that nobody writes to would hold the open until someone does.
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC), "rb") as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):
                raise InputError(f"{path}: expected a file, got {_what(status.st_mode)}")
            yield Source(path, file, status.st_size)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except MemoryError:
        raise InputError(f"{path}: does not fit into this machine's memory; export fewer points") from None


def _what(mode: int) -> str:
    kinds = {"a folder": stat.S_ISDIR, "a pipe": stat.S_ISFIFO, "a socket": stat.S_ISSOCK}
    return next((name for name, is_kind in kinds.items() if is_kind(mode)), "a device")


def whole_number(source: Source, offset: int, text: str, what: str) -> int:
    """Parse a count from a header: a plain, non-negative, not absurd number."""
    if not (text.isascii() and text.isdigit()) or len(text) > 12:
        source.fail(offset, f"{what}: expected a whole number, got {text[:40]!r}")
    return int(text)


def check_unique_xyz(source: Source, offset: int, names: list[str]) -> list[int]:
    """Return the places of x, y, z among the fields of a header."""
    for axis in "xyz":
        if names.count(axis) != 1:
            problem = "more than one field" if axis in names else "no field"
            source.fail(offset, f"{problem} {axis!r} among {', '.join(names)[:80] or 'none'}")
    return [names.index(axis) for axis in "xyz"]
