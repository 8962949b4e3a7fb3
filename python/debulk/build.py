"""Which build of debulk this is, without a version control: hashes of its files.

CMake runs this file, too, and bakes into the compiled module which C++ sources it was built from.
"""

from __future__ import annotations

import functools
import hashlib
import sys
from pathlib import Path

_PACKAGE = Path(__file__).parent


def digits(folder: Path, *endings: str) -> str:
    """Return the first 16 digits of the SHA-256 of the names and contents of a folder's files with these endings."""
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*")):
        if path.suffix in endings and path.is_file():
            content = path.read_bytes()
            digest.update(f"{path.relative_to(folder).as_posix()}\0{len(content)}\0".encode())
            digest.update(content)
    return digest.hexdigest()[:16]


def sources_id(cpp: Path) -> str:
    """Return the digits of the C++ sources in a folder: comments count, too, because nothing tells them from code."""
    return digits(cpp, ".cpp", ".hpp", ".inl", ".txt")


@functools.cache
def build_id() -> str:
    """Return the digits of the compiled module and of every Python file of the package.

    Two installations with the same digits compute the same, on the same libraries. It takes a few hundredths of a
    second, once in a process.

    Examples
    --------
    >>> len(build_id())
    16
    """
    return digits(_PACKAGE, ".py", ".so", ".pyd")


def check_core(core: str, version: str, package: Path = _PACKAGE) -> None:
    """Refuse a compiled module that was built from other C++ sources than the Python files go with.

    Such a mix gives other verdicts, mostly without any error. In a source tree the Python files go with the sources
    that lie there; an installed package carries the digits of its sources in a file.

    Parameters
    ----------
    core
        Version and digits of the sources, as they are baked into the compiled module.
    version
        That of the Python files.

    Raises
    ------
    ImportError
        If they differ, with both and with what to do.
    """
    cpp = package.parent.parent / "cpp"
    if in_tree := (cpp / "bindings").is_dir():
        sources = sources_id(cpp)
    else:
        stamp = package / "core_sources.txt"
        sources = stamp.read_text().strip('"\n') if stamp.is_file() else "unknown"
    if core != f"{version} {sources}":
        what = "build it from the sources in this tree" if in_tree else "install the whole package again"
        raise ImportError(
            f"debulk: the compiled module is build {core}, but the Python files are build {version} {sources} (the "
            f"version, and digits of the C++ sources): together they could give wrong verdicts; {what} "
            f"(module and Python files: {package})"
        )


if __name__ == "__main__":  # python build.py CPP_FOLDER OUTPUT: a string literal, which C++ includes
    Path(sys.argv[2]).write_text(f'"{sources_id(Path(sys.argv[1]))}"\n')
