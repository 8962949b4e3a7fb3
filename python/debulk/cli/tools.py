"""Commands beside the inspection: what became of it, what is known of the solver, is all well here."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path
from typing import Annotated, Literal

import typer

from debulk.cli.given import Mask, Outputs, Pose, Unit
from debulk.cli.loudness import print_json
from debulk.cli.support import FAULT, JSON, chain_of, check_output, pose_of, show, shown_progress, written


def compare(
    report: Annotated[Path, typer.Argument(help="Report of the inspection before debulking, .json.")],
    scan: Annotated[Path, typer.Argument(help="Cloud of the debulked ply: .npy, .npz, .ply, .pcd, .ptx or text.")],
    reference: Annotated[Path, typer.Option(help="Cloud of what lay there before the ply was draped.")],
    pose: Pose = None,
    recipe: Annotated[Path | None, typer.Option(help="Settings; unset: those of the report.")] = None,
    mask: Mask = None,
    unit: Unit = "mm",
    frame_unit: Annotated[
        Literal["mm", "m"] | None, typer.Option(help="Unit of the pose; unset: that of --unit.")
    ] = None,
    history: Annotated[Path | None, typer.Option(help="The cell's history, .sqlite, to which it is added.")] = None,
    output: Outputs = None,
    as_json: JSON = False,
) -> None:
    """Hold a report against a scan after debulking: measured RMS inside the original outlines, outcomes, hit rate.

    The exit code is 1 where an outcome was wrong (CEASE was predicted of a pocket and CREASE measured, or the reverse),
    or a ridge stands beside the pockets; 0 else, also where a side left some undecided; 2 for bad input.
    """
    from debulk import files
    from debulk.history.kept import history_of
    from debulk.inspection.calls import compare as held_against
    from debulk.recipe import Recipe
    from debulk.report import Report
    from debulk.results import codec
    from debulk.results.comparison import FORMAT
    from debulk.results.comparison_text import table
    from debulk.results.saving import ENDINGS

    for path in output or []:
        check_output(path, *ENDINGS)
    kept_in = history_of(history)
    settings = None if recipe is None else Recipe.load(recipe)
    hidden = None if mask is None else files.load_mask(mask)
    with shown_progress() as progress:
        progress("reading", 0.0)
        before = Report.load(report)
        clouds = files.load_cloud(scan, unit), files.load_cloud(reference, unit)
        transform = pose_of(pose, frame_unit or unit)
        progress("comparing", 0.0)
        found = held_against(before, *clouds, settings, transform, hidden)
        progress("comparing", 1.0)
    named = {"report": report, "scan after debulking": scan, "reference": reference, "recipe": recipe, "mask": mask}
    found = dataclasses.replace(found, source={what: path.name for what, path in named.items() if path})
    if kept_in is not None:
        found = kept_in.keep_comparison(found, before)
    for path in output or []:
        found.save(path)
    if as_json:
        print_json(codec.dumps(found, FORMAT))
    else:
        show(lambda width: table(found, width))
        written(*output or [])
    raise typer.Exit(1 if found.wrong or found.standing else 0)


def repeat(
    report: Annotated[Path, typer.Argument(help="Report of the inspection, .json.")],
    scan: Annotated[Path, typer.Option(help="Its scan.")],
    reference: Annotated[Path, typer.Option(help="Its reference.")],
    mask: Annotated[Path | None, typer.Option(help="Its mask, if it had one.")] = None,
    chain: Annotated[Path | None, typer.Option(help="Its qualified chain, if it had one.")] = None,
    approved: Annotated[Path | None, typer.Option(help="Its file of approved recipes, if it had one.")] = None,
    unit: Annotated[Literal["mm", "m"], typer.Option(help="Unit of both clouds.")] = "mm",
) -> None:
    """Do an inspection again from its report, on the same files by their fingerprints.

    The exit code is 0 where verdict and all figures are the same, 1 where one differs.
    """
    from debulk import files
    from debulk.inspection.repeating import repeat as done_again
    from debulk.report import Report

    first = Report.load(report)
    qualified = chain_of(chain)
    hidden = None if mask is None else files.load_mask(mask)
    with shown_progress() as progress:
        progress("reading", 0.0)
        clouds = files.load_cloud(scan, unit), files.load_cloud(reference, unit)
        found = done_again(first, *clouds, hidden, progress, chain=qualified, approved=approved)
    for name in found.unchecked:
        print(f"warning: the record has no fingerprint of the {name}, only its shape was checked")
    print(f"{found.report.verdict.name}: {found.report.reason}")
    print("the same to the bit" if found.same else f"not the same: {', '.join(found.differences[:10])}")
    raise typer.Exit(0 if found.same else 1)


def view(
    report: Annotated[Path, typer.Argument(help="Report of an inspection, .json.")],
    pocket: Annotated[int | None, typer.Option(help="Only this pocket.")] = None,
    output: Annotated[Path | None, typer.Option("-o", "--output", "--png", help="A .png instead of a window.")] = None,
) -> None:
    """Show the pockets in 3-D, in a window or a picture; needs the extra "view" (Open3D)."""
    from debulk import view as views
    from debulk.report import Report

    check_output(output, ".png")
    views.view(Report.load(report), output, pocket=pocket)
    written(output)


def doctor(as_json: JSON = False) -> None:
    """Show versions, machine and licences, and try a self-test with its certificate."""
    from debulk.doctor import doctor as examined

    found = examined()
    if as_json:
        print_json(found.json())
    else:
        show(found.text)
    raise typer.Exit(0 if found.passed else FAULT)


def completion(shell: Annotated[Literal["bash", "zsh"], typer.Argument(help="Whose script to print.")]) -> None:
    """Print the script by which a shell completes commands, options and files when Tab is pressed.

    For bash, put the first example below into ~/.bashrc; for zsh, the second one's file into a folder of $fpath.
    """
    from typer.completion import get_completion_script  # type: ignore[attr-defined]  # not in any __all__

    print(get_completion_script(prog_name="debulk", complete_var=_COMPLETE, shell=shell).strip())


_COMPLETE = "_DEBULK_COMPLETE"


def answer_shells() -> None:
    """Let Typer answer a shell that asks, by this variable, what may come next."""
    if _COMPLETE in os.environ:
        from typer.completion import completion_init  # type: ignore[attr-defined]

        completion_init()
