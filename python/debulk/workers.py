"""Threads that help with one call and end with it."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from queue import SimpleQueue
from typing import Any, ParamSpec, TypeVar

from debulk import _core
from debulk._core import InputError

Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


class Workers(Executor):
    """An executor whose threads belong to the thread that made it, and not to the interpreter.

    That of `concurrent.futures` refuses work as soon as the main thread has ended, although another thread may still be
    in the midst of an inspection for which the interpreter waits, and the interpreter's exit waits for its threads even
    if they work for a daemon thread. These threads are daemons if the thread that made the executor is one.

    Parameters
    ----------
    most
        Largest number of threads, 0 for as many as the process may use; each is started when there is work for it.
    stop
        What the work heeds. It is raised if an unforeseen exception ends the body of the `with` statement, or the wait
        for the threads after it, so that they end soon. Errors that computations raise themselves (InputError, Stopped)
        do not raise it.
    name
        Beginning of the threads' names.

    Examples
    --------
    >>> with Workers(2) as workers:
    ...     list(workers.map(abs, [-1, -2, -3]))
    [1, 2, 3]
    """

    _closed = True  # until there is something to close

    def __init__(self, most: int, stop: _core.Stop | None = None, name: str = "debulk") -> None:
        self._most, self._stop, self._name = most or _core.default_threads(), stop or _core.Stop(), name
        self._daemon = threading.current_thread().daemon
        self._tasks: SimpleQueue[Callable[[], None] | None] = SimpleQueue()
        self._lock = threading.Lock()
        self._threads: list[threading.Thread] = []
        self._closed = False

    def submit(
        self, work: Callable[Parameters, Result], /, *args: Parameters.args, **kwargs: Parameters.kwargs
    ) -> Future[Result]:
        """Let one of the threads call the function, and return the future of its result."""
        future: Future[Result] = Future()

        def task() -> None:
            if not future.set_running_or_notify_cancel():
                return
            try:
                result = work(*args, **kwargs)
            except BaseException as error:
                future.set_exception(error)
            else:
                future.set_result(result)

        with _uninterrupted(), self._lock:
            if self._closed:
                raise RuntimeError("the workers have been told to end")
            if len(self._threads) < self._most:
                name = f"{self._name}_{len(self._threads)}"
                thread = threading.Thread(target=_run, args=(self._tasks,), name=name, daemon=self._daemon)
                thread.start()
                self._threads.append(thread)
            self._tasks.put(task)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Let the threads end when all work is done, and wait for that."""
        try:
            with _uninterrupted(), self._lock:
                self._close()
        finally:
            self._close()  # again, if Ctrl-C came before
            if wait:
                self._wait()

    def __exit__(self, kind: type[BaseException] | None, *raised: Any) -> None:
        """End the threads; whatever no computation throws (Ctrl-C, a progress function's error) ends their work."""
        if kind is not None and not issubclass(kind, InputError | _core.Stopped):
            self._stop.cancel()
        self.shutdown()

    def __del__(self) -> None:
        """End what Ctrl-C has left running, if it came in the very beginning of `__exit__`."""
        if not self._closed:
            self._stop.cancel()
            self._close()

    def _close(self) -> None:
        if not self._closed:
            self._closed = True
            for _ in self._threads:
                self._tasks.put(None)

    def _wait(self) -> None:
        """Wait for the threads; Ctrl-C ends their work, and is raised when they have ended or when it comes again."""
        try:
            for thread in self._threads:
                thread.join()
        except BaseException:
            self._stop.cancel()
            for thread in self._threads:
                thread.join()
            raise


def _run(tasks: SimpleQueue[Callable[[], None] | None]) -> None:
    while (task := tasks.get()) is not None:
        task()
        del task  # with the result and all that the function holds, while this thread waits for the next


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Raise what a signal raises only after the body: amid a thread's start it would leave that thread behind."""
    numbers = (signal.SIGINT, signal.SIGTERM)
    handlers = {number: handler for number in numbers if callable(handler := signal.getsignal(number))}
    if threading.current_thread() is not threading.main_thread() or not handlers:
        yield  # only the main thread runs handlers
        return
    came: list[Any] = []
    for number in handlers:
        signal.signal(number, lambda *given: came.append(given))
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        if came:
            handlers[came[0][0]](*came[0])
