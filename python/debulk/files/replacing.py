"""Writing a file whole or not at all."""

from __future__ import annotations

import contextlib
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from debulk._core import InputError


def check_ending(path: Path, *endings: str) -> None:
    """Refuse the name of a file that has another ending.

    Examples
    --------
    >>> check_ending(Path("layup.pdf"), ".json", ".csv", ".html")
    Traceback (most recent call last):
    ...
    debulk._core.InputError: layup.pdf: expected a file ending in .json, .csv or .html
    """
    if path.suffix.lower() not in endings:
        *most, last = endings
        raise InputError(f"{path}: expected a file ending in {', '.join(most)}{' or ' * bool(most)}{last}")


def write_text(path: Path, text: str) -> None:
    """Write a text file, UTF-8, as `replacing` does."""
    with replacing(path) as temporary:
        # The name of a file may hold bytes that are not UTF-8, which Python keeps as surrogate characters. They
        # can be written as \udce9, which JSON reads back.
        temporary.write_text(text, encoding="utf-8", errors="backslashreplace", newline="\n")


def write_picture(path: Path, image: NDArray[np.uint8]) -> None:
    """Write a picture, (H, W), or (H, W, 3) in blue, green, red, as `replacing` does; its name says the kind."""
    import cv2

    try:
        data = cv2.imencode(path.suffix, image)[1]
    except cv2.error:
        raise InputError(f"{path}: expected the name of a picture, such as one that ends in .png") from None
    with replacing(path) as temporary:
        temporary.write_bytes(data.tobytes())


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a temporary name beside `path` to write to, and move the file into its place when it is complete.

    Whatever ends the process in between, even a power failure, either the old or the new file is there in full. A file
    that is replaced keeps its permissions. A symbolic link is kept, and the file behind it is replaced.
    """
    target = path.resolve() if path.is_symlink() else path
    temporary = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        yield temporary
        if target.exists():
            temporary.chmod(stat.S_IMODE(target.stat().st_mode))
        _flush(temporary)
        temporary.replace(target)
        _flush(target.parent)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror or error}") from None
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def _flush(path: Path) -> None:
    """Wait until a file, or the list of names in a folder, is on the disk."""
    number = os.open(path, os.O_RDONLY)
    try:
        os.fsync(number)
    finally:
        os.close(number)
