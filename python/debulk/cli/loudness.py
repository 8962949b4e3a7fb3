"""What a command's function becomes: its groups of options are spread out, and it gets -q and -v.

With --json, what it prints stands alone on stdout.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import inspect
import json
import logging
import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Annotated, Any, TextIO, TypeVar, cast, get_type_hints

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
    """Give a command the options -q and -v; a parameter that is a dataclass stands for its fields as options."""
    own = inspect.signature(function, eval_str=True).parameters.values()
    groups: dict[str, Any] = {one.name: one.annotation for one in own if dataclasses.is_dataclass(one.annotation)}

    @functools.wraps(function)
    def command(*args: Any, quiet: bool = False, verbose: bool = False, **kwargs: Any) -> Any:
        for name, kind in groups.items():
            kwargs[name] = kind(**{entry.name: kwargs.pop(entry.name) for entry in dataclasses.fields(kind)})
        with _said(quiet, verbose):
            return function(*args, **kwargs)

    options = [option for one in own for option in (_fields(groups[one.name]) if one.name in groups else [one])]
    options += [_option("quiet", _QUIET, False), _option("verbose", _VERBOSE, False)]
    keywords = [option.replace(kind=inspect.Parameter.KEYWORD_ONLY) for option in options]  # as Typer passes them
    command.__signature__ = inspect.Signature(keywords)  # type: ignore[attr-defined]
    command.__annotations__ = {option.name: option.annotation for option in keywords}
    return cast(Command, command)


def _fields(kind: Any) -> list[inspect.Parameter]:
    hints = get_type_hints(kind, include_extras=True)
    return [_option(entry.name, hints[entry.name], entry.default) for entry in dataclasses.fields(kind)]


def _option(name: str, annotation: Any, default: Any) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


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
    try:
        text.encode(stdout.encoding)
    except UnicodeEncodeError:  # by the escapes of JSON, not by those of the stream
        text = re.sub(r"[^\x00-\x7f]", lambda one: json.dumps(one[0])[1:-1], text)
    stdout.write(text.rstrip("\n") + "\n")
    stdout.flush()
