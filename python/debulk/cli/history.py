"""The commands of a history: search it, add to it, check it, and see it as a page."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from debulk import InputError
from debulk.cli.command import command
from debulk.cli.examples import epilog
from debulk.cli.given import numbers_of
from debulk.cli.loudness import print_json
from debulk.cli.support import JSON, check_output, show, shown_progress, written

if TYPE_CHECKING:
    from debulk.history import Search

app = typer.Typer(
    help="Search the history of a cell, add to it, check it, and see it as a page.",
    epilog=epilog("history"),
    no_args_is_help=True,
)
File = Annotated[Path, typer.Argument(help="The history, .sqlite.")]


@dataclass(frozen=True)
class Wanted:
    """Which layups a command is about."""

    part: Annotated[str | None, typer.Option(help="Only this part (context part=...).")] = None
    ply: Annotated[str | None, typer.Option(help="Only this ply (context ply=...).")] = None
    verdict: Annotated[str | None, typer.Option(help="Only layups of this verdict.")] = None
    check: Annotated[str | None, typer.Option(help="Only layups that this check kept from CEASE.")] = None
    near: Annotated[str | None, typer.Option(help="Only layups with a pocket near x,y, mold mm.")] = None
    within: Annotated[float, typer.Option(help="How near, mm.")] = 50.0
    since: Annotated[str | None, typer.Option(help="Not before this time, like 2026-03-01T06.")] = None
    until: Annotated[str | None, typer.Option(help="Not after this time.")] = None

    def search(self, **more: Any) -> Search:
        """Return the search for them."""
        from debulk.history import Search

        near_mm = None
        if self.near is not None:
            x, y = numbers_of(self.near, "--near", "two numbers in mm like 350,-120", 2)
            near_mm = x, y
        return Search(
            part=self.part, ply=self.ply, verdict=self.verdict, check=self.check, near_mm=near_mm,
            within_mm=self.within, since=self.since, until=self.until, **more,
        )  # fmt: skip


def listed(
    history: File,
    wanted: Wanted,
    limit: Annotated[int, typer.Option(min=1, help="Most lines.")] = 40,
    as_json: JSON = False,
) -> None:
    """List the layups that fit, the newest first."""
    from debulk.history import History
    from debulk.results.report_text import columns

    found = History(history).find(wanted.search(limit=limit))
    if as_json:
        print_json(json.dumps([dataclasses.asdict(one) for one in found], ensure_ascii=False))
        return
    heads = ("record", "time (UTC)", "part", "ply", "verdict", "pockets", "reason")
    rows = [(str(r.record), r.time_utc[:19], r.part, r.ply, r.verdict, str(r.pockets), r.reason) for r in found]
    text = {1, 2, 3, 4, 6}
    show(lambda width: "\n".join(columns([heads, *rows], text, width, 6)) if rows else "no layup fits")


def get(
    history: File,
    record: Annotated[int, typer.Argument(help="Number of the record of a report or a comparison.")],
    output: Annotated[list[Path], typer.Option("-o", "--output", help=".html, .json or .csv; repeatable.")],
) -> None:
    """Write a report or a comparison of a history to files."""
    from debulk.history import History
    from debulk.results.saving import ENDINGS

    for path in output:
        check_output(path, *ENDINGS)
    there = History(history)
    found = there.comparison(record) if there.kind(record) == "comparison" else there.report(record)
    for path in output:
        found.save(path)
        written(path)


def add(
    history: File,
    files: Annotated[list[Path], typer.Argument(help="Reports, .json, as debulk inspect or Report.save wrote them.")],
) -> None:
    """Add reports from files; those already there, by time, scan and recipe of the inspection, are not."""
    from debulk.history import History
    from debulk.report import Report

    there = History(history)
    with shown_progress() as progress:
        for k, path in enumerate(files):
            progress("adding", k / len(files))
            report = Report.load(path)
            number = there.number_of(report)
            print(f"{path}: {f'is record {number} already' if number else f'record {there.add(report)}'}")


def said(
    history: File,
    record: Annotated[int, typer.Argument(help="Record of the report.")],
    pocket: Annotated[int, typer.Argument(help="Number of the pocket.")],
    measured: Annotated[Literal["cease", "crease"], typer.Argument(help="What became of it.")],
    by: Annotated[str, typer.Option(help="Who says so.")] = "",
    note: Annotated[str, typer.Option(help="What else should be known.")] = "",
) -> None:
    """Store an operator's word on what became of a pocket."""
    from debulk.history import History

    print(f"record {History(history).add_outcome(record, pocket, measured, by, note)}")


