"""How a long call is ended from another thread: running calls are known, and their computations end soon."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from debulk import _core
from debulk._core import InputError

__all__ = ["Running", "stopping"]


class Running:
    """The stops of all running calls, so that one `cancel` ends them all."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._stops: set[_core.Stop] = set()

    def cancel(self) -> None:
        """Trigger every stop that is held; may be called from any thread."""
        with self._lock:
            for stop in self._stops:
                stop.cancel()

    @contextmanager
    def holding(self, stop: _core.Stop) -> Iterator[None]:
        """Let `cancel` trigger this stop while the body runs."""
        with self._lock:
            self._stops.add(stop)
        try:
            yield
        finally:
            with self._lock:
                self._stops.discard(stop)


@contextmanager
def stopping(stop: _core.Stop) -> Iterator[None]:
    """Trigger the stop if the body raises an unforeseen exception, so that threads it still waits for end soon.

    Errors that computations raise themselves (InputError, Stopped) do not trigger it.
    """
    try:
        yield
    except (InputError, _core.Stopped):
        raise
    except BaseException:
        stop.cancel()
        raise
