"""How many starts a pocket gets: a few, and more, up to a fixed number, while a figure lies close to its limit.

A start is a starting point of the minimisation. A sheet has many minima, and its figures differ between them
(docs/model.md, section 4). Far from every limit this does not matter; close to a limit, the range over a few starts is
too narrow to trust. In bench/study, 2 starts, and up to 8 close to a limit, decided as well as 6 for every pocket, in
less than half the time.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from debulk import _core, ridge, sheet, solve
from debulk.recipe import Recipe, options

Range = tuple[float, float]
PostProcess = Callable[[solve.Solution], ridge.PostProcessed]


class Figures(Protocol):
    """The figures of a solution that the verdict depends on."""

    @property
    def rms_mm(self) -> float:
        """RMS of the gaps inside the perimeter."""

    @property
    def ridge_height_mm(self) -> float:
        """Height of the highest ridge; 0 without one."""

    @property
    def bridge_height_mm(self) -> float:
        """Height of the highest bridging node; 0 without one."""


@dataclass(frozen=True)
class Settled:
    """The result of all starts of a pocket."""

    solution: solve.Solution
    """The best certified solution, with the solutions of all starts in its `minima`."""
    best: ridge.PostProcessed
    """Ridges of that solution."""
    counted: tuple[solve.Solution, ...]
    """The certified solutions (those that needed a compliance count only if all did); without any, the best one."""
    every: tuple[ridge.PostProcessed, ...]
    """Ridges of each of the counted solutions."""
    cut: bool
    """Whether a deadline cut off starts that the rule asks for."""

    def and_of(self, other: Settled) -> Settled:
        """Also count the minima of the same net under another friction; the best solution stays."""
        return replace(self, counted=self.counted + other.counted, every=self.every + other.every)

    def late(self, stop: _core.Stop) -> bool:
        """Return whether the stop's deadline cut off starts, or the best solution before it was certified."""
        return self.cut or (stop.past_deadline and not self.solution.certified)

    @property
    def rms_mm(self) -> Range:
        """Least and greatest RMS over the certified starts."""
        return spread([p.rms_mm for p in self.every])

    @property
    def ridge_mm(self) -> Range:
        """Least and greatest ridge height over the certified starts."""
        return spread([p.ridge_height_mm for p in self.every])

    @property
    def bridge_mm(self) -> Range:
        """Least and greatest bridging height over the certified starts."""
        return spread([p.bridge_height_mm for p in self.every])


def settle(
    ply: sheet.Sheet,
    recipe: Recipe,
    post_process: PostProcess,
    stop: _core.Stop,
    *,
    judged_as: Callable[[ridge.PostProcessed], Figures] | None = None,
    for_the_picture: bool = False,
) -> Settled:
    """Minimise from `recipe.solve.starts`, then from further ones while `close` says so, up to `most_starts`.

    `judged_as` returns the figures that decide, where they are not those of the net: whether another start may change
    the verdict follows from them.

    With `for_the_picture`, the verdict needs no figure of a minimum, and one certified minimum is enough. It comes from
    a perturbed start: from the net as laid, a smooth, symmetric pocket keeps its symmetry on the way down, and shares
    its excess among folds that none of its neighbours in energy has (bench/referee). The net as laid is tried second.
    """
    wanted = recipe.solve
    minima: list[solve.Solution] = []
    counted: list[tuple[solve.Solution, ridge.PostProcessed]] = []

    def minimise(first: int, end: int) -> None:
        how = options.minimise(recipe)
        how.first_start, how.starts = first, end
        found = solve.minimise_with(how, ply, None, stop).minima
        minima.extend(found)
        counted.extend((m, post_process(m)) for m in found if m.certified)
        # A ply with softer fibres is another ply: minima with a compliance count only if all of them needed one.
        if not all(m.certificate.compliant for m, _ in counted):
            counted[:] = [(m, p) for m, p in counted if not m.certificate.compliant]

    def more() -> bool:
        decide = [judged_as(p) if judged_as else p for _, p in counted]
        return len(minima) < wanted.most_starts and close(decide, recipe)

    if for_the_picture:
        for first in (1, 0):
            minimise(first, first + 1)
            if minima[-1].certified or stop.now():
                break
        cut = stop.now() and not minima[-1].certified
        return _settled(minima, counted, post_process, cut)
    minimise(0, wanted.starts)
    while more() and not stop.now():
        minimise(len(minima), len(minima) + 1)
    # If a start is not certified, the stop may have ended it before it reached a minimum.
    cut = stop.now() and (more() or len(minima) < wanted.starts or not all(m.certified for m in minima))
    return _settled(minima, counted, post_process, cut)


def _settled(
    minima: list[solve.Solution],
    counted: list[tuple[solve.Solution, ridge.PostProcessed]],
    post_process: PostProcess,
    cut: bool,
) -> Settled:
    solution = solve.best(minima)
    if not counted:
        counted = [(solution, post_process(solution))]
    best = next(p for m, p in counted if m.nodes_mm is solution.nodes_mm)
    return Settled(solution, best, tuple(m for m, _ in counted), tuple(p for _, p in counted), cut)


def close(every: Sequence[Figures], recipe: Recipe) -> bool:
    """Return whether another start may change the verdict on a pocket whose certified starts have these figures.

    It may not if the starts already lie on both sides of a limit: the pocket is UNDECIDED, and stays so. Nor may it if
    one figure is above its limit in every start, or all figures are below, by more than `solve.close_ridge_mm` and
    `solve.close_rms_mm`.
    """
    if not every:
        return False
    limits, windows = recipe.verdict, recipe.solve
    ridges = (limits.max_ridge_mm, limits.ridge_margin_mm, windows.close_ridge_mm)
    figures = [  # least and most, limit, margin, window
        (*spread([p.ridge_height_mm for p in every]), *ridges),
        (*spread([p.rms_mm for p in every]), limits.max_rms_mm, limits.rms_margin_mm, windows.close_rms_mm),
    ]
    if any(p.bridge_height_mm > 0 for p in every):
        figures.append((*spread([p.bridge_height_mm for p in every]), *ridges))
    crease = any(low > limit + margin for low, _, limit, margin, _ in figures)
    cease = all(high <= limit - margin for _, high, limit, margin, _ in figures)
    if not crease and not cease:
        return False
    far_above = any(low > limit + window for low, _, limit, _, window in figures)
    far_below = all(high <= limit - window for _, high, limit, _, window in figures)
    return not far_above and not far_below


def spread(values: Sequence[float]) -> Range:
    """Return the least and the greatest value."""
    return min(values), max(values)
