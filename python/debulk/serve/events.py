"""Server-sent events: the state whenever it changes, and a sign of life between."""

from __future__ import annotations

import asyncio
import contextlib
import json

from starlette.types import Receive, Scope, Send

from debulk.serve.service import Service
from debulk.serve.state import overview

BEAT_S = 2.0
"""Seconds between signs of life; a page that has heard nothing for three of them says so."""
MOST_LISTENERS = 20
_APART_S = 0.1  # between events: many changes at once are one
_PATIENCE_S = 10.0  # a reader that does not take an event for so long is left


class Events:
    """The stream of events, as an ASGI application; nothing is kept for a reader but the state of the moment."""

    def __init__(self, service: Service) -> None:
        self.service = service
        self.listeners = 0

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Send events until the reader leaves or hangs."""
        if scope["method"] != "GET" or self.listeners >= MOST_LISTENERS:
            status = 405 if scope["method"] != "GET" else 503
            await send({"type": "http.response.start", "status": status, "headers": [(b"retry-after", b"5")]})
            await send({"type": "http.response.body", "body": b""})
            return
        self.listeners += 1
        left = asyncio.ensure_future(_left(receive))
        try:
            with contextlib.suppress(TimeoutError, OSError):
                await self._told(send, left)
        finally:
            left.cancel()
            self.listeners -= 1

    async def _told(self, send: Send, left: asyncio.Task[None]) -> None:
        headers = [(b"content-type", b"text/event-stream"), (b"cache-control", b"no-store")]
        await _sent(send, {"type": "http.response.start", "status": 200, "headers": headers})
        while not left.done():
            change = asyncio.ensure_future(self.service.changed.wait())  # of this moment, before the state is read
            event = f"retry: 1000\ndata: {json.dumps(overview(self.service), ensure_ascii=False)}\n\n"
            await _sent(send, {"type": "http.response.body", "body": event.encode(), "more_body": True})
            await asyncio.wait([change, left], timeout=BEAT_S, return_when=asyncio.FIRST_COMPLETED)
            change.cancel()
            await asyncio.sleep(_APART_S)


async def _left(receive: Receive) -> None:
    while (await receive())["type"] != "http.disconnect":
        pass


async def _sent(send: Send, message: dict[str, object]) -> None:
    async with asyncio.timeout(_PATIENCE_S):
        await send(message)
