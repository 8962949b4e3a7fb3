"""Runs the service until it is asked to end."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import socket
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import uvicorn

from debulk import InputError
from debulk.serve.service import Service
from debulk.serve.web import application

_CONNECTIONS = 100  # more are answered by 503
_END_S = 3  # what open connections get at the end


class _Server(uvicorn.Server):
    """A server whose end by a signal is an end like any other: what is open is closed, what is temporary is removed."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Have SIGINT and SIGTERM end the server."""
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, self.handle_exit, number, None)
        yield


def serve(
    service: Callable[[], Service],
    host: str,
    port: int,
    spool: Path | None,
    most_bytes: int,
    ready: Callable[[str], None],
    opcua: tuple[str, Path] | None = None,
) -> int:
    """Serve until SIGINT or SIGTERM; return the number of scans that were accepted and have no result.

    `service` makes the service within the event loop. `ready` is called with the address once it is listened to; port 0
    is any that is free. Scans that are sent lie in the folder `spool`, None: the system's for temporary files; larger
    ones than `most_bytes` are refused. `opcua` is where the OPC UA server listens, with the standard's nodeset; None:
    there is none.
    """
    if spool is not None and not spool.is_dir():
        raise InputError(f"--spool: there is no folder {spool}")
    try:
        bound = socket.create_server((host, port), backlog=64)
    except (OSError, OverflowError) as error:
        raise InputError(f"--host {host} --port {port}: cannot be listened to: {error}") from None
    with bound, tempfile.TemporaryDirectory(prefix="debulk-serve-", dir=spool) as folder:
        address = f"http://{host}:{bound.getsockname()[1]}/"
        return asyncio.run(_served(service, bound, Path(folder), most_bytes, address, ready, opcua))


async def _served(
    service: Callable[[], Service],
    bound: socket.socket,
    folder: Path,
    most_bytes: int,
    address: str,
    ready: Callable[[str], None],
    opcua: tuple[str, Path] | None,
) -> int:
    made = service()
    hosts = sorted({"localhost", "127.0.0.1", "[::1]", bound.getsockname()[0]})
    settings = uvicorn.Config(
        application(made, folder, most_bytes, hosts),
        log_level="warning",
        access_log=False,
        server_header=False,
        limit_concurrency=_CONNECTIONS,
        timeout_graceful_shutdown=_END_S,
    )
    async with contextlib.AsyncExitStack() as ended:
        if opcua is not None:
            from debulk.serve.opcua.server import MachineVision

            vision = MachineVision(made, opcua[1], opcua[0])
            await vision.start()
            ended.push_async_callback(vision.stop)
        work = asyncio.ensure_future(made.work())
        ended.push_async_callback(_ended, work)
        server = _Server(settings)
        # Without the work no scan would be inspected, so the server ends with it.
        work.add_done_callback(lambda _: server.handle_exit(signal.SIGTERM, None))
        ready(address)
        await server.serve(sockets=[bound])
        if work.done():
            await work
        return made.waiting + (made.running is not None)


async def _ended(work: asyncio.Task[None]) -> None:
    work.cancel()
    await asyncio.gather(work, return_exceptions=True)
