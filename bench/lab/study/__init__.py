"""Error against run time: the cost of each setting of the solver, and its effect on the answer.

`solver` lays nets on the pockets of virtual layups, determines the converged reference of each net, and solves the net
again under one setting at a time. Figures, tables and pictures are written into a folder; `python -m lab.study`
calls `main`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from debulk import solve
from debulk._core import InputError
from lab.study.plan import Plan, settings

if TYPE_CHECKING:
    from lab.study.results import Results

__all__ = ["Plan", "main", "solver"]

Progress = Callable[[str, float], None]


def solver(
    out_dir: str | PathLike[str],
    layups: Iterable[int] | None = None,
    quick: bool = False,
    progress: Progress | None = None,
    pictures: bool = True,
    workers: int = 1,
) -> Results:
    """Study the solver on virtual layups.

    Parameters
    ----------
    out_dir
        Folder for study.txt, the tables (.csv) and the pictures (.png); created if necessary.
    layups
        Seeds of `debulk.scenes.layup`. Default: 100 to 119, quick: 0.
    quick
        Whether to use only a few pockets and settings, in seconds; this shows that the study runs, but its figures mean
        little.
    progress
        Function that is called with the stage and the share of the work that is done.
    pictures
        Whether to draw the pictures; needs matplotlib (``pip install debulk[bench]``).
    workers
        Number of processes, which each take a layup at a time. More than one slow each other down a little: times are
        CPU times, but memory and caches are shared.

    Returns
    -------
    Results
        Rows, references, lines and tables, as written to the files.

    Raises
    ------
    InputError
        If there is no layup, the folder cannot be created, or matplotlib is missing but pictures are requested.
    """
    plan = Plan.quick() if quick else Plan()
    if layups is not None:
        plan = plan.with_layups(layups)
    if pictures:
        from lab.study.pictures import pyplot

        pyplot()  # fails now rather than after the work
    folder = Path(out_dir)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"out_dir: {folder} cannot be made: {error.strerror or error}") from None

    from lab.study.results import collect, write

    wanted = settings(plan, [name for name in solve.methods() if name != "auto"])
    results = collect(plan, wanted, progress or (lambda stage, done: None), workers)
    write(results, folder)
    if pictures:
        from lab.study.pictures import draw

        draw(results, folder)
    return results


def main(out_dir: str | PathLike[str] = "bench/study", quick: bool = False, workers: int = 1) -> None:
    """Run the study and print its tables, with one line of progress per layup."""
    import sys

    def report(stage: str, done: float) -> None:
        print(f"{100 * done:3.0f} %  {stage}", file=sys.stderr)

    print(solver(out_dir, quick=quick, progress=report, workers=workers).text)
