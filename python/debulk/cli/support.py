"""What every command of the command line shares: exit codes, how a command ends, and the progress it shows."""

from __future__ import annotations

import contextlib
import errno
import os
import signal
import sys
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
import typer
from numpy.typing import NDArray

from debulk import InputError
from debulk.cli.loudness import loudness
from debulk.verdict import Verdict

if TYPE_CHECKING:
    from debulk.chain import Chain

EXIT_CODES = {Verdict.CEASE: 0, Verdict.CREASE: 1, Verdict.INVALID: 3, Verdict.UNDECIDED: 4}
BAD_INPUT, FAULT, INTERRUPTED, NO_READER = 2, 70, 130, 141
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)

POSE_HELP = (
    "4x4 matrix, x_mold = T x_scanner, as text, JSON, YAML or XML; or the word identity, where the files are in the "
    "mold's frame already."
)

JSON = Annotated[bool, typer.Option("--json", help="Print JSON on stdout, and nothing else.")]

DETAILS = Annotated[
    bool, typer.Option("--details", help="Print every pocket and all that was left out, not only what to do.")
]

Progress = Callable[[str, float], None]

interrupts: list[int] = []  # the signals that ended this command


def interrupt(number: int, _frame: object) -> None:
    """Say what is ended, past any stream that was just being written to, and end it."""
    os.write(2, f"{' '.join(['debulk', *sys.argv[1:2]])}: ended by {signal.Signals(number).name}\n".encode())
    interrupts.append(number)
    raise KeyboardInterrupt


@contextmanager
def outcome() -> Iterator[None]:
    """Turn whatever ends a command into its exit code; a verdict's codes are never taken by a failure."""
    try:
        yield
        sys.stdout.flush()
    except InputError as error:
        print("debulk:", _one_line(str(error)), file=sys.stderr)
        raise typer.Exit(BAD_INPUT) from None
    except KeyboardInterrupt:
        raise typer.Exit(INTERRUPTED) from None
    except BrokenPipeError:  # whoever read our output has left
        _forget_output()
        raise typer.Exit(NO_READER) from None
    except MemoryError:
        print(
            "debulk: it does not fit into the memory of this machine; end other programs, or give this one more",
            file=sys.stderr,
        )
        raise typer.Exit(BAD_INPUT) from None
    except (typer.Exit, typer.Abort):
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.errno in _NO_ROOM:
            _forget_output()
            print(f"debulk: {error.filename or 'the output'}: cannot be written: {error.strerror}", file=sys.stderr)
            raise typer.Exit(BAD_INPUT) from None
        if interrupts:  # which a library took for a fault, as Python 3.11 does where a class is just being made
            raise typer.Exit(INTERRUPTED) from None
        traceback.print_exc()
        print("debulk: this is a fault of debulk's; please report it", file=sys.stderr)
        raise typer.Exit(FAULT) from None


def _forget_output() -> None:
    """Send what is left of stdout nowhere, so that Python does not complain when it flushes at its end."""
    with contextlib.suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), loudness().stdout.fileno())


def _one_line(message: str) -> str:
    """Join the lines of a message: entries by semicolons, after a colon by a blank."""
    first, *rest = (line.strip() for line in message.splitlines())
    return f"{first} {'; '.join(rest)}" if first.endswith(":") else "; ".join([first, *rest])


@contextmanager
def shown_progress() -> Iterator[Progress]:
    """Show a bar for each stage on a terminal's stderr; elsewhere nothing."""
    from rich.console import Console
    from rich.progress import BarColumn, TaskID, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bars

    console, said = Console(stderr=True), loudness()
    columns = (
        TextColumn("{task.description:<20}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeElapsedColumn(),
    )
    hidden = said.quiet or said.verbose or not console.is_terminal  # a log line would break the bar
    with Bars(*columns, console=console, transient=True, disable=hidden) as bars:
        stages: dict[str, TaskID] = {}
        furthest: dict[str, float] = {}

        def report_progress(stage: str, fraction: float) -> None:
            if stage not in stages:
                for name, done in stages.items():
                    furthest[name] = 1.0
                    bars.update(done, completed=1.0)
                stages[stage] = bars.add_task(stage, total=1.0)
            furthest[stage] = max(furthest.get(stage, 0.0), min(fraction, 1.0))  # a bar never falls back
            bars.update(stages[stage], completed=furthest[stage])

        yield report_progress


def show(text: Callable[[int], str]) -> None:
    """Print a text folded to a terminal's width, verdicts in colour; elsewhere plain, to a page's width."""
    from rich.console import Console
    from rich.text import Text

    console = Console(highlight=False)
    if not console.is_terminal:
        print(text(_WIDTH))
        return
    styles = {v.name: f"bold {style}" for v, style in _STYLES.items()}
    for line in text(console.width).splitlines():
        styled = Text(line)  # a reason's brackets are no markup
        for name, style in styles.items():
            styled.highlight_words([name], style)
        console.print(styled, soft_wrap=True)


_WIDTH = 100
_STYLES = {Verdict.CEASE: "green", Verdict.CREASE: "red", Verdict.UNDECIDED: "yellow", Verdict.INVALID: "magenta"}


def written(*paths: Path | None) -> None:
    """Print which files were written; None: none was."""
    for path in filter(None, paths):
        print(f"written: {path}")


def pose_of(pose: Path | None, unit: Literal["mm", "m"]) -> NDArray[np.float64] | None:
    """Read the option --pose."""
    from debulk import files

    if pose is None:
        return None
    return np.eye(4) if str(pose) == "identity" else files.load_pose(pose, unit)


def chain_of(path: Path | None) -> Chain | None:
    """Read the option --chain."""
    if path is None:
        return None
    from debulk.chain import Chain

    return Chain.load(path)


def make_folder(path: Path) -> None:
    """Make a folder for outputs, if it is not there."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: cannot be made: {error.strerror or error}") from None


def check_output(path: Path | None, *endings: str) -> None:
    """Refuse an output, if need be also for its ending, before the work is done, not after; None: there is none."""
    from debulk.files.replacing import check_ending

    if path is None:
        return
    if endings:
        check_ending(path, *endings)
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no folder {path.parent}")
    if path.is_dir() or not os.access(path.parent, os.W_OK):
        raise InputError(f"{path}: cannot be written")
