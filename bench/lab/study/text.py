"""The study as plain text."""

from __future__ import annotations

import os
import platform
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from debulk.recipe import Recipe
from lab.study.rules import AMPLITUDE, ORDERS
from lab.study.runs import REFERENCE_TOLERANCE, Reference
from lab.study.summary import text

if TYPE_CHECKING:
    from lab.study.results import Results

_COLUMNS = {
    "label": ("setting", "s"),
    "pockets": ("pockets", "d"),
    "failed": ("failed", "d"),
    "starts_mean": ("starts", ".1f"),
    "cpu_median_ms": ("ms median", ".1f"),
    "cpu_p99_ms": ("99 %", ".0f"),
    "iterations_median": ("iterations", ".0f"),
    "iterations_p99": ("99 %", ".0f"),
    "rms_error_mean_mm": ("RMS error", ".4f"),
    "rms_error_p90_mm": ("90 %", ".4f"),
    "ridge_error_mean_mm": ("ridge error", ".4f"),
    "ridge_error_p90_mm": ("90 %", ".4f"),
    "energy_gap_mean": ("energy gap", ".1e"),
    "length_error_max": ("length error max", ".0e"),
    "flipped": ("flipped", ".1%"),
    "undecided": ("undecided", ".1%"),
    "overconfident": ("overconfident", ".1%"),
}

_NODES = {
    "label": ("nodes", "s"),
    "pockets": ("pockets", "d"),
    "failed": ("failed", "d"),
    "net_median_ms": ("net ms median", ".1f"),
    "cpu_median_ms": ("solve ms median", ".1f"),
    "cpu_p99_ms": ("99 %", ".0f"),
    "rms_error_mean_mm": ("RMS error mean", ".4f"),
    "ridge_error_mean_mm": ("ridge error mean", ".4f"),
    "flipped": ("flipped", ".1%"),
    "undecided": ("undecided", ".1%"),
    "rms_mean_mm": ("RMS mean", ".4f"),
    "ridge_mean_mm": ("ridge mean", ".3f"),
    "crease": ("CREASE", ".1%"),
}

_GROWTH = {
    "amplitude": ("perturbation", ".2f"),
    "starts": ("starts", "d"),
    "cpu_ms": ("ms", ".1f"),
    "rms_range_mm": ("RMS range mean", ".4f"),
    "rms_range_p90_mm": ("90 %", ".4f"),
    "ridge_range_mm": ("ridge range mean", ".4f"),
    "ridge_range_p90_mm": ("90 %", ".4f"),
    "energy_gap": ("energy gap", ".1e"),
    "rms_error_mm": ("RMS error", ".4f"),
    "ridge_error_mm": ("ridge error", ".4f"),
    "undecided": ("undecided", ".1%"),
    "found": ("found", ".1%"),
    "flipped": ("flipped", ".2%"),
}

_RULES = {
    "starts": ("starts", "d"),
    "most_starts": ("at most", "d"),
    "close_ridge_mm": ("ridge within mm", ".2f"),
    "close_rms_mm": ("RMS within mm", ".3f"),
    "ridge_margin_mm": ("margin ridge mm", ".3f"),
    "rms_margin_mm": ("RMS mm", ".4f"),
    "starts_mean": ("starts mean", ".1f"),
    "starts_p90": ("90 %", ".0f"),
    "cpu_mean_ms": ("ms mean", ".1f"),
    "cpu_p99_ms": ("99 %", ".0f"),
    "undecided": ("undecided", ".1%"),
    "found": ("found", ".0%"),
    "overconfident": ("overconfident", ".1%"),
    "false_cease": ("of these CEASE", ".2%"),
    "contrary": ("contrary starts", ".2%"),
    "flipped": ("flipped", ".2%"),
    "opposite": ("opposite", ".3%"),
}

_PERTURBATIONS = {
    "amplitude": ("perturbation", ".2f"),
    "starts": ("starts", "d"),
    "certified": ("certified", ".2%"),
    "minima": ("minima a pocket", ".1f"),
    "single": ("pockets with one", ".1%"),
    "lowest": ("reach the least energy", ".1%"),
    "iterations": ("iterations", ".1f"),
    "cpu_ms": ("ms a start", ".1f"),
}


