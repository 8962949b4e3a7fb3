"""The problems of the study: the pockets of virtual layups, with nets of several sizes."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from debulk import _core, net, ridge, scenes, sheet, solve, verdict
from debulk.inspection.inspector import Inspector
from debulk.inspection.minima import starts
from debulk.inspection.minima.laid_pocket import LaidPocket, lay_pocket

if TYPE_CHECKING:
    from debulk.recipe import Recipe


@dataclass(frozen=True)
class Figures:
    """The figures by which a configuration is judged."""

    rms_mm: float
    ridge_height_mm: float
    bridge_height_mm: float


@dataclass(frozen=True, eq=False)
class Case:
    """One pocket with one net, ready to be solved; laying the net took `net_ms` of CPU time."""

    layup: int
    pocket: int
    node_target: int
    laid: LaidPocket
    net_ms: float

    @property
    def name(self) -> str:
        """Layup and pocket, as 3/12."""
        return f"{self.layup}/{self.pocket}"

    @property
    def net(self) -> net.Net:
        """The net as the inspector lays it."""
        return self.laid.net

    @property
    def sheet(self) -> sheet.Sheet:
        """The ply; not available in a copy from another process."""
        return self.laid.sheet

    @property
    def recipe(self) -> Recipe:
        """Recipe of the inspection, with this size of net."""
        return self.laid.recipe

    def post_process(self, solution: solve.Solution) -> ridge.PostProcessed:
        """Ridges that a solution represents."""
        return self.laid.post_process(solution)

    def figures(self, solution: solve.Solution) -> Figures:
        """Return the figures of the ridges that decide."""
        out = self.post_process(solution)
        return Figures(out.rms_mm, out.ridge_height_mm, out.bridge_height_mm)

    def judge(
        self,
        solution: solve.Solution,
        figures: starts.Figures,
        every: Sequence[starts.Figures],
        recipe: Recipe | None = None,
    ) -> verdict.Verdict:
        """Verdict by the paper's figures on a solution whose certified starts have the figures `every`.

        It is the verdict that the inspector would give, with the limits of the case's recipe or of another. The study
        examines minima, and the excess criterion does not use them.
        """
        laid = self.laid if recipe is None else replace(self.laid, recipe=recipe)
        return laid.judge(solution, every or [figures], criterion="paper").verdict

    def perturbed(self, amplitude: float, seed: int) -> np.ndarray:
        """(N, 3) start with the movable nodes displaced by up to `amplitude` spacings along x, y and the gap."""
        nodes = self.net.nodes_mm.copy()
        movable = self.net.kinds != 1
        rng = np.random.default_rng([self.layup, self.pocket, seed])
        step = self.net.spacing_mm * amplitude * rng.uniform(-1.0, 1.0, (int(movable.sum()), 3))
        gaps = self.sheet.gaps(nodes)[movable]
        xy = nodes[movable, :2] + step[:, :2]
        nodes[movable] = np.column_stack([xy, self.laid.reference.height(xy) + np.maximum(0.0, gaps + step[:, 2])])
        return nodes


def cases(
    layups: Iterable[int],
    node_targets: tuple[int, ...],
    recipe: Recipe,
    pixels: tuple[int, int] = (1280, 960),
    pockets: int = 14,
) -> Iterator[list[Case]]:
    """Yield each virtual layup's cases: every pocket with each size of net.

    Parameters
    ----------
    layups
        Seeds of `debulk.scenes.layup`.
    node_targets
        Numbers of nodes of the nets.
    recipe
        Recipe of the inspection; `net.node_target` is overridden.
    pixels
        Pixels of the virtual scanner.
    pockets
        Largest number of pockets of a layup; the largest ones are taken.
    """
    for seed in layups:
        layup = scenes.layup(seed=seed, pixels=pixels)
        inspector = Inspector(recipe, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
        laid = []
        for found in inspector.find(layup.scan).pockets[:pockets]:
            for target in node_targets:
                sized = replace(inspector.ply, recipe=recipe.model_copy(update={"net": {"node_target": target}}))
                began = time.thread_time()
                try:
                    pocket = lay_pocket(found, sized)
                except _core.InputError:
                    continue  # no net can be laid: the inspector calls it INVALID before it solves anything
                laid.append(Case(seed, found.number, target, pocket, 1e3 * (time.thread_time() - began)))
        yield laid
