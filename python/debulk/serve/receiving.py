"""A scan that is sent: written to a file while it arrives, bounded in size and in patience."""

from __future__ import annotations

import asyncio
import contextlib
import errno
import os
import tempfile
from collections.abc import AsyncIterator
from pathlib import Path

from starlette.requests import ClientDisconnect, Request

from debulk.serve.refusal import Refusal

_SILENCE_S = 20.0  # a client that sends nothing for so long is given up
_REFUSED_S = 60.0  # for which a client that was refused may go on
_AT_ONCE = 1 << 20  # bytes written together: a write for each packet would take longer than the network


async def received(request: Request, folder: Path, name: str, most_bytes: int) -> Path:
    """Write the body of a request to a new file in a folder, which keeps the name's ending; refused, it is gone."""
    _check_length(request, most_bytes)
    parts = _parts(request, most_bytes)
    number, path = tempfile.mkstemp(prefix="scan-", suffix=f"-{name}", dir=folder)
    try:
        with open(number, "wb", buffering=0) as file:
            if not await _copied(parts, file.fileno()):
                raise Refusal(400, "the request has no body: expected a scan")
    except BaseException as error:
        os.unlink(path)
        if isinstance(error, OSError) and error.errno in (errno.ENOSPC, errno.EFBIG, errno.EDQUOT):
            raise Refusal(507, f"no room for the scan: {error.strerror}; free some, or send a path", 5) from None
        raise
    return Path(path)


async def received_json(request: Request, most_bytes: int) -> bytes:
    """Return a small body; refuse one that is too large, or does not go on."""
    _check_length(request, most_bytes)
    return b"".join([part async for part in _parts(request, most_bytes)])


async def passed_over(request: Request, most_bytes: int) -> None:
    """Read what is left of a refused request, and keep nothing: a client that still sends would not see the answer."""
    if "expect" in request.headers:  # it sends nothing before it is asked to
        return
    with contextlib.suppress(Refusal, TimeoutError, RuntimeError):  # RuntimeError: all was read before
        _check_length(request, most_bytes)
        async with asyncio.timeout(_REFUSED_S):
            async for _ in _parts(request, most_bytes):
                pass


async def _copied(parts: AsyncIterator[bytes], file: int) -> bool:
    """Write all parts to a file, and return whether there were any."""
    held, some = bytearray(), False
    async for part in parts:
        held += part
        some = True
        if len(held) >= _AT_ONCE:
            await asyncio.to_thread(_write, file, bytes(held))
            held.clear()
    await asyncio.to_thread(_write, file, bytes(held))
    return some


def _write(file: int, data: bytes) -> None:
    left = memoryview(data)
    while left:
        left = left[os.write(file, left) :]


async def _parts(request: Request, most_bytes: int) -> AsyncIterator[bytes]:
    parts, size = request.stream(), 0
    try:
        while True:
            async with asyncio.timeout(_SILENCE_S):
                part = await anext(parts)
            size += len(part)
            _check_size(size, most_bytes)
            if part:
                yield part
    except StopAsyncIteration:
        return
    except TimeoutError:
        raise Refusal(408, f"nothing came for {_SILENCE_S:.0f} s") from None
    except ClientDisconnect:
        raise Refusal(400, "the client has left before all had come") from None


def _check_length(request: Request, most_bytes: int) -> None:
    length = request.headers.get("content-length", "0")
    if length.isdecimal():
        _check_size(int(length[:20]), most_bytes)


def _check_size(size: int, most_bytes: int) -> None:
    if size > most_bytes:
        most = f"at most {most_bytes / 1e6:.4g} MB are taken"
        raise Refusal(413, f"the body is too large: {most} (--most-mb is the limit of a scan)")
