"""The clocks of an inspection or its preparation, and of a pocket: deadline, times, progress, and the way out."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from concurrent.futures import wait
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, TypeVar

from debulk import _core
from debulk.results.finding import Finding
from debulk.stopping import known, stop_after
from debulk.verdict import Verdict
from debulk.workers import Workers

log = logging.getLogger("debulk")
Progress = Callable[[str, float], None]
Result = TypeVar("Result")
BEAT_S = 0.05  # between two looks at a deadline or a stop, and between two calls of the progress function


class Cancelled(RuntimeError):
    """The inspection was cancelled from another thread; there is no report."""


class Cycle:
    """The clock of one inspection, from now to a deadline, if there is one; or that of the preparation of many."""

    def __init__(self, deadline_s: float | None = None, progress: Progress | None = None) -> None:
        self.stop = stop_after(deadline_s)
        self.current = ""
        self._progress = progress
        self._stages: dict[str, float] = {}

    @contextmanager
    def stage(self, name: str, done: float) -> Iterator[None]:
        """Time the body as a stage; `done` is the share of the work that is done when it begins."""
        self.check()
        self.current = name
        self.report(name, done)
        began = time.perf_counter()
        yield
        self._stages[name] = 1e3 * (time.perf_counter() - began)
        log.debug("%s: %.1f ms", name, self._stages[name])

    def step(self, name: str, done: float, work: Callable[[], Result]) -> Result:
        """Do a stage's work in another thread, and call the progress function some twenty times a second until it ends.

        An exception that the progress function raises ends the work: it is stopped and waited for.
        """
        with self.stage(name, done), known(self.stop), Workers(1, self.stop) as pool:
            running = pool.submit(work)
            while not wait([running], BEAT_S).done:
                self.report(name, done)
            return running.result()

    def check(self) -> None:
        """Raise `Cancelled` if another thread has cancelled the inspection."""
        if self.stop.cancelled:
            raise Cancelled("the inspection was cancelled")

    def split(self, name: str, parts_ms: dict[str, float]) -> None:
        """Divide the time of a stage among named parts; the remaining time stays with the stage."""
        rest = self._stages.pop(name) - sum(parts_ms.values())
        self._stages |= {**parts_ms, name: max(0.0, rest)}

    def report(self, name: str, done: float) -> None:
        """Call the progress function, if there is one."""
        if self._progress is not None:
            self._progress(name, done)

    def timings_ms(self) -> dict[str, float]:
        """Return the milliseconds of the stages so far, in order."""
        return dict(self._stages)


def watched(stop: _core.Stop, work: Callable[[], Result]) -> Result:
    """Do the work in another thread, so that this one can react to Ctrl-C while the work is in the compiled core."""
    with Workers(1, stop) as pool:
        return pool.submit(work).result()


@contextmanager
def in_parallel(stop: _core.Stop, work: Callable[[], Result], threads: int) -> Iterator[Callable[[], Result]]:
    """Do the work in another thread while the body runs; the body gets a function that waits for the result.

    If only one thread is allowed, the work is done when the body asks for its result.
    """
    if threads == 1:
        yield lambda: watched(stop, work)
        return
    with Workers(1, stop) as pool:
        yield pool.submit(work).result


def heed(stop: _core.Stop | None, what: str) -> None:
    """Raise `Stopped`, with `what` in its message, if the stop is raised or its deadline has passed."""
    if stop is not None and stop.now():
        raise _core.Stopped(f"{what} was stopped")


def or_late(
    search: Callable[[], Result], stop: _core.Stop | None, what: str, late: Callable[[Finding], Result]
) -> Result:
    """Return what a search gives; if the stop's deadline ends it, what `late` makes of a finding that says so."""
    try:
        return search()
    except _core.Stopped:
        if stop is None or stop.cancelled:
            raise
        return late(Finding("deadline", Verdict.UNDECIDED, f"the deadline passed before {what}"))


@dataclass
class Stopwatch:
    """Milliseconds per step, without those of the steps nested in it."""

    split_ms: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        """Time the body as a part of the step."""
        began, before_ms = time.perf_counter(), sum(self.split_ms.values())
        yield
        within_ms = sum(self.split_ms.values()) - before_ms
        self.split_ms[name] = self.split_ms.get(name, 0.0) + 1e3 * (time.perf_counter() - began) - within_ms

    def figures(self) -> dict[str, Any]:
        """Return the times as a report has them."""
        return {"runtime_ms": sum(self.split_ms.values()), "runtime_split_ms": self.split_ms}
