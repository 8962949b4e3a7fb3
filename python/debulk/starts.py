"""How many starts a pocket gets: a fixed few, and more, up to a fixed number, while a figure lies close to its limit.

A sheet has many minima, and its figures differ between them (model.md, section 4). Far from every limit that does not
matter; close to one, the range over a few starts is too narrow to trust. Measured in bench/study: 2 starts, and up to 8
close to a limit, decide as well as 6 for every pocket, in less than half the time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from debulk import _core, ridge, sheet, solve

if TYPE_CHECKING:
    from debulk.recipe import Recipe

Range = tuple[float, float]
PostProcess = Callable[[solve.Solution], ridge.PostProcessed]


class Figures(Protocol):
    """What decides on a solution."""

    @property
    def rms_mm(self) -> float:
        """Of the gaps inside the perimeter."""

    @property
    def ridge_height_mm(self) -> float:
        """Of the highest ridge; 0 without one."""

    @property
    def bridge_height_mm(self) -> float:
        """Of the highest bridging node; 0 without one."""


@dataclass(frozen=True)
class Settled:
    """What all starts of a pocket came to."""

    solution: solve.Solution
    """The best certified one, with every start's in `minima`."""
    best: ridge.PostProcessed
    """Of that one."""
    every: tuple[ridge.PostProcessed, ...]
    """Of every certified start (without those that needed a compliance, unless all did); else of the solution."""
    cut: bool
    """Whether a deadline left out starts that the rule asks for."""

    @property
    def rms_mm(self) -> Range:
        """Least and most over the certified starts."""
        return _range([p.rms_mm for p in self.every])

    @property
    def ridge_mm(self) -> Range:
        """The same of the ridge height."""
        return _range([p.ridge_height_mm for p in self.every])

    @property
    def bridge_mm(self) -> Range:
        """The same of the bridging height."""
        return _range([p.bridge_height_mm for p in self.every])


def settle(ply: sheet.Sheet, recipe: Recipe, post_process: PostProcess, stop: _core.Stop) -> Settled:
    """Minimise from `recipe.solve.starts`, then from further ones while `close` says so, up to `most_starts`."""
    wanted = recipe.solve
    minima: list[solve.Solution] = []
    counted: list[tuple[solve.Solution, ridge.PostProcessed]] = []

    def go_on(starts: int) -> None:
        found = solve.minimise(
            ply,
            wanted.method,
            starts=starts,
            seed=wanted.seed,
            tolerance=wanted.tolerance,
            max_iterations=wanted.max_iterations,
            stiffness=wanted.stiffness,
            first_start=len(minima),
            stop=stop,
        )
        minima.extend(found.minima)
        counted.extend((m, post_process(m)) for m in found.minima if m.certified)
        # A ply with softer fibres is another ply: it counts where all of them needed a compliance.
        if not all(m.certificate.compliant for m, _ in counted):
            counted[:] = [(m, p) for m, p in counted if not m.certificate.compliant]

    def more() -> bool:
        return len(minima) < wanted.most_starts and close([p for _, p in counted], recipe)

    go_on(wanted.starts)
    while more() and not stop.now():
        go_on(len(minima) + 1)
    cut = stop.now() and (more() or len(minima) < wanted.starts or minima[-1].status == "deadline")
    solution = solve.best(minima)
    if not counted:
        counted = [(solution, post_process(solution))]
    best = min(counted, key=lambda found: solve.rank(found[0]))[1]
    return Settled(solution, best, tuple(p for _, p in counted), cut)


def close(every: Sequence[Figures], recipe: Recipe) -> bool:
    """Whether another start may well change the verdict on a pocket whose certified starts have these figures.

    Not where the starts lie on both sides of a limit already: it is UNDECIDED, and stays so. Not where one figure lies
    above its limit in every start, or all below, by more than `solve.close_ridge_mm` and `solve.close_rms_mm`.
    """
    if not every:
        return False
    limits, windows = recipe.verdict, recipe.solve
    ridges = (limits.max_ridge_mm, limits.ridge_margin_mm, windows.close_ridge_mm)
    figures = [  # least and most, limit, margin, window
        (*_range([p.ridge_height_mm for p in every]), *ridges),
        (*_range([p.rms_mm for p in every]), limits.max_rms_mm, limits.rms_margin_mm, windows.close_rms_mm),
    ]
    if any(p.bridge_height_mm > 0 for p in every):
        figures.append((*_range([p.bridge_height_mm for p in every]), *ridges))
    crease = any(low > limit + margin for low, _, limit, margin, _ in figures)
    cease = all(high <= limit - margin for _, high, limit, margin, _ in figures)
    if not crease and not cease:
        return False
    far_above = any(low > limit + window for low, _, limit, _, window in figures)
    far_below = all(high <= limit - window for _, high, limit, _, window in figures)
    return not far_above and not far_below


def _range(values: list[float]) -> Range:
    return min(values), max(values)
