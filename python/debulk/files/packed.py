"""Files packed by gzip: unpacked into a temporary file that has no name, up to a limit."""

from __future__ import annotations

import gzip
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager

from debulk.files.source import Source

PACKED = ".gz"
_MOST_BYTES = 1 << 32
_MOST_RATIO = 100  # measured points hardly shrink by more than 10; data made to fill a disk, by 1032
_SPARE_BYTES = 1 << 24
_STEP_BYTES = 1 << 20


@contextmanager
def unpacked(source: Source) -> Iterator[Source]:
    """Unpack a file, which is given up as soon as it grows beyond what a cloud can have."""
    most = min(_MOST_BYTES, _SPARE_BYTES + _MOST_RATIO * source.size)
    with tempfile.TemporaryFile() as file:
        size = 0
        try:
            with gzip.GzipFile(fileobj=source.file) as packed:
                while (part := packed.read(_STEP_BYTES)) and size <= most:
                    size += len(part)
                    file.write(part)
        except (EOFError, gzip.BadGzipFile, zlib.error) as error:
            source.fail(size, f"not readable gzip data: {error}", "copy or pack it again")
        if size > most:
            source.fail(0, f"its {source.size} bytes unpack to more than {most}", "unpack it first (gunzip)")
        file.flush()
        yield Source(source.path, file, size)
