"""Checks of a stop between two pieces of work in Python."""

from __future__ import annotations

from debulk import _core


def heed(stop: _core.Stop | None, what: str) -> None:
    """Raise `Stopped`, with `what` in its message, if the stop is raised or its deadline has passed."""
    if stop is not None and stop.now():
        raise _core.Stopped(f"{what} was stopped")
