"""Heeding a raised stop between two pieces of work in Python."""

from __future__ import annotations

from debulk import _core

__all__ = ["heed"]


def heed(stop: _core.Stop | None, what: str) -> None:
    """Raise `Stopped`, naming what was, once the stop is raised."""
    if stop is not None and stop.now():
        raise _core.Stopped(f"{what} was stopped")
