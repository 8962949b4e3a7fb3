"""What a fork leaves to the child, which has none of the other threads: a lock that one of them held stays locked."""

from __future__ import annotations

import os
import threading
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Generic, Self, TypeVar, overload

Value = TypeVar("Value")


class Guard:
    """A lock that is open again in a forked child.

    Attributes
    ----------
    torn
        True in a child that was forked while a thread held the lock: what the lock guards may be half changed, and has
        to be made anew.
    """

    def __init__(self) -> None:
        self.torn = False
        self._lock = threading.Lock()
        _guards.add(self)

    @contextmanager
    def held(self) -> Iterator[None]:
        """Hold the lock while the body runs."""
        with self._lock:
            yield

    def _renew(self) -> None:
        self.torn |= self._lock.locked()
        self._lock = threading.Lock()


_guards: weakref.WeakSet[Guard] = weakref.WeakSet()


def _renew_all() -> None:
    for guard in tuple(_guards):
        guard._renew()


os.register_at_fork(after_in_child=_renew_all)


class kept(Generic[Value]):
    """A property that is computed when it is first asked for, without a lock.

    The one in functools holds a lock while it computes, before Python 3.12; a child that is forked meanwhile would wait
    for it for ever. Here two threads may both compute the value, and all get that of the first to finish.
    """

    def __init__(self, compute: Callable[[Any], Value]) -> None:
        self._compute = compute
        self.__doc__ = compute.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...
    @overload
    def __get__(self, instance: object, owner: type) -> Value: ...
    def __get__(self, instance: object | None, owner: type) -> Self | Value:
        if instance is None:
            return self
        value: Value = instance.__dict__.setdefault(self._name, self._compute(instance))
        return value
