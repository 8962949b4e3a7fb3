"""The command line.

Exit codes of `inspect`: 0 CEASE, 1 CREASE, 2 bad input, 3 INVALID, 4 UNDECIDED. The other commands end with 0 or 2,
`demo` with 3 where its scan cannot be judged, `compare` with 1 where an outcome was wrong, `repeat` and `diff` with 1
where something differs, `history check` with 1 where a record was changed, `batch` with 1 where a layup has no
report. Of all: 70 is a fault of debulk's, 130 an interrupt or SIGTERM, 141 a pipe that nobody reads.
"""

from __future__ import annotations

import io
import os
import signal
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from debulk import InputError, __version__
from debulk.cli import batch as cli_batch
from debulk.cli import history as cli_history
from debulk.cli import pages, qualifying, scanning, serving
from debulk.cli import tools as cli_tools
from debulk.cli.command import command
from debulk.cli.examples import epilog
from debulk.cli.given import Approved, ChainFile, Given, Outputs, size_of
from debulk.cli.loudness import print_json
from debulk.cli.support import (
    DETAILS,
    EXIT_CODES,
    INTERRUPTED,
    JSON,
    chain_of,
    check_output,
    interrupt,
    interrupts,
    make_folder,
    outcome,
    show,
    shown_progress,
    written,
)
from debulk.report import Report
from debulk.results import codec
from debulk.results.report import FORMAT
from debulk.results.saving import ENDINGS
from debulk.verdict import Verdict

if TYPE_CHECKING:
    from debulk.recipe import Recipe
    from debulk.scenes import Layup

app = typer.Typer(
    help="Will it crease or cease? Predicts which air pockets under a draped prepreg ply survive vacuum debulking.",
    epilog=epilog(""),
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def main() -> None:
    """Run the command line; SIGTERM ends a command as an interrupt does, so that it leaves no half file behind."""
    _open_streams()
    cli_tools.answer_shells()
    for number in (signal.SIGINT, signal.SIGTERM):
        if signal.getsignal(number) is not signal.SIG_IGN:  # as for a program behind nohup
            signal.signal(number, interrupt)
    try:
        with outcome():
            try:
                app(prog_name="debulk")
            finally:
                sys.stdout.flush()  # not as Python does at its end, with an exit code of its own
    except typer.Exit as end:
        sys.exit(end.exit_code)
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):  # all is done: Python's own end may be cut short
            signal.signal(number, signal.SIG_DFL)
        if interrupts:  # also where a library took the interrupt for a fault, or lost it
            sys.exit(INTERRUPTED)


