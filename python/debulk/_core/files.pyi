"""Types of the compiled module `debulk._core.files`."""

from collections.abc import Sequence

from debulk._core import _Bytes, _Floats, _Singles

MAX_LZF_RATIO: int

class FileFault(Exception): ...

def read_compressed(
    compressed: _Bytes,
    columns: _Bytes,
    offsets: Sequence[int],
    types: Sequence[str],
    factor: float,
    out: _Singles,
    threads: int,
) -> tuple[list[float], list[float], int]: ...
def read_elements(
    file: int, begin: int, end: int, properties: Sequence[tuple[str, str, int]], big_endian: bool, out: _Floats
) -> int: ...
def read_records(
    file: int,
    offset: int,
    record_bytes: int,
    offsets: Sequence[int],
    types: Sequence[str],
    big_endian: bool,
    factor: float,
    out: _Singles,
    threads: int,
) -> tuple[list[float], list[float], int]: ...
def read_text(
    file: int,
    begin: int,
    end: int,
    first_line: int,
    columns: int,
    xyz: Sequence[int],
    separator: str,
    comments: bool,
    most_rows: int,
    factor: float,
    threads: int,
) -> tuple[int, _Singles, tuple[list[float], list[float], int]] | tuple[int, None, None]: ...
def scale_and_summarise(points: _Singles, factor: float, threads: int) -> tuple[list[float], list[float], int]: ...
