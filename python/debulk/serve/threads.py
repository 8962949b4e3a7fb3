"""Work in a thread that nobody has to wait for: one that hangs, on a dead drive for example, holds up nothing."""

from __future__ import annotations

import asyncio
import contextlib
import threading
from collections.abc import Callable
from typing import Any, TypeVar

Value = TypeVar("Value")


def in_thread(function: Callable[..., Value], *arguments: Any) -> asyncio.Future[Value]:
    """Call a function in a thread of its own; a caller that gives up waiting leaves it to itself.

    `asyncio.to_thread` has a fixed number of threads, all of which must end before the process can.
    """
    loop = asyncio.get_running_loop()
    done: asyncio.Future[Value] = loop.create_future()

    def tell(how: Callable[[Any], None], value: Any) -> None:
        if not done.done():
            how(value)

    def run() -> None:
        try:
            how, value = done.set_result, function(*arguments)
        except BaseException as error:
            how, value = done.set_exception, error  # type: ignore[assignment]
        with contextlib.suppress(RuntimeError):  # the loop may have been closed meanwhile
            loop.call_soon_threadsafe(tell, how, value)

    threading.Thread(target=run, daemon=True).start()
    return done
