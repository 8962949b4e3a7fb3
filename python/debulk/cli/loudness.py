"""How much a command says: the options -q and -v, and JSON that stands alone on stdout."""

from __future__ import annotations

import contextlib
import functools
import inspect
import logging
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Annotated, Any, TextIO, TypeVar, cast

import typer

_QUIET = Annotated[bool, typer.Option("-q", "--quiet", help="Print errors only; the exit code tells the outcome.")]
_VERBOSE = Annotated[bool, typer.Option("-v", "--verbose", help="Tell on stderr what is done and how long it takes.")]

Command = TypeVar("Command", bound=Callable[..., Any])


@dataclass(frozen=True)
class Loudness:
    """How much a command says."""

    quiet: bool = False
    verbose: bool = False
    stdout: TextIO = field(default_factory=lambda: sys.stdout)  # where --json goes even where the command is quiet


_running: ContextVar[Loudness] = ContextVar("loudness")


def loudness() -> Loudness:
    """Return how much the running command says."""
    return _running.get(Loudness())


def with_loudness(function: Command) -> Command:
    """Give a command the options -q and -v."""

    @functools.wraps(function)
    def command(*args: Any, quiet: bool = False, verbose: bool = False, **kwargs: Any) -> Any:
        with _said(quiet, verbose):
            return function(*args, **kwargs)

    added = {"quiet": _QUIET, "verbose": _VERBOSE}
    own = inspect.signature(function, eval_str=True)
    keyword = inspect.Parameter.KEYWORD_ONLY
    options = [inspect.Parameter(name, keyword, default=False, annotation=what) for name, what in added.items()]
    command.__signature__ = own.replace(parameters=[*own.parameters.values(), *options])  # type: ignore[attr-defined]
    command.__annotations__ = {**function.__annotations__, **added}
    return cast(Command, command)


@contextmanager
def _said(quiet: bool, verbose: bool) -> Iterator[None]:
    """Say nothing on stdout while a command runs quietly, and what is logged on stderr while it is verbose."""
    log, handler = logging.getLogger("debulk"), logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(relativeCreated)6.0f ms  %(message)s"))
    token, level = _running.set(Loudness(quiet, verbose)), log.level
    with contextlib.ExitStack() as ended:
        ended.callback(_running.reset, token)
        if quiet:
            ended.enter_context(
                contextlib.redirect_stdout(ended.enter_context(open(os.devnull, "w", encoding="utf-8")))
            )
        if verbose:
            log.addHandler(handler)
            log.setLevel(logging.DEBUG)
            ended.callback(log.setLevel, level)
            ended.callback(log.removeHandler, handler)
        yield


def print_json(text: str) -> None:
    """Print what --json promises: alone on stdout, even where the command is quiet."""
    stdout = loudness().stdout
    stdout.write(text.rstrip("\n") + "\n")
    stdout.flush()
