"""The command that makes pages of reports that are there already."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated
from urllib.parse import quote

import typer

from debulk import InputError
from debulk.cli.loudness import print_json
from debulk.cli.support import JSON, check_output, show, written
from debulk.rework import Handling


def page(
    reports: Annotated[list[Path], typer.Argument(help="Reports, .json; several: the plies of a stack.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="The page, .html.")],
    compare: Annotated[bool, typer.Option("--compare", help="Two reports side by side: what differs.")] = False,
) -> None:
    """Make the page of a report, or one page of the reports of a stack: the worst plies first, then ply by ply.

    The plies stand in the order of their numbers where each report has one (debulk inspect --context ply=3), otherwise
    in the order given. Where a report's own page lies beside it under the same name, it is linked.
    """
    check_output(output, ".html")

    from debulk.files.replacing import write_text
    from debulk.page.difference import page as difference_page
    from debulk.page.stack import Layup
    from debulk.page.stack import page as stack_page
    from debulk.report import Report

    if compare and len(reports) != 2:
        raise InputError(f"--compare: expected two reports, got {len(reports)}")
    found = [Report.load(path) for path in reports]
    if len(found) == 1:
        found[0].save(output)
    else:
        if compare:
            html = difference_page(found[0], found[1], (reports[0].name, reports[1].name))
        else:
            named = zip(found, reports, strict=True)
            html = stack_page([Layup(one, path.name, _own_page(path, output)) for one, path in named])
        write_text(output, html)
    written(output)


def rework(
    report: Annotated[Path, typer.Argument(help="Report of an inspection, .json.")],
    hold: Annotated[float, typer.Option(help="Force along the ply that hand or gripper holds, N.")] = Handling.hold_n,
    stick: Annotated[
        float, typer.Option(help="Shear stress at which the flat ply slides, MPa, beside its weight's friction.")
    ] = Handling.stick_mpa,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="The plan for a robot, .json.")] = None,
    as_json: JSON = False,
) -> None:
    """Say how the length leaves that would become ridges: how much, along which fibres, towards which edge."""
    check_output(output, ".json")

    from debulk.report import Report
    from debulk.results.report_text import fold

    planned = Report.load(report).rework(Handling(hold, stick))
    if output is not None:
        from debulk.files.replacing import write_text

        write_text(output, planned.to_json())
    if as_json:
        print_json(planned.to_json())
    else:
        show(lambda width: "\n".join(fold(line, width) for line in str(planned).splitlines()))
        written(output)


def diff(
    first: Annotated[Path, typer.Argument(help="A report, .json, or a recipe, .toml.")],
    second: Annotated[Path, typer.Argument(help="Another one of the same kind.")],
) -> None:
    """Show what differs between two reports, or between two recipes: verdicts, places, ridges and settings.

    The exit code is 0 where nothing differs, 1 where something does, 2 for bad input.
    """
    from debulk.results.difference import recipe_difference, report_difference

    kinds = {path.suffix.lower() for path in (first, second)}
    if kinds == {".toml"}:
        from debulk.recipe import Recipe

        lines = recipe_difference(*(Recipe.load(path).model_dump() for path in (first, second)))
    elif kinds == {".json"}:
        from debulk.report import Report

        lines = report_difference(*(Report.load(path) for path in (first, second)))
    else:
        raise InputError(f"{first}, {second}: expected two reports (.json) or two recipes (.toml)")
    of_reports = "verdicts, places, ridges and " if kinds == {".json"} else ""
    print("\n".join(lines) if lines else f"the same {of_reports}settings")
    raise typer.Exit(1 if lines else 0)


def checks(
    name: Annotated[str | None, typer.Argument(help="Name of a check, as in a report; unset: all.")] = None,
) -> None:
    """Say what each check of an inspection looks at, its limit, and what to do about its findings."""
    from debulk.results.check_texts import CHECK_TEXTS
    from debulk.results.report_text import fold

    chosen = [check for check in CHECK_TEXTS if name in (None, check.name)]
    if not chosen:
        raise InputError(f"{name}: expected the name of a check: {', '.join(check.name for check in CHECK_TEXTS)}")
    for check in chosen:
        verdicts = " or ".join(one.name for one in check.at_best if one is not None) or "only mentioned"
        lines = [f"{check.name}: {check.title} ({verdicts})", f"  looks at: {check.sees}"]
        lines += [f"  limit: {check.limit}", f"  do: {check.remedy}"]
        show(lambda width, lines=lines: "\n".join(fold(line, width) for line in lines))  # type: ignore[misc]


def _own_page(report: Path, output: Path) -> str:
    """Return the link from the new page to the report's own, or nothing."""
    own = report.with_suffix(".html")
    if not own.is_file() or own.resolve() == output.resolve():
        return ""
    return quote(Path(os.path.relpath(own.resolve(), output.resolve().parent)).as_posix())
