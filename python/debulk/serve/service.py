"""The service itself: a short queue, one inspection at a time, and the last results."""

from __future__ import annotations

import asyncio
import contextlib
import itertools
import logging
import secrets
import threading
from collections import Counter, deque
from collections.abc import Callable, Container, Iterator
from contextlib import contextmanager
from pathlib import Path

from debulk import InputError
from debulk.files import Unit, load_angles
from debulk.files.clouds import read_cloud
from debulk.files.source import Points
from debulk.history import History
from debulk.inspection.inspector import Inspector
from debulk.inspection.running.cycle import Cancelled
from debulk.results.trace import now_utc
from debulk.serve.asked import Inspection, Reference
from debulk.serve.folders import Folders
from debulk.serve.inspectors import Cell, Inspectors
from debulk.serve.refusal import Refusal
from debulk.serve.result import Job, Result, refused, result_of
from debulk.serve.threads import in_thread

log = logging.getLogger("debulk")
KEPT = 200
"""Results that can be asked for; older ones are in the history."""
MOST_HANGING = 4
"""Inspections that hang, beyond which no scan is accepted: each holds a thread and its memory."""
_LATE_S = 10.0  # beyond its deadline an inspection is given up: its file does not let itself be read
_LONGEST_S = 300.0  # the same for an inspection without a deadline
_RECENT = 20  # inspections from whose times the next one's is estimated


