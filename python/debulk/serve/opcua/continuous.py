"""A continuous job: every scan that comes into a folder is inspected, until the job is ended."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from pathlib import Path

from debulk.files.clouds import named_as_cloud
from debulk.serve.asked import Inspection
from debulk.serve.refusal import Refusal
from debulk.serve.service import Service
from debulk.serve.threads import in_thread

_LOOK_S = 0.2  # between two looks into the folder; a scan that is the same in both is there whole

Stamps = dict[Path, tuple[int, int]]


class Continuous:
    """Submits what comes into a folder after `before` was seen in it; all is asked for as `asked` has it.

    `took` is called with each scan that was submitted, `looked` when no more is looked for.
    """

    def __init__(
        self,
        service: Service,
        job: str,
        folder: Path,
        asked: Inspection,
        before: Stamps,
        took: Callable[[str], None],
        looked: Callable[[], None],
    ) -> None:
        self.job = job
        self.scans: set[str] = set()
        """Those that were submitted and have no result yet."""
        self._service, self._folder, self._asked, self._took = service, folder, asked, took
        self._taken = dict(before)
        self._last: set[Path] | None = None
        self._task = asyncio.ensure_future(self._follow())
        self._task.add_done_callback(lambda _: looked())

    @property
    def ended(self) -> bool:
        """Whether nothing more is looked for, and all that was found has its result."""
        return self._task.done() and not self.scans

    async def stop(self) -> None:
        """Take what lies in the folder at this moment, and then no more."""
        self._last = set(await in_thread(scans_in, self._folder))

    async def abort(self) -> None:
        """Take no more."""
        self._task.cancel()
        await asyncio.gather(self._task, return_exceptions=True)

    async def _follow(self) -> None:
        seen = self._taken
        while True:
            await asyncio.sleep(_LOOK_S)
            last = self._last  # before the look, which is to show all of them
            now = await in_thread(scans_in, self._folder)
            for path, stamp in sorted(now.items()):
                whole = stamp == seen.get(path) and stamp != self._taken.get(path)
                if whole and (last is None or path in last) and not self._submitted(path, stamp):
                    break
            if last is not None and all(self._taken.get(path) == now[path] for path in last & now.keys()):
                return
            seen = now

    def _submitted(self, path: Path, stamp: tuple[int, int]) -> bool:
        """Submit a scan; what is refused, for want of room or of an inspector, is tried again at the next look."""
        try:
            scan = self._service.submit(self._asked.model_copy(update={"path": str(path)}))
        except Refusal:
            return False
        self._taken[path] = stamp
        self.scans.add(scan.id)
        self._took(scan.id)
        return True


def scans_in(folder: Path) -> Stamps:
    """Return size and time of the files in a folder that are named as clouds and not hidden."""
    found = {}
    with contextlib.suppress(OSError):  # what has left, and a drive that is away: the next look sees it again
        for path in folder.iterdir():
            if named_as_cloud(path) and not path.name.startswith(".") and path.is_file():
                found[path] = (path.stat().st_size, path.stat().st_mtime_ns)
    return found
