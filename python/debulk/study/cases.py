"""The problems of the study: the pockets of virtual layups, with nets of several sizes."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from debulk import _core, net, pocket, ridge, scenes, sheet, solve, surface, verdict
from debulk.inspection import starts
from debulk.inspection.evaluation import Evaluation, criteria, lay_net
from debulk.inspection.inspector import Inspector
from debulk.inspection.regions import Found

if TYPE_CHECKING:
    from debulk.recipe import Recipe


@dataclass(frozen=True)
class Figures:
    """What a configuration is judged by."""

    rms_mm: float
    ridge_height_mm: float
    bridge_height_mm: float


@dataclass(frozen=True, eq=False)
class Case:
    """One pocket with one net, ready to be solved; laying the net took `net_ms` of CPU time."""

    layup: int
    pocket: int
    node_target: int
    net: net.Net
    sheet: sheet.Sheet
    reference: surface.Reference
    measured_share: float
    closed_rim: bool
    net_ms: float
    recipe: Recipe

    @property
    def name(self) -> str:
        """Layup and pocket, as 3/12."""
        return f"{self.layup}/{self.pocket}"

    def __getstate__(self) -> dict[str, object]:
        """Leave out what is compiled: a copy from another process can still be judged."""
        return {k: v for k, v in self.__dict__.items() if k not in ("sheet", "reference")}

    def post_process(self, solution: solve.Solution) -> ridge.PostProcessed:
        """Ridges that a solution stands for."""
        material = self.recipe.material
        return ridge.post_process(
            solution.nodes_mm,
            self.net.neighbours,
            self.net.inside,
            self.reference,
            thickness_mm=material.thickness_mm,
            bulk_factor=material.bulk_factor,
            touch_mm=self.recipe.ridge.touch_mm,
        )

    def figures(self, solution: solve.Solution) -> Figures:
        """Of the ridges, what decides."""
        out = self.post_process(solution)
        return Figures(out.rms_mm, out.ridge_height_mm, out.bridge_height_mm)

    def judge(
        self,
        solution: solve.Solution,
        figures: starts.Figures,
        every: Sequence[starts.Figures],
        recipe: Recipe | None = None,
    ) -> verdict.Verdict:
        """Verdict on a solution whose certified starts have the figures `every`, as the inspector gives it.

        With the limits of the case's recipe, or of another.
        """
        return verdict.judge(
            certified=solution.certified,
            rms_mm=figures.rms_mm,
            ridge_height_mm=figures.ridge_height_mm,
            bridge_height_mm=figures.bridge_height_mm,
            rms_range_mm=_range([f.rms_mm for f in every]),
            ridge_range_mm=_range([f.ridge_height_mm for f in every]),
            bridge_range_mm=_range([f.bridge_height_mm for f in every]),
            compliant=solution.certificate.compliant,
            coverage=self.measured_share,
            closed_rim=self.closed_rim,
            refused=solution.explanation if solution.status == "too_few_movable_nodes" else "",
            criteria=criteria(recipe or self.recipe),
        ).verdict

    def perturbed(self, amplitude: float, seed: int) -> np.ndarray:
        """(N, 3) start with the movable nodes moved by up to `amplitude` spacings along x, y and the gap."""
        nodes = self.net.nodes_mm.copy()
        movable = self.net.kinds != 1
        rng = np.random.default_rng([self.layup, self.pocket, seed])
        step = self.net.spacing_mm * amplitude * rng.uniform(-1.0, 1.0, (int(movable.sum()), 3))
        gaps = self.sheet.gaps(nodes)[movable]
        xy = nodes[movable, :2] + step[:, :2]
        nodes[movable] = np.column_stack([xy, self.reference.height(xy) + np.maximum(0.0, gaps + step[:, 2])])
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
        Sizes of nets.
    recipe
        Of the inspection; `net.node_target` is overridden.
    pixels
        Of the virtual scanner.
    pockets
        At most so many of a layup, the largest first.
    """
    for seed in layups:
        layup = scenes.layup(seed=seed, pixels=pixels)
        whole = recipe.model_copy(update={"segmentation": {"regions": False}})
        front = _FrontEnd(whole, layup.reference, layup.ply_outline, mold_from_scanner=layup.mold_from_scanner)
        front.inspect(layup.scan)
        found = []
        for index, one in enumerate(front.segmentation.pockets[:pockets]):
            for target in node_targets:
                sized = recipe.model_copy(update={"net": {"node_target": target}})
                try:
                    found.append(_case(front, seed, index, target, sized, one))
                except _core.InputError:
                    continue  # no net can be laid: the inspector calls it INVALID before it solves anything
        yield found


class _FrontEnd(Inspector):
    """An inspector that stops before the first solve and keeps what it has found."""

    segmentation: pocket.Segmentation
    feet: pocket.Feet

    def _evaluate(self, found: Found, cycle: object) -> list[Evaluation]:
        [(self.segmentation, self.feet)] = found.parts
        return []


def _case(front: _FrontEnd, seed: int, index: int, target: int, recipe: Recipe, found: pocket.Pocket) -> Case:
    began = time.thread_time()
    laid = lay_net(
        front.segmentation, front.feet, index, front.reference, front.ply_outline, front.fibre_angles_deg, recipe
    )
    net_ms = 1e3 * (time.thread_time() - began)
    ply = sheet.Sheet(
        laid.nodes_mm, laid.neighbours, laid.kinds, laid.spacing_mm, laid.area_mm2, front.reference, recipe
    )
    closed = (front.feet.feet[index].closed or found.touches_ply_edge) and len(laid.open_ends) == 0
    return Case(seed, found.id, target, laid, ply, front.reference, found.measured_share, closed, net_ms, recipe)


def _range(values: list[float]) -> tuple[float, float] | None:
    return (min(values), max(values)) if values else None
