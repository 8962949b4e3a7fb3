"""The folders from which the service reads: nothing else on the machine can be named in a request."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from debulk import InputError
from debulk.serve.refusal import Refusal


class Folders:
    """Folders whose files may be named in requests; with none, no file can be named."""

    def __init__(self, allowed: Sequence[Path]) -> None:
        for folder in allowed:
            if not folder.is_dir():
                raise InputError(f"--folder: there is no folder {folder}")
        self._allowed = [folder.resolve() for folder in allowed]

    def optional(self, named: str | None) -> Path | None:
        """Return the same for what a request may leave out: None for None."""
        return None if named is None else self.file(named)

    def file(self, named: str) -> Path:
        """Return the path of a file that a request names, without symbolic links; refuse one outside the folders."""
        return self._found(named, "file", Path.is_file)  # no pipe and no device, which may never end

    def folder(self, named: str) -> Path:
        """Return the path of a folder likewise."""
        return self._found(named, "folder", Path.is_dir)

    def _found(self, named: str, kind: str, is_kind: Callable[[Path], bool]) -> Path:
        try:
            path = Path(named).resolve()
            inside = any(path.is_relative_to(folder) for folder in self._allowed)
            if inside and is_kind(path):
                return path
        except (OSError, ValueError, RuntimeError):  # too long, a zero byte, links in a circle
            inside = False
        if not inside:
            raise Refusal(403, f"path: expected a {kind} in a folder given by --folder")
        raise Refusal(404, f"path: there is no such {kind}")
