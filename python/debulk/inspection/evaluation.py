"""One pocket: from its patch to its verdict."""

from __future__ import annotations

import time
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from debulk import _core, net, pocket, ridge, sheet, solve, surface, verdict
from debulk.grid import Grid
from debulk.inspection import dumps, starts
from debulk.results.report import LeftOut, PocketNet, PocketReport, SolveReport

if TYPE_CHECKING:
    from debulk.recipe import Recipe

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Evaluation:
    """A pocket's part of the report, and what was left out for it."""

    report: PocketReport
    left_out: tuple[LeftOut, ...] = ()


@dataclass
class _Stopwatch:
    """Milliseconds a step, without those of the steps within it."""

    split_ms: dict[str, float] = field(default_factory=dict)

    @contextmanager
    def step(self, name: str) -> Iterator[None]:
        began, before_ms = time.perf_counter(), sum(self.split_ms.values())
        yield
        within_ms = sum(self.split_ms.values()) - before_ms
        self.split_ms[name] = self.split_ms.get(name, 0.0) + 1e3 * (time.perf_counter() - began) - within_ms


def evaluate(
    segmentation: pocket.Segmentation,
    feet: pocket.Feet,
    index: int,
    reference: surface.Reference,
    ply_outline: Floats | None,
    fibre_angles_deg: Floats | Grid,
    recipe: Recipe,
    stop: _core.Stop,
    number: int | None = None,
    pool: Executor | None = None,
) -> Evaluation:
    """Evaluate pocket number `index` (from 0) of a segmentation: patch, net, minimum, ridges, verdict.

    Its report gets the id `number`, its own unless that is given. Idle threads of the pool help, see `starts.settle`.
    """
    found, foot = segmentation.pockets[index], feet.feet[index]
    watch = _Stopwatch()
    seen = PocketReport(  # what is known before the ply is modelled
        id=found.id if number is None else number,
        verdict=verdict.Verdict.INVALID,
        reason="",
        outline_mm=found.outline_mm,
        foot_outline_mm=foot.outline_mm,
        touches_ply_edge=found.touches_ply_edge,
        area_mm2=found.area_mm2,
        peak_mm=found.peak_mm,
        volume_mm3=found.volume_mm3,
        measured_share=found.measured_share,
    )

    def given_up(judged: verdict.Judgement) -> Evaluation:
        return Evaluation(replace(seen, verdict=judged.verdict, reason=judged.reason))

    if stop.now():
        return given_up(verdict.judge(certified=False, deadline_passed=True, coverage=found.measured_share))
    try:
        with watch.step("net"):
            laid = lay_net(segmentation, feet, index, reference, ply_outline, fibre_angles_deg, recipe, stop)
    except _core.Stopped:
        return given_up(verdict.judge(certified=False, deadline_passed=True, coverage=found.measured_share))
    except _core.InputError as error:  # of the data, not of the user: a surface on which no net can be laid
        return given_up(verdict.judge(certified=False, refused=f"no net could be laid: {error}"))

    def post_process(solution: solve.Solution) -> ridge.PostProcessed:
        with watch.step("ridge"):
            return _post_process(solution, laid, reference, recipe)

    with watch.step("solve"):
        ply = sheet.Sheet(laid.nodes_mm, laid.neighbours, laid.kinds, laid.spacing_mm, laid.area_mm2, reference, recipe)
        outcome = starts.settle(ply, recipe, post_process, stop, pool)
    solution = outcome.solution
    dumps.keep(ply, solution, _refused(solution), watch.split_ms["solve"], seen.id, recipe)
    judged = _judge(outcome, found, foot, laid, recipe, stop)
    worst = max(outcome.best.sections, key=lambda section: section.height_mm, default=None)
    report = replace(
        seen,
        verdict=judged.verdict,
        reason=judged.reason,
        spacing_mm=laid.spacing_mm,
        node_count=len(laid.nodes_mm),
        rms_mm=outcome.best.rms_mm,
        rms_range_mm=outcome.rms_mm,
        ridge_height_mm=outcome.best.ridge_height_mm,
        ridge_range_mm=outcome.ridge_mm,
        ridge_length_mm=outcome.best.ridge_length_mm,
        ridge_nodes=None if worst is None else np.array(worst.nodes, dtype=np.int32),
        bridge_height_mm=outcome.best.bridge_height_mm,
        excess_length_mm=outcome.best.excess_length_mm,
        net=PocketNet(
            nodes_mm=laid.nodes_mm,
            neighbours=laid.neighbours,
            kinds=laid.kinds.astype(np.uint8),
            edges=laid.edges,
            inside=laid.inside,
        ),
        initial_gap_mm=ply.gaps(laid.nodes_mm),
        debulked_mm=solution.nodes_mm,
        debulked_gap_mm=ply.gaps(solution.nodes_mm),
        post_processed_gap_mm=outcome.best.gap_mm,
        energy_mj=solution.energy_mj,
        energy_terms_mj=ply.terms(solution.nodes_mm),
        solve=_solve_report(solution, recipe),
        runtime_ms=sum(watch.split_ms.values()),
        runtime_split_ms=watch.split_ms,
    )
    return Evaluation(report, _left_out(ply, outcome))


