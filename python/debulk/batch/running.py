"""The run over an archive: the history says what is done, the workers do the rest, one writer adds what they return."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from os import PathLike
from typing import Any

from debulk._core import InputError
from debulk.arguments import typed
from debulk.batch.archive import Layup
from debulk.batch.worker import inspected
from debulk.build import build_id
from debulk.history.store import History
from debulk.recipe import Recipe
from debulk.report import Report
from debulk.results import codec
from debulk.results.approval import recipe_hash
from debulk.results.fitting import check_fits
from debulk.results.report import FORMAT

_RETRIES = 3  # of a layup whose worker was lost
_AHEAD = 4  # layups for each worker that wait at the scheduler: it holds no more than it needs


@dataclass
class Batch:
    """What became of the layups of an archive."""

    done: int = 0
    """Number of layups that the history held already, by the same recipe and build."""
    verdicts: Counter[str] = field(default_factory=Counter)
    """Number of new reports by the name of their verdict."""
    wrong: dict[tuple[str, str], str] = field(default_factory=dict)
    """What was wrong with those that have no report, by part and ply; the next run tries them again."""

    @property
    def total(self) -> int:
        """Number of layups that have been dealt with so far."""
        return self.done + self.verdicts.total() + len(self.wrong)


@typed
def run(
    archive: Sequence[Layup],
    recipe: Recipe,
    history: History | str | PathLike[str],
    scheduler: str | None = None,
    workers: int = 2,
    progress: Callable[[Batch], None] | None = None,
) -> Batch:
    """Inspect the layups of an archive with a recipe, on Dask's workers, and add the reports to a history.

    A report is in the history once or not at all, whatever is killed: a worker's layup goes to another worker, and
    after the client or the scheduler was lost the same call goes on where that one ended, because layups that the
    history holds by this recipe and this build are not inspected again. Needs the extra "batch".

    Parameters
    ----------
    archive
        From `layups`. The workers read the files, so they must see the same folders.
    recipe
        Used for all. In its section ``run`` every worker uses one thread.
    history
        Where the reports go; only this process writes to it.
    scheduler
        Address of a running Dask scheduler; None: `workers` processes on this machine.
    workers
        Number of processes on this machine; not used with a scheduler.
    progress
        Called from this thread after every layup.

    Raises
    ------
    InputError
        If a report cannot be stored, or the scheduler does not answer.
    """
    try:
        from distributed import Client, LocalCluster, as_completed
    except ImportError:
        raise InputError('batch: needs Dask: pip install "debulk[batch]"') from None
    history = history if isinstance(history, History) else History(history)
    settings, build = recipe.model_dump(), build_id()
    known = _known(history, recipe_hash(settings), build)
    settings["run"]["threads"] = 1  # the hash leaves the section out
    todo = [layup for layup in archive if layup.key not in known]
    batch = Batch(done=len(archive) - len(todo))
    if not todo:
        return batch
    # A client that is ended ends its workers; what they say of that is nothing to a user.
    settled = {"threads_per_worker": 1, "dashboard_address": None, "silence_logs": logging.ERROR}
    local = None if scheduler else LocalCluster(n_workers=workers, **settled)
    try:
        with Client(local or scheduler, timeout=10) as client:
            waiting = iter(todo)
            running = as_completed(with_results=True, raise_errors=False)
            of: dict[Any, Layup] = {}

            def more() -> None:
                layup = next(waiting, None)
                if layup is not None:
                    future = client.submit(inspected, layup, settings, build, retries=_RETRIES, pure=False)
                    of[future] = layup
                    running.add(future)

            for _ in range(_AHEAD * max(1, len(client.scheduler_info()["workers"]))):
                more()
            for future, result in running:
                layup = of.pop(future)
                if future.status == "finished":
                    _keep(batch, layup, result, history)
                else:
                    batch.wrong[layup.key] = f"its worker was lost {_RETRIES + 1} times, or failed: {result}"
                if progress is not None:
                    progress(batch)
                more()
    except (OSError, TimeoutError) as error:
        raise InputError(f"scheduler: {error}; run the same command again to go on") from None
    finally:
        if local is not None:
            local.close()
    return batch


def _known(history: History, recipe: str, build: str) -> set[tuple[str, str]]:
    """Return part and ply of the layups that a history holds by a recipe and a build."""
    rows = history.find() if history.path.exists() else []
    return {(row.part, row.ply) for row in rows if (row.recipe, row.build) == (recipe, build)}


def _keep(batch: Batch, layup: Layup, result: tuple[bytes, str], history: History) -> None:
    text, wrong = result
    if wrong:
        batch.wrong[layup.key] = wrong
        return
    report = codec.loads(Report, text, FORMAT, check_fits)
    history.add(report)
    batch.verdicts[report.verdict.name] += 1
