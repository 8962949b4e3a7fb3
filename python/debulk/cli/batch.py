"""The command that inspects an archive again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from debulk.cli.given import RecipeFile
from debulk.cli.support import shown_progress

if TYPE_CHECKING:
    from debulk.batch import Batch


def batch(
    archive: Annotated[Path, typer.Argument(help="Folder of layups, each in a folder with a file layup.toml.")],
    history: Annotated[Path, typer.Option(help="The reports go into this history, .sqlite.")],
    recipe: RecipeFile = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a Dask scheduler; unset: processes on this machine.")
    ] = None,
    workers: Annotated[int, typer.Option(help="Processes on this machine.", min=1)] = 2,
) -> None:
    """Inspect an archive again, with another recipe or build; needs the extra "batch" (Dask).

    Killed at any moment, the same command goes on where it ended: what the history holds by this recipe and build is
    not inspected again. Ends with 1 if a layup has no report.
    """
    from debulk.batch import layups, run
    from debulk.recipe import Recipe

    found = layups(archive)
    settings = Recipe() if recipe is None else Recipe.load(recipe)
    with shown_progress() as progress:

        def shown(so_far: Batch) -> None:
            progress("layups", so_far.total / len(found))

        result = run(found, settings, history, scheduler, workers, shown)
    for (part, ply), wrong in sorted(result.wrong.items()):
        print(f"no report: {part}{f' ply {ply}' if ply else ''}: {wrong}")
    said = ", ".join(f"{count} {name}" for name, count in sorted(result.verdicts.items()))
    print(f"{len(found)} layups: {result.done} were there already, {said or 'none new'}, {len(result.wrong)} wrong")
    if result.wrong:
        raise typer.Exit(1)
