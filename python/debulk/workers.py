"""Threads that help with one call and end with it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future
from queue import SimpleQueue
from typing import ParamSpec, TypeVar

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
        Largest number of threads; each is started when there is work for it.
    name
        Beginning of the threads' names.

    Examples
    --------
    >>> with Workers(2) as workers:
    ...     list(workers.map(abs, [-1, -2, -3]))
    [1, 2, 3]
    """

    def __init__(self, most: int, name: str = "debulk") -> None:
        self._most, self._name = most, name
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

        with self._lock:
            if self._closed:
                raise RuntimeError("the workers have been told to end")
            if len(self._threads) < self._most:
                name = f"{self._name}_{len(self._threads)}"
                thread = threading.Thread(target=_run, args=(self._tasks,), name=name, daemon=self._daemon)
                self._threads.append(thread)  # before it starts: Ctrl-C in between must not leave it behind
                thread.start()
            self._tasks.put(task)
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Let the threads end when all work is done, and wait for that."""
        with self._lock:
            if not self._closed:
                self._closed = True
                for _ in self._threads:
                    self._tasks.put(None)
        if wait:
            for thread in self._threads:
                if thread.ident is not None:  # else Ctrl-C came before it began: it finds its end in the queue
                    thread.join()


def _run(tasks: SimpleQueue[Callable[[], None] | None]) -> None:
    while (task := tasks.get()) is not None:
        task()
        del task  # with the result and all that the function holds, while this thread waits for the next