def study_text(results: Results) -> str:
    """Return all tables with an explanation of what they mean."""
    plan, solved = results.plan, results.solved
    straddling = sum(r.verdict_of_all == "undecided" for _, r in solved)
    pools = len(plan.amplitudes) * plan.reference_starts + 1
    sizes = ", ".join(f"{a:g}" for a in plan.amplitudes)
    paragraphs = [
        "THE SOLVER: ERROR AGAINST RUN TIME",
        "Of the minima and what is read from them: the figures by which pockets at the ply's edge are judged, and "
        "every pocket by the paper's criterion. Inside the ply the excess decides, which knows no minimum (by "
        "default). There an inspection solves one perturbed start, for the picture; at the "
        f"edge it takes {Recipe().solve.starts} to {Recipe().solve.most_starts}. So do all sweeps but those of the "
        "starts and the methods. Verdicts are the paper's throughout.",
        f"{len(plan.layups)} virtual layups (seeds {min(plan.layups)} to {max(plan.layups)}), "
        f"{len({(r.layup, r.pocket) for r in results.rows})} pockets. {_machine()}; "
        "times are CPU times of the solving thread, with post-processing, without the net. Other programs ran beside "
        f"the study (load {results.load_before:.1f} before, {results.load_after:.1f} after it), which slows memory and "
        "caches: compare iterations too.",
        f"Reference of a pocket: the certified solution of least energy among {pools} starts of the interior point at "
        f"tolerance {REFERENCE_TOLERANCE:g}: the initial net, and {plan.reference_starts} perturbed by up to each of "
        f"{sizes} spacings; for nets of other sizes {plan.other_sizes_starts + 1} starts. {len(solved)} pockets of "
        f"{results.default_size} nodes have one; in {straddling} of them the certified starts lie on both sides of a "
        "limit, or one too near to it: these are undecidable.",
        "Errors in mm against the reference of the same net. Failed: not certified (its errors count). Energy gap: "
        "share of the energy's fall that the solution misses. Flipped: decided, and otherwise than the reference of "
        "least energy. Overconfident: decided, though the pocket is undecidable.",
    ]
    tables = [
        text("Tolerance", results.sweep("tolerance"), _COLUMNS),
        text("Starts", results.sweep("starts"), _COLUMNS),
        text("Stiffness of the fibres", results.sweep("stiffness"), _COLUMNS),
        text("Method and tolerance, one start", results.sweep("method"), _COLUMNS),
        text(
            "Nodes; RMS, ridge and CREASE are those of the result itself",
            results.sweep("nodes"),
            _NODES,
        ),
        text(
            "Several minima: numbers of starts, averaged over orders; found: share of the undecidable pockets",
            results.growth,
            _GROWTH,
        ),
        text(
            f"Rules for the number of starts, perturbed by {AMPLITUDE:g} spacings, averaged over {ORDERS} orders;"
            " contrary: share of all starts on the other side of the decisions;"
            "\nopposite: pairs of runs that decide one pocket in opposite ways",
            results.rules,
            _RULES,
        ),
        text("Several minima: size of the perturbation", results.perturbations, _PERTURBATIONS),
        _trend(results),
        _layups(results),
    ]
    wrapped = [fill(paragraph, 110) + "\n" for paragraph in paragraphs]
    return "\n".join(wrapped + tables)


def _trend(results: Results) -> str:
    """How the reference itself changes with the size of the net, pocket by pocket."""
    size: dict[int, dict[tuple[int, int], Reference]] = {}
    for case, reference in results.references:
        size.setdefault(case.node_target, {})[case.layup, case.pocket] = reference
    shared = set.intersection(*(set(found) for found in size.values())) if size else set()
    usual = size.get(results.default_size, {})
    out = [
        f"References against those of {results.default_size} nodes, of the {len(shared)} pockets that have all sizes",
        "",
    ]
    out.append("   nodes  RMS difference  ridge difference  verdicts that turn  CEASE  CREASE")
    for nodes, found in sorted(size.items()):
        both = [(found[k], usual[k]) for k in sorted(shared)]
        if not both:
            continue
        rms = np.mean([a.figures.rms_mm - b.figures.rms_mm for a, b in both])
        ridge = np.mean([a.figures.ridge_height_mm - b.figures.ridge_height_mm for a, b in both])
        turned = np.mean([{a.verdict, b.verdict} == {"cease", "crease"} for a, b in both])
        share = {v: np.mean([a.verdict == v for a, _ in both]) for v in ("cease", "crease")}
        out.append(
            f"  {nodes:6d}  {rms:+14.4f}  {ridge:+16.3f}  {turned:18.1%}  {share['cease']:5.0%}  {share['crease']:6.0%}"
        )
    return "\n".join(out) + "\n"


def _layups(results: Results) -> str:
    """How often ranges over starts include a limit, layup by layup, by the recipe's rule and with all starts."""
    rule = f"{Recipe().solve.starts} to {Recipe().solve.most_starts}"
    out = [
        f"Layups: verdicts of the pockets with the recipe's {rule} starts, and with all starts of the reference",
        "",
    ]
    out.append(
        "  layup  pockets  starts     ms  CEASE  CREASE  UNDECIDED  INVALID  all: UNDECIDED  pockets that differ"
    )
    rows = [r for r in results.rows if r.sweep == "starts" and r.label == rule]
    for layup in (*results.plan.layups, None):
        mine = rows if layup is None else [r for r in rows if r.layup == layup]
        count = [sum(r.verdict == v for r in mine) for v in ("cease", "crease", "undecided", "invalid")]
        every = sum(r.reference_verdict_of_all == "undecided" for r in mine)
        differ = [] if layup is None else [r for r in mine if r.verdict != r.reference_verdict_of_all]
        pairs = ", ".join(f"{r.pocket}: {r.verdict} {r.reference_verdict_of_all}" for r in differ)
        out.append(
            f"  {'all' if layup is None else layup:>5}  {len(mine):7d}  {sum(r.starts for r in mine):6d}"
            f"  {sum(r.cpu_ms for r in mine):5.0f}  {count[0]:5d}  {count[1]:6d}  {count[2]:9d}  {count[3]:7d}"
            f"  {every:14d}  {pairs}".rstrip()
        )
    return "\n".join(out) + "\n"


def _machine() -> str:
    try:
        model = next(
            line.split(":", 1)[1].strip()
            for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
            if line.startswith("model name")
        )
    except (OSError, StopIteration):
        model = platform.machine()
    return f"{model}, {os.cpu_count()} cores, one thread a solve"