def _open_streams() -> None:
    """Give the streams that the command was started without, as by a scheduler, an end that takes everything.

    Otherwise the next file that is opened would get the number of such a stream.
    """
    for name in ("stdin", "stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, open(os.devnull, "r" if name == "stdin" else "w", encoding="utf-8"))  # noqa: SIM115
    if isinstance(sys.stdout, io.TextIOWrapper) and sys.stdout.errors == "strict":
        sys.stdout.reconfigure(errors="backslashreplace")  # a character that the locale lacks costs no verdict


@app.callback(invoke_without_command=True)
def _options(
    version: Annotated[bool, typer.Option("--version", help="Print the version and leave.", is_eager=True)] = False,
) -> None:
    if version:
        print(f"debulk {__version__}")
        raise typer.Exit


@command(app, "inspect")
def inspect(
    scan: Annotated[Path, typer.Argument(help="Cloud of the draped ply: .npy, .npz, .ply, .pcd, .ptx or text.")],
    reference: Annotated[Path, typer.Option(help="Cloud of what lay there before this ply was draped.")],
    given: Given,
    measured_angles: Annotated[
        Path | None,
        typer.Option(
            help="Fibre angles that a sensor saw on this ply, CSV x,y,first,second; then --angles is nominal."
        ),
    ] = None,
    chain: ChainFile = None,
    deadline: Annotated[float | None, typer.Option(help="Seconds after which the inspection ends.")] = None,
    context: Annotated[
        list[str] | None, typer.Option(help="Kept in the report: part=A-17, ply=3 and the like; repeatable.")
    ] = None,
    history: Annotated[Path | None, typer.Option(help="The cell's history, .sqlite, to which it is added.")] = None,
    approved: Approved = None,
    output: Outputs = None,
    details: DETAILS = False,
    as_json: JSON = False,
) -> None:
    """Inspect a scan: find its air pockets and predict which of them survive debulking."""
    outputs = output or []
    for path in outputs:
        check_output(path, *ENDINGS)
    kept = dict(_named(text) for text in context or [])
    if deadline is not None and not 0 < deadline < float("inf"):
        raise InputError(f"--deadline: expected a positive number of seconds, got {deadline:g}")

    from debulk.files import load_angles
    from debulk.files.clouds import read_cloud
    from debulk.history.kept import history_of

    kept_in, settings, qualified = history_of(history), given.read(), chain_of(chain)
    measured = None if measured_angles is None else load_angles(measured_angles, given.in_frame)
    with shown_progress() as progress:
        progress("reading", 0.0)
        reference_cloud = read_cloud(reference, given.unit)
        progress("reading", 0.5)
        scan_cloud = read_cloud(scan, given.unit)
        progress("reading", 1.0)

        from debulk.inspection.inspector import Inspector

        inspector = Inspector(
            reference=reference_cloud.values, progress=progress, approved=approved, chain=qualified, **settings
        )
        report = inspector.inspect(
            scan_cloud.values, deadline, progress, context=kept, fibre_angles_deg=measured
        ).settle()
    read = ((scan.name, scan_cloud), (reference.name, reference_cloud))
    notes = [f"{name}: {note}" for name, cloud in read for note in cloud.notes]
    source = {"scan": scan.name, "reference": reference.name, **report.source}
    if given.recipe is not None:
        source["recipe"] = given.recipe.name
    report = report.changed(source=source, warnings=(*notes, *report.warnings))
    if kept_in is not None:
        report = kept_in.keep(report)
    _leave(report, outputs, details, as_json)
    raise typer.Exit(EXIT_CODES[report.verdict])


@command(app, "demo")
def demo(
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the report.")] = Path("debulk-demo"),
    seed: Annotated[int, typer.Option(min=0, help="Of the virtual layup.")] = 0,
    pixels: Annotated[str, typer.Option(help="Width x height of the virtual scanner's image.")] = "1280x960",
    fringes: Annotated[
        bool, typer.Option("--fringes", help="Render the images of two cameras and a projector, and scan those.")
    ] = False,
    keep_files: Annotated[bool, typer.Option("--keep-files", help="Also leave what `debulk inspect` needs.")] = False,
    details: DETAILS = False,
) -> None:
    """Inspect a virtual layup with 14 air pockets and leave report.html, .json and .csv behind.

    Some of its pockets crease; the exit code is 0 nevertheless, unless the scan cannot be judged.
    """
    size = size_of(pixels, "--pixels", "WIDTHxHEIGHT like 1280x960")
    make_folder(output)

    from debulk.recipe import Recipe

    recipe = Recipe()
    with shown_progress() as progress:
        progress("making the layup", 0.0)
        from debulk.inspection.inspector import Inspector
        from debulk.scenes import layup

        scene = layup(seed=seed, pixels=size)
        progress("making the layup", 1.0)
        if fringes:
            scene = scanning.scanned(scene, size, progress)
        inspector = Inspector(
            recipe,
            scene.reference,
            ply_outline=scene.ply_outline,
            fibre_angles_deg=(0, 90),
            mold_from_scanner=scene.mold_from_scanner,
            camera=scene.camera,
            progress=progress,
        )
        context = {"part": "virtual layup", "seed": seed}
        report = inspector.inspect(scene.scan, progress=progress, context=context).settle()
    from debulk.results.report_text import fold

    source = {
        "scan": f"virtual layup, seed {seed}, {size[0]} x {size[1]} pixels"
        + (", from fringe images" if fringes else ""),
        "what this shows": _shown_by_demo(scene, report),
    }
    report = report.changed(source=source | report.source)
    show(lambda width: fold(source["what this shows"], width))
    if keep_files:
        _keep_files(output, scene, recipe)
    _leave(report, [output / f"report.{kind}" for kind in ("html", "json", "csv")], details)
    raise typer.Exit(EXIT_CODES[Verdict.INVALID] if report.verdict is Verdict.INVALID else 0)


@command(app, "recipe", loudness=False)
def recipe() -> None:
    """Print the default recipe, every setting with a comment."""
    from debulk.recipe import Recipe

    print(Recipe().to_toml(), end="")


@command(app, "approve")
def approve(
    recipe: Annotated[Path, typer.Argument(help="The recipe, .toml.")],
    approved: Annotated[Path, typer.Option("--in", help="Approved recipes, .toml; made if it is not there.")],
    by: Annotated[str, typer.Option(help="Who approves.")],
) -> None:
    """Add a recipe to a file of approved ones, with name, time and hash; `debulk inspect --approved` asks for it."""
    from debulk.recipe import Recipe
    from debulk.results.approval import approve as approved_by
    from debulk.results.trace import now_utc

    check_output(approved)
    new = approved_by(approved, Recipe.load(recipe).model_dump(), by, now_utc())
    print(f"{approved}: recipe {new.recipe_sha256} approved by {new.name}, {new.time_utc}")


for function in (
    pages.page,
    pages.rework,
    pages.diff,
    pages.checks,
    qualifying.qualify,
    serving.serve,
    cli_tools.compare,
    cli_tools.repeat,
    cli_tools.view,
    cli_tools.doctor,
):
    command(app, function.__name__)(function)
command(app, "completion", loudness=False)(cli_tools.completion)
app.add_typer(scanning.app, name="scan")
command(app, "calibrate")(cli_history.calibrate)
app.add_typer(cli_history.app, name="history")
command(app, "batch")(cli_batch.batch)


def _shown_by_demo(scene: Layup, report: Report) -> str:
    """Say what the virtual layup is, and why more or fewer pockets may be found than it has."""
    truth, promoted = scene.truth, sum(bool(pocket.promoted) for pocket in report.pockets)
    return (
        f"a virtual ply with {len(truth.pockets)} air pockets and {len(truth.decoys)} bumps below the tolerances; "
        f"{len(report.pockets)} places are judged, {promoted} of them bumps that could crease nevertheless"
    )


def _leave(report: Report, outputs: list[Path], details: bool = False, as_json: bool = False) -> None:
    """Write the files, then print: whoever reads that may leave early. The verdict comes first and last."""
    for path in outputs:
        report.save(path)
    if as_json:
        print_json(codec.dumps(report, FORMAT))
        return
    from debulk.results.report_text import headline, summary, table

    show(lambda width: (table if details else summary)(report, width))
    written(*outputs)
    if details:
        show(lambda width: headline(report, width))


def _keep_files(folder: Path, scene: Any, recipe: Recipe) -> None:
    """Write the virtual layup as a robot cell would, and say how to inspect it."""
    from debulk.files import save_cloud
    from debulk.files.replacing import write_text

    save_cloud(folder / "scan.pcd", scene.scan)
    save_cloud(folder / "reference.pcd", scene.reference)
    pose = "\n".join(" ".join(repr(float(value)) for value in row) for row in scene.mold_from_scanner)
    outline = "x,y\n" + "\n".join(f"{float(x)!r},{float(y)!r}" for x, y in scene.ply_outline)
    for name, text in {"pose.txt": pose, "outline.csv": outline, "recipe.toml": recipe.to_toml()}.items():
        write_text(folder / name, text.rstrip("\n") + "\n")
    print(
        f"try: debulk inspect {folder}/scan.pcd --reference {folder}/reference.pcd --recipe {folder}/recipe.toml "
        f"--pose {folder}/pose.txt --outline {folder}/outline.csv -o out.html"
    )


def _named(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise InputError(f"--context: expected NAME=VALUE like part=A-17, got {text!r}")
    return name, value
