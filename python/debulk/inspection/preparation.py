"""The steps of a preparation: each in a thread of its own, with its time and its progress, and ended when asked."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from typing import TypeVar

from debulk import _core
from debulk.inspection.cycle import Cycle, Progress
from debulk.stopping import stopping

__all__ = ["Preparation"]

Result = TypeVar("Result")
_BEAT_S = 0.05  # between two calls of the progress function: as soon an exception from it is heeded


class Preparation:
    """Runs the steps of a preparation one after the other.

    Parameters
    ----------
    progress
        Called with the name of the step and the share of the work that is done, from the calling thread, when a step
        begins and some twenty times a second until it ends. An exception from it ends the preparation: the step's
        threads are stopped and waited for, and it is raised.
    """

    def __init__(self, progress: Progress | None = None) -> None:
        self._cycle = Cycle(progress=progress)

    @property
    def stop(self) -> _core.Stop:
        """Raised when the preparation is to end; what takes time heeds it."""
        return self._cycle.stop

    def step(self, name: str, done: float, work: Callable[[], Result]) -> Result:
        """Do one step, which begins when a share `done` of the work is done."""
        with (
            self._cycle.stage(name, done),
            ThreadPoolExecutor(1, "debulk") as pool,
            stopping(self.stop),
        ):
            running = pool.submit(work)
            while not wait([running], _BEAT_S).done:
                self._cycle.report(name, done)
            return running.result()
