"""The steps of a preparation, each in a thread of its own: timed, reported to the caller, and stopped on request."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import wait
from typing import TypeVar

from debulk import _core
from debulk.inspection.running.cycle import BEAT_S, Cycle, Progress
from debulk.stopping import known
from debulk.workers import Workers

Result = TypeVar("Result")


class Preparation:
    """Runs the steps of a preparation one after the other.

    `progress` is called in the calling thread with the name of the step and the share of the work that is done, when a
    step begins and about twenty times a second until it ends. An exception that it raises ends the preparation: the
    step's threads are stopped and waited for, and then the exception is raised.
    """

    def __init__(self, progress: Progress | None = None) -> None:
        self._cycle = Cycle(progress=progress)

    @property
    def stop(self) -> _core.Stop:
        """The stop that is raised when the preparation is to end; long-running work checks it."""
        return self._cycle.stop

    def step(self, name: str, done: float, work: Callable[[], Result]) -> Result:
        """Do one step, at whose beginning the share `done` of the whole work is done."""
        with (
            self._cycle.stage(name, done),
            known(self.stop),
            Workers(1, self.stop) as pool,
        ):
            running = pool.submit(work)
            while not wait([running], BEAT_S).done:
                self._cycle.report(name, done)
            return running.result()