def criteria(recipe: Recipe) -> verdict.Criteria:
    """Take the limits from the recipe."""
    limits = recipe.verdict
    return verdict.Criteria(
        max_rms_mm=limits.max_rms_mm,
        max_ridge_height_mm=limits.max_ridge_mm,
        min_coverage=limits.min_coverage,
        min_pocket_coverage=limits.min_pocket_coverage,
        rms_margin_mm=limits.rms_margin_mm,
        ridge_margin_mm=limits.ridge_margin_mm,
        compliance_margin_mm=limits.compliance_margin_mm,
    )


def lay_net(
    segmentation: pocket.Segmentation,
    feet: pocket.Feet,
    index: int,
    reference: surface.Reference,
    ply_outline: Floats | None,
    fibre_angles_deg: Floats | Grid,
    recipe: Recipe,
    stop: _core.Stop | None = None,
) -> net.Net:
    """Lay the net of pocket number `index` (from 0) on its patch."""
    found, foot = segmentation.pockets[index], feet.feet[index]
    # The net reaches one spacing past the perimeter, and lies within it with a good part of its nodes.
    spacing = recipe.net.spacing_mm or 2 * float(np.sqrt(foot.area_mm2 / recipe.net.node_target))
    paper = recipe.patch.mode == "paper"
    return net.from_core(
        _core.lay_pocket(
            segmentation._core,
            feet._core,
            found.id,
            reference,
            mode=recipe.patch.mode,
            margin_mm=spacing + 10.0,
            angles=np.radians(_angles_at(fibre_angles_deg, found.centroid_mm)),
            ply_outline=ply_outline,
            spacing=recipe.net.spacing_mm,
            node_target=recipe.net.node_target,
            edge_tol=recipe.segmentation.edge_tol_mm,
            # The foot lies at the tolerance: what the spline makes of it may be a little above.
            mold_tol=1.25 * feet.mold_tol_mm,
            paths="vertical_plane" if paper else recipe.net.paths,  # geodesics stray on the glued step
            stop=stop or _core.Stop(),
        )
    )


def _angles_at(angles: Floats | Grid, xy: Floats) -> Floats:
    if not isinstance(angles, Grid):
        return angles
    i, j = np.rint((xy - angles.origin_mm) / angles.spacing_mm).astype(int)
    ny, nx = angles.values.shape[:2]
    return np.asarray(angles.values[np.clip(j, 0, ny - 1), np.clip(i, 0, nx - 1)], dtype=np.float64)


def _post_process(
    solution: solve.Solution, laid: net.Net, reference: surface.Reference, recipe: Recipe
) -> ridge.PostProcessed:
    return ridge.post_process(
        solution.nodes_mm,
        laid.neighbours,
        laid.inside,
        reference,
        thickness_mm=recipe.material.thickness_mm,
        bulk_factor=recipe.material.bulk_factor,
        touch_mm=recipe.ridge.touch_mm,
    )


def _judge(
    outcome: starts.Settled,
    found: pocket.Pocket,
    foot: pocket.Foot,
    laid: net.Net,
    recipe: Recipe,
    stop: _core.Stop,
) -> verdict.Judgement:
    solution = outcome.solution
    refused = solution.explanation if _refused(solution) else ""
    return verdict.judge(
        certified=solution.certified,
        rms_mm=outcome.best.rms_mm,
        ridge_height_mm=outcome.best.ridge_height_mm,
        bridge_height_mm=outcome.best.bridge_height_mm,
        rms_range_mm=outcome.rms_mm,
        ridge_range_mm=outcome.ridge_mm,
        bridge_range_mm=outcome.bridge_mm,
        compliant=solution.certificate.compliant,
        solve_status=solution.certificate.failure or solution.explanation,
        deadline_passed=stop.past_deadline and not solution.certified,
        coverage=found.measured_share,
        closed_rim=(foot.closed or found.touches_ply_edge) and len(laid.open_ends) == 0,
        refused=refused,
        criteria=criteria(recipe),
    )


def _refused(solution: solve.Solution) -> bool:
    return solution.status in ("too_few_movable_nodes", "no_minimum", "not_a_surface")


def _solve_report(solution: solve.Solution, recipe: Recipe) -> SolveReport:
    certificate = solution.certificate
    return SolveReport(
        method=recipe.solve.method,
        status=solution.status,
        certified=solution.certified,
        iterations=solution.iterations,
        evaluations=solution.evaluations,
        length_error=certificate.length_error,
        penetration_mm=certificate.penetration_mm,
        kkt_error=certificate.kkt_error,
        curvature=certificate.curvature,
        energy_gain_mj=certificate.energy_gain_mj,
        compliant=certificate.compliant,
        starts=len(solution.minima),
        doubt=certificate.failure,
    )


_LEFT_OUT = {
    "friction": LeftOut(
        what="friction of pockets inside the ply",
        why="their nets have no free edge",
        bound="none: friction acts on free boundary nodes only",
    ),
    "gravity": LeftOut(what="gravity", why="the recipe's density or gravity is zero", bound="below 1e-4 of the vacuum"),
}


def _left_out(ply: sheet.Sheet, outcome: starts.Settled) -> tuple[LeftOut, ...]:
    entries = [_LEFT_OUT[name] for name in ply.left_out if name in _LEFT_OUT]
    if outcome.cut:
        entries.append(
            LeftOut(
                what="some seeded starts",
                why="the deadline passed",
                bound="the ranges of RMS and ridge height come from fewer minima than the recipe asks for",
            )
        )
    return tuple(entries)
