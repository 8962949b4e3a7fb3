"""How many starts a pocket gets: a fixed few, and more, up to a fixed number, while a figure lies close to its limit.

A sheet has many minima, and its figures differ between them (model.md, section 4). Far from every limit that does not
matter; close to one, the range over a few starts is too narrow to trust. Measured in bench/study: this rule decides as
well as the most starts for every pocket do, in a quarter of their time.
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
    """The certified one of least energy, with every start's in `minima`."""
    best: ridge.PostProcessed
    """Of that one."""
    every: tuple[ridge.PostProcessed, ...]
    """Of every certified start; of the solution alone where none is."""
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
    every: list[ridge.PostProcessed] = []

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
        every.extend(post_process(m) for m in found.minima if m.certified)

    go_on(wanted.starts)
    while (more := len(minima) < wanted.most_starts and close(every, recipe)) and not stop.now():
        go_on(len(minima) + 1)
    cut = stop.now() and (more or len(minima) < wanted.starts or minima[-1].status == "deadline")
    solution = solve.best(minima)
    if not every:
        processed = post_process(solution)
        return Settled(solution, processed, (processed,), cut)
    energies = [m.energy_mj for m in minima if m.certified]
    return Settled(solution, every[energies.index(min(energies))], tuple(every), cut)


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
