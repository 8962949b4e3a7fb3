"""How a long call is ended from another thread: running calls are known, and their computations end soon."""

from __future__ import annotations

import atexit
import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

from debulk import _core

_AT_EXIT_S = 5.0  # longest wait, at the interpreter's exit, for the calls of daemon threads; they end in milliseconds
_every: set[_core.Stop] = set()  # of all running calls of this process
_exiting = False


def stop_after(deadline_s: float | None) -> _core.Stop:
    """Return a stop whose deadline passes so many seconds from now; None: it has no deadline."""
    stop = _core.Stop()
    if deadline_s is not None:
        if not deadline_s > 0:
            raise _core.InputError(f"deadline_s: expected a positive number of seconds, but got {deadline_s!r}")
        stop.set_deadline(deadline_s)
    return stop


class Running:
    """The stops of the running calls of one object, so that one `cancel` ends them all."""

    def __init__(self) -> None:
        self._stops: set[_core.Stop] = set()

    def cancel(self) -> None:
        """Trigger every stop that is held; may be called from any thread."""
        for stop in tuple(self._stops):
            stop.cancel()

    @contextmanager
    def holding(self, stop: _core.Stop) -> Iterator[None]:
        """Let `cancel`, and the interpreter's exit, trigger this stop while the body runs."""
        self._stops.add(stop)
        try:
            with known(stop):
                yield
        finally:
            self._stops.discard(stop)


@contextmanager
def known(stop: _core.Stop) -> Iterator[None]:
    """Let the interpreter's exit trigger this stop while the body runs."""
    _every.add(stop)
    try:
        if _exiting and threading.current_thread().daemon:
            raise RuntimeError("the interpreter exits: a daemon thread cannot begin another call of debulk")
        yield
    finally:
        _every.discard(stop)


@atexit.register
def _end_daemons() -> None:
    """End the calls of daemon threads, for which the interpreter does not wait, before it goes away under them."""
    global _exiting
    _exiting = True
    late = time.monotonic() + _AT_EXIT_S
    while _every and time.monotonic() < late:
        for stop in tuple(_every):
            stop.cancel()
        time.sleep(0.001)


os.register_at_fork(after_in_child=_every.clear)  # those of the parent's other threads do not run in the child
