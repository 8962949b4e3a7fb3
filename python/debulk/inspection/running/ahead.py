"""What is prepared in a thread of its own, before it is needed, such as the next ply's inspector."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic, TypeVar

from debulk import _core
from debulk.inspection.running.cycle import BEAT_S, Cancelled, Cycle, Progress
from debulk.stopping import known

Result = TypeVar("Result")


class Ahead(Generic[Result]):
    """Makes something in a daemon thread, which ends when it is made, on a `cancel`, and with the interpreter.

    The function `make` gets a progress function, which it has to call, because that ends it on a `cancel`.
    """

    def __init__(self, make: Callable[[Progress], Result]) -> None:
        self._make = make
        self._stop = _core.Stop()
        self._at = "preparing", 0.0
        self._made: Result | None = None
        self._error: BaseException | None = None
        self._thread = threading.Thread(target=self._run, name="debulk_ahead", daemon=True)
        self._thread.start()

    def _run(self) -> None:
        try:
            with known(self._stop):
                self._made = self._make(self._progress)
        except BaseException as error:  # raised where the result is asked for
            self._error = error

    def _progress(self, name: str, done: float) -> None:
        self._at = name, done
        if self._stop.cancelled:
            raise Cancelled("the preparation was cancelled")

    def cancel(self) -> None:
        """End the preparation, and wait until its thread has ended: some 50 ms. What was made already is given up."""
        self._stop.cancel()
        self._thread.join()
        self._error = self._error or Cancelled("the preparation was cancelled")

    @property
    def failed(self) -> bool:
        """Whether the preparation has ended without a result, or was cancelled."""
        return self._error is not None

    def result(self, cycle: Cycle) -> Result:
        """Wait for the result, and raise what the preparation raised.

        A `TimeoutError` is raised if the deadline of the cycle passes before; the preparation continues.
        """
        while self._thread.is_alive():
            if cycle.stop.now():
                raise TimeoutError(
                    "the deadline passed while the inspector was being prepared; the preparation goes on: inspect again"
                )
            cycle.report(self._at[0], 0.0)
            self._thread.join(BEAT_S)
        if self._error is not None:
            raise self._error
        if self._made is None:  # in a child that was forked meanwhile, which has no such thread
            self._made = self._make(self._progress)
        return self._made
