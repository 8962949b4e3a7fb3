"""What a report says of the net of a pocket and of its minima, and what they leave out."""

from __future__ import annotations

from typing import Any

import numpy as np

from debulk import ridge, sheet, solve
from debulk.arrays import same_named
from debulk.inspection.minima.laid_pocket import LaidPocket
from debulk.inspection.minima.starts import Settled
from debulk.results.report import LeftOut, PocketNet, SolveReport

_LEFT_OUT = {
    "friction": LeftOut(
        what="friction of pockets inside the ply",
        why="their nets have no free edge",
        bound="none: friction acts on free boundary nodes only",
    ),
    "gravity": LeftOut(what="gravity", why="the recipe's density or gravity is zero", bound="below 1e-4 of the vacuum"),
    "starts": LeftOut(
        what="some seeded starts",
        why="the deadline passed",
        bound="the ranges of RMS and ridge height come from fewer minima than the recipe asks for",
    ),
}


_OF_SOLUTION = ("status", "certified", "iterations", "evaluations")
_OF_CERTIFICATE = ("length_error", "penetration_mm", "kkt_error", "curvature", "compliant")


def net_figures(laid: LaidPocket) -> dict[str, Any]:
    """Return the fields of a pocket's report that come from its net."""
    net = laid.net
    return {
        "spacing_mm": net.spacing_mm,
        "node_count": len(net.nodes_mm),
        "net": PocketNet(kinds=net.kinds.astype(np.uint8), **same_named(PocketNet, net, "kinds")),
        "initial_gap_mm": laid.sheet.gaps(net.nodes_mm),
    }


def debulked_figures(laid: LaidPocket, settled: Settled) -> dict[str, Any]:
    """Return the fields that come from its minima."""
    solution, best = settled.solution, settled.best
    worst = max(best.sections, key=lambda section: section.height_mm, default=None)
    return {
        "rms_mm": best.rms_mm,
        "rms_range_mm": settled.rms_mm,
        "ridge_height_mm": best.ridge_height_mm,
        "ridge_range_mm": settled.ridge_mm,
        "ridge_length_mm": best.ridge_length_mm,
        "ridge_nodes": None if worst is None else np.array(worst.nodes, dtype=np.int32),
        "bridge_height_mm": best.bridge_height_mm,
        **_drawn_in_figures(best),
        "excess_length_mm": laid.held_excess_mm,
        "debulked_mm": solution.nodes_mm,
        "debulked_gap_mm": laid.sheet.gaps(solution.nodes_mm),
        "post_processed_gap_mm": best.gap_mm,
        "energy_mj": solution.energy_mj,
        "energy_terms_mj": laid.sheet.terms(solution.nodes_mm),
        "solve": _solve_report(laid, solution),
    }


def _drawn_in_figures(best: ridge.PostProcessed) -> dict[str, float]:
    if not best.is_drawn_in.any():
        return {}
    return {
        "drawn_in_mm": best.drawn_in_height_mm,
        "drawn_in_tension_n_per_mm": best.drawn_in_tension_n_per_mm,
        "drawn_in_hold_n_per_mm": best.drawn_in_hold_n_per_mm,
    }


def _solve_report(laid: LaidPocket, solution: solve.Solution) -> SolveReport:
    certificate = solution.certificate
    return SolveReport(
        method=laid.recipe.solve.method,
        **{name: getattr(solution, name) for name in _OF_SOLUTION},
        **{name: getattr(certificate, name) for name in _OF_CERTIFICATE},
        energy_gain_mj=laid.sheet.energy(laid.sheet.start_mm) - solution.energy_mj,
        starts=len(solution.minima),
        doubt=certificate.failure,
    )


def left_out_of(ply: sheet.Sheet, settled: Settled) -> tuple[LeftOut, ...]:
    """Name the energy terms that the model of a pocket's ply omits, and the starts that a deadline cut off."""
    names = [*ply.left_out, "starts"] if settled.cut else ply.left_out
    return tuple(_LEFT_OUT[name] for name in names if name in _LEFT_OUT)
