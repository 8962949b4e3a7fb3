"""How a function becomes a command: with its examples, its exit codes, and -q and -v."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import typer

from debulk.cli.examples import epilog
from debulk.cli.loudness import with_loudness
from debulk.cli.support import outcome

Function = TypeVar("Function", bound=Callable[..., Any])


def command(app: typer.Typer, path: str, *, loudness: bool = True) -> Callable[[Function], Function]:
    """Make a function the command of this path, such as "history list"; without `loudness` it has neither -q nor -v."""

    def made(function: Function) -> Function:
        ended = outcome()(function)
        app.command(path.split()[-1], epilog=epilog(path))(with_loudness(ended) if loudness else ended)
        return function

    return made