def export(
    history: File,
    output: Annotated[Path, typer.Option("-o", "--output", help=".csv, .parquet (extra parquet), or .dfq (AQDEF).")],
    table: Annotated[
        Literal["layup", "pocket", "cause", "outcome", "chain"], typer.Option(help="What a line stands for.")
    ] = "layup",
    *,
    wanted: Wanted,
) -> None:
    """Write a table of layups that fit, their pockets, what kept them from CEASE, their outcomes or signatures."""
    from debulk.history import History
    from debulk.history.export import export as exported

    check_output(output, ".csv", ".parquet", ".dfq")
    count = exported(History(history), output, table, wanted.search())
    print(f"written: {output}, {count} rows")


def page(
    history: File,
    output: Annotated[Path, typer.Option("-o", "--output", help="The page, .html.")],
    wanted: Wanted,
    baseline: Annotated[int, typer.Option(min=20, help="First layups that give the control limits.")] = 300,
) -> None:
    """Make a page of the layups that fit: where pockets recur, what was right, and what drifts."""
    check_output(output, ".html")

    from debulk.files.replacing import write_text
    from debulk.history import History
    from debulk.history.page import page as drawn

    write_text(output, drawn(History(history), wanted.search(), baseline))
    written(output)


def check(
    history: File,
    head: Annotated[str, typer.Option(help="The head that an earlier check printed, noted elsewhere.")] = "",
) -> None:
    """Find records that were changed or are missing; the exit code is 1 if there are any."""
    from debulk.history import History

    found = History(history).check(head)
    print(found)
    raise typer.Exit(0 if found.passed else 1)


def calibrate(
    history: File,
    recipe: Annotated[Path | None, typer.Option(help="The recipe in use; unset: the default one.")] = None,
    missed: Annotated[float, typer.Option(help="Cost of a crease that is passed.")] = 20.0,
    needless: Annotated[float, typer.Option(help="Cost of a rework that is not needed.")] = 1.0,
    within: Annotated[
        float, typer.Option(help="Half the width of the limit's 95 % interval that is wanted, mm.")
    ] = 0.05,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="A recipe with the proposed limit, .toml.")
    ] = None,
    as_json: JSON = False,
) -> None:
    """Learn the limit of a ridge from what became of a history's pockets, and propose it.

    Nothing uses the proposed recipe by itself: look at it, and have it approved (debulk approve).
    """
    check_output(output, ".toml")

    from debulk.files.replacing import write_text
    from debulk.history import History
    from debulk.learning import calibrate as learned
    from debulk.learning.calibration import Costs
    from debulk.learning.text import as_json as json_of
    from debulk.learning.text import text
    from debulk.recipe import Recipe

    settings = Recipe() if recipe is None else Recipe.load(recipe)
    ply, present, costs = settings.material, settings.verdict.max_ridge_mm, Costs(missed, needless)
    found = learned(History(history), present, ply.thickness_mm, costs, within, bulk_factor=ply.bulk_factor)
    if as_json:
        print_json(json_of(found))
    else:
        print(text(found))
    if output is not None:
        try:
            write_text(output, found.proposed(settings).to_toml())
        except InputError as error:
            raise InputError(f"{output}: not written: {error}") from None
        written(None if as_json else output)


command(app, "history list")(listed)
command(app, "history outcome")(said)
for function in (get, add, export, page, check):
    command(app, f"history {function.__name__}")(function)
