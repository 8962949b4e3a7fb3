"""What was calibrated, in words and as JSON."""

from __future__ import annotations

import json
import math

from debulk.learning.calibration import Calibrated, also


def text(found: Calibrated) -> str:
    """Return the findings, a line each."""
    low, high = found.posterior.interval_mm()
    first, last = found.posterior.spread_interval_mm()
    checked, costs = found.validated, found.costs
    creased = int(found.outcomes.creased.sum())
    limit = f"verdict.max_ridge_mm = {found.limit_mm:.2f} (an excess of {found.excess_mm:.2f} mm)"
    if not found.limit_mm:
        limit = "no limit, as by these outcomes no ridge is worth passing"
    lines = [
        f"{len(found.outcomes)} outcomes, {creased} of them creased{also(found.undecided, found.others)}",
        f"half of all pockets crease at a ridge of {found.posterior.limit_mm:.3f} mm (95 % interval {low:.3f} to "
        f"{high:.3f} mm); from pocket to pocket the limit spreads by {found.posterior.spread_mm:.3f} mm "
        f"({first:.3f} to {last:.3f})",
        f"proposed: {limit}, where a missed crease costs {costs.missed:g} and a needless rework {costs.needless:g}; at "
        f"present {found.present_mm:.2f}",
        f"cost per outcome, cross-validated: {checked.own:.3f}, of the present limit {checked.present:.3f}; log score "
        f"{checked.log_score:.3f}",
    ]
    if found.limit_mm and checked.own > checked.present:
        lines.append("the proposed limit costs more than the present one: do not take it over on this evidence")
    if found.more_best == 0:
        lines.append(f"the limit is known to ±{found.wanted_mm:g} mm")
    else:
        usual = "" if found.more_usual is None else f", or some {found.more_usual} of pockets as they come"
        lines.append(
            f"for ±{found.wanted_mm:g} mm some {found.more_best} more outcomes are needed of pockets with ridges of "
            f"{found.best_mm[0]:.2f} to {found.best_mm[1]:.2f} mm{usual}"
        )
        lines += [f"  ask for record {record}, pocket {pocket}: {ridge:.2f} mm" for record, pocket, ridge in found.ask]
    what = f"none: {found.not_detected}" if found.detected is None else str(found.detected)
    lines.append(f"probability that a pocket is not passed over its measured height: {what}")
    return "\n".join(lines)


def as_json(found: Calibrated) -> str:
    """Return the figures as JSON."""
    pod = found.detected
    tree = {
        "outcomes": len(found.outcomes),
        "creased": int(found.outcomes.creased.sum()),
        "undecided": found.undecided,
        "others": found.others,
        "limit_mm": found.posterior.limit_mm,
        "limit_sd_mm": found.posterior.limit_sd_mm,
        "limit_interval_mm": found.posterior.interval_mm(),
        "spread_mm": found.posterior.spread_mm,
        "spread_interval_mm": found.posterior.spread_interval_mm(),
        "proposed_mm": found.limit_mm,
        "proposed_excess_mm": found.excess_mm,
        "present_mm": found.present_mm,
        "cost": found.validated.own,
        "present_cost": found.validated.present,
        "log_score": found.validated.log_score,
        "more_best": found.more_best,
        "more_usual": found.more_usual,
        "best_mm": found.best_mm,
        "ask": found.ask,
        "pod": None
        if pod is None
        else {
            "b0": pod.b0,
            "b1": pod.b1,
            "a50_mm": pod.a50_mm,
            "a90_mm": pod.a90_mm,
            "a90_95_mm": pod.a90_95_mm if math.isfinite(pod.a90_95_mm) else None,
            "hits": pod.hits,
            "total": pod.total,
        },
    }
    return json.dumps(tree, indent=1)
