"""How long calls are ended from other threads: what runs is known, and what is waited for ends soon."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from debulk import _core
from debulk._core import InputError

__all__ = ["Running", "stopping"]


class Running:
    """The stops of the calls that run, for a `cancel` that ends them all."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._stops: set[_core.Stop] = set()

    def cancel(self) -> None:
        """Raise every stop that is held, from any thread."""
        with self._lock:
            for stop in self._stops:
                stop.cancel()

    @contextmanager
    def holding(self, stop: _core.Stop) -> Iterator[None]:
        """Let `cancel` raise this stop while the body runs."""
        with self._lock:
            self._stops.add(stop)
        try:
            yield
        finally:
            with self._lock:
                self._stops.discard(stop)


@contextmanager
def stopping(stop: _core.Stop) -> Iterator[None]:
    """Raise the stop when the body ends by what no computation throws: the threads that it waits for end soon then."""
    try:
        yield
    except (InputError, _core.Stopped):
        raise
    except BaseException:
        stop.cancel()
        raise