class Service:
    """Inspects scans one after the other; its methods are called from the thread of its event loop.

    Every report goes into `history`, if there is one. `most_waiting` scans may wait, one more is refused; `deadline_s`
    is that of a scan without one of its own. Another `read` than `debulk.files.clouds.read_cloud` is for tests.
    """

    def __init__(
        self,
        cell: Cell,
        folders: Folders,
        history: History | None = None,
        most_waiting: int = 8,
        deadline_s: float | None = None,
        read: Callable[[Path, Unit], Points] = read_cloud,
    ) -> None:
        self.cell, self.folders, self.history = cell, folders, history
        self.most_waiting, self.deadline_s = most_waiting, deadline_s
        self.inspectors = Inspectors()
        self.run = secrets.token_hex(4)
        self.started_utc = now_utc()
        self.running: Job | None = None
        self.results: dict[str, Result] = {}
        self.counts: Counter[str] = Counter()
        self.seconds = 0.0
        self.changed = asyncio.Event()
        self.closed = ""
        """Why no scan is accepted; empty: scans are."""
        self.on_change: list[Callable[[Job | Result | None], None]] = []
        """Called at every change: with a job that begins, with a result, or with None for any other."""
        self._read = read
        self._numbers = itertools.count(1)
        self._arriving = 0
        self._waiting: deque[Job] = deque()
        self._withdrawn: dict[str, str] = {}
        self._work = asyncio.Event()
        self._hanging: set[str] = set()
        self._preparation: asyncio.Task[None] | None = None
        self._times: deque[float] = deque(maxlen=_RECENT)

    # --- what comes in ---

    @property
    def waiting(self) -> int:
        """Number of scans that wait or are being received."""
        return len(self._waiting) + self._arriving

    def check_room(self) -> None:
        """Refuse another scan if the queue is full, too many inspections hang, or the service was closed."""
        if self.closed:
            raise Refusal(503, self.closed, 5)
        if self.blocked:
            raise Refusal(503, f"{self.hanging} scans could not be read to their end: check the drives", 10)
        if self.waiting >= self.most_waiting:
            self.counts["full"] += 1
            raise Refusal(503, f"{self.waiting} scans wait already", self.estimate_s())

    @contextmanager
    def place_in_the_queue(self) -> Iterator[None]:
        """Hold a place while a scan arrives, if there is room for one."""
        self.check_room()
        self._arriving += 1
        try:
            yield
        finally:
            self._arriving -= 1

    def estimate_s(self) -> float:
        """Estimate when the queue has moved on by a scan, from the times of the last ones."""
        mean = sum(self._times) / len(self._times) if self._times else 1.0
        return min(max(mean, 1.0), 60.0)

    def submit(self, asked: Inspection) -> Job:
        """Accept a scan that a request names: a file in one of the folders, for an inspector that is ready."""
        self.check_room()
        inspector = self.inspectors.get(asked.inspector)
        angles = self.folders.optional(asked.angles)
        return self.accept(asked, inspector, self.folders.file(asked.path or ""), angles, sent=False)

    def accept(self, asked: Inspection, inspector: Inspector, scan: Path, angles: Path | None, sent: bool) -> Job:
        """Put a scan, with the file of its ply's fibre directions, into the queue, in which its request has a place."""
        job = Job(
            self.new_id(),
            inspector,
            asked.inspector,
            scan,
            sent,
            angles,
            asked.deadline_s or self.deadline_s,
            asked.part,
            asked.ply,
        )
        self._waiting.append(job)
        self._work.set()
        self._tell()
        return job

    def new_id(self) -> str:
        """Return an identity that nothing else has, also in no other run of the service."""
        return f"{self.run}-{next(self._numbers)}"

    def withdraw(self, reason: str, numbers: Container[str] | None = None) -> None:
        """Have the scans that wait not inspected, None: all of them; their results are INVALID for this reason."""
        self._withdrawn |= {job.id: reason for job in self._waiting if numbers is None or job.id in numbers}

    def prepare(self, name: str, asked: Reference) -> None:
        """Begin to prepare an inspector; from now on its name has none until it is ready."""
        reference = self.folders.file(asked.reference)
        outline = self.folders.optional(asked.outline)
        self.inspectors.begin(name)
        self._tell()

        def made() -> Inspector:
            return self.cell.changed(asked.angles, outline).inspector(reference)

        self._preparation = asyncio.ensure_future(self._prepared(made))

    async def _prepared(self, made: Callable[[], Inspector]) -> None:
        try:
            found: Inspector | str = await in_thread(made)
        except InputError as error:
            found = str(error)
        except Exception:
            log.exception("a fault of debulk's while an inspector was prepared")
            found = "a fault of debulk's: see the log, and report it"
        self.inspectors.end(found)
        self._tell()

    def remove(self, name: str) -> None:
        """Forget an inspector, or why there is none."""
        self.inspectors.remove(name)
        self._tell()

    # --- what is asked ---

    def state_of(self, number: str) -> str:
        """Return "waiting", "running", "done", or an empty text if there is no such scan."""
        if number in self.results:
            return "done"
        if self.running and self.running.id == number:
            return "running"
        return "waiting" if any(job.id == number for job in self._waiting) else ""

    async def result(self, number: str, wait_s: float) -> Result | None:
        """Return a result, for which is waited so long; None: it is not there yet. An unknown number is refused."""
        with contextlib.suppress(TimeoutError):
            async with asyncio.timeout(wait_s):
                while self.state_of(number) in ("waiting", "running"):
                    await self.changed.wait()
        if not self.state_of(number):
            raise Refusal(404, f"there is no inspection {number} among the last {KEPT} of this run")
        return self.results.get(number)

    @property
    def hanging(self) -> int:
        """Number of inspections that were given up, and whose threads have not come back yet."""
        return len(self._hanging)

    @property
    def blocked(self) -> bool:
        """Whether so many of them hang that no scan is accepted."""
        return self.hanging >= MOST_HANGING

    # --- the work ---

    async def work(self) -> None:
        """Inspect scans until the task is cancelled."""
        while True:
            while not self._waiting:
                self._work.clear()
                await self._work.wait()
            self.running = job = self._waiting.popleft()
            self._tell(job)
            try:
                result = await self._outcome(job)
            finally:
                self.running = None
                if job.sent:
                    job.scan.unlink(missing_ok=True)
            self.results[job.id] = result
            while len(self.results) > KEPT:
                self.results.pop(next(iter(self.results)))
            self.counts[result.verdict] += 1
            self.seconds += result.seconds
            self._times.append(result.seconds)
            self._tell(result)
            await asyncio.sleep(0)  # who listens sends the verdict on before the next scan takes the processor

    async def _outcome(self, job: Job) -> Result:
        if reason := self._withdrawn.pop(job.id, self.closed):
            return refused(job, reason)
        given_up = threading.Event()
        left = (job.deadline_s or _LONGEST_S) + _LATE_S - job.seconds
        try:
            return await asyncio.wait_for(in_thread(self._inspected, job, given_up), max(left, _LATE_S))
        except TimeoutError:
            self._hanging.add(job.id)
            job.inspector.cancel()
            reason = f"{job.scan.name}: could not be read or inspected in time; check the drive it lies on"
        except asyncio.CancelledError:
            job.inspector.cancel()
            raise
        except (InputError, Cancelled) as error:
            reason = str(error).replace(str(job.scan), job.scan.name) if job.sent else str(error)
        except Exception:
            log.exception("a fault of debulk's in the inspection of %s", job.scan.name)
            reason = "a fault of debulk's: see the log, and report it"
        given_up.set()
        return refused(job, reason)

    def _inspected(self, job: Job, given_up: threading.Event) -> Result:
        try:
            return self._of_file(job, given_up)
        finally:
            self._hanging.discard(job.id)

    def _of_file(self, job: Job, given_up: threading.Event) -> Result:
        """Read and inspect a scan, in a thread of its own."""
        cloud = self._read(job.scan, self.cell.unit)
        angles = None if job.angles is None else load_angles(job.angles, self.cell.frame_unit)
        if given_up.is_set():  # nobody waits any more: nothing may come into the history that no cell was told
            raise Cancelled("given up")
        left = None if job.deadline_s is None else max(job.deadline_s - job.seconds, 1e-3)
        context = {name: value for name, value in (("part", job.part), ("ply", job.ply)) if value}
        report = job.inspector.inspect(cloud.values, left, context=context, fibre_angles_deg=angles)
        notes = [f"{job.scan.name}: {note}" for note in cloud.notes]
        report = report.as_decided().changed(  # without the pictures, which nobody asks for
            source={"scan": job.scan.name, "inspector": job.inspector_name, **report.source},
            warnings=(*notes, *report.warnings),
        )
        record = None
        if self.history is not None and not given_up.is_set():
            report, record = self.history.kept(report)
        return result_of(job, report, record)

    def _tell(self, news: Job | Result | None = None) -> None:
        """Tell all who wait for a change."""
        before, self.changed = self.changed, asyncio.Event()
        before.set()
        for listener in self.on_change:
            listener(news)
