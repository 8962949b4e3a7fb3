"""Solves that failed or were slow, kept in a folder for ``debulk replay``."""

from __future__ import annotations

import logging
from datetime import UTC, datetime
from pathlib import Path

from debulk.inspection.minima import replay
from debulk.recipe import Recipe
from debulk.sheet import Sheet
from debulk.solve import Solution

log = logging.getLogger("debulk")


def keep(
    ply: Sheet, solution: Solution, refused: bool, took_ms: float, number: int, recipe: Recipe, *, first: int = 0
) -> None:
    """Write the solve of pocket `number` into the recipe's folder, if it has one and the solve failed or was slow.

    `first` is the number of the first start that was tried. If the folder cannot be written to, a warning is logged
    and the verdict is not affected.
    """
    folder, wanted = recipe.run.dump_folder, recipe.solve
    if folder is None or refused or (solution.certified and took_ms <= recipe.run.slow_ms):
        return
    path = Path(folder) / f"{datetime.now(UTC):%Y%m%dT%H%M%S}_pocket_{number}.json"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        options = wanted.model_dump(include={"method", "seed", "tolerance", "max_iterations", "stiffness"})
        starts = first + max(1, len(solution.minima))
        replay.dump(path, ply, solution, starts=starts, first_start=first, **options)
    except OSError as error:
        log.warning("the solve of pocket %d could not be kept: %s: %s", number, path, error.strerror or error)
    else:
        log.info("the solve of pocket %d is kept in %s", number, path)
