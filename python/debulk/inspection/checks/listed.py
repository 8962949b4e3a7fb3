"""All checks in the order in which they speak: the table of contents of what an inspection looks at.

What each of them looks at, its limit and what to do stand in `debulk.results.check_texts`.
"""

from __future__ import annotations

from collections.abc import Callable

from debulk.inspection.checks import fibre_angles, pockets, shared_runs
from debulk.inspection.checks.check import Check
from debulk.inspection.checks.seen import Seen
from debulk.inspection.clouds import unit
from debulk.inspection.evidence import two_layers
from debulk.inspection.holes import unseen
from debulk.inspection.place import level, mold_edge, plateaus, ply_edge, steep
from debulk.inspection.ply import excess, humps
from debulk.inspection.rawscan import edge_spread, lost_places, narrow, rounded, shared_noise, vouched
from debulk.inspection.reference import resolution
from debulk.results.finding import Finding


def _of_place(name: str) -> Callable[[Seen], list[Finding]]:
    """Return the look of a check of the scan's place, of which the first one that fails is known."""

    def look(seen: Seen) -> list[Finding]:
        finding = seen.placed.finding
        return [finding] if finding is not None and finding.check == name and pockets.counts(seen) else []

    return look


def _of_lost(seen: Seen, *, wrinkles: bool) -> list[Finding]:
    """Return the findings on the wrinkles, or else the bumps, that the height map has lost."""
    limit_mm = seen.ply.recipe.verdict.max_ridge_mm
    return [one.finding(limit_mm) for one in seen.lost if one.place.is_wrinkle is wrinkles]


CHECKS = (
    Check("chain", lambda seen: [] if seen.recognised is None else seen.recognised.findings),
    Check("same_scan", _of_place("same_scan")),
    Check("unit", _of_place("unit"), (unit.LIMITS,)),
    Check("two_layers", _of_place("two_layers"), (two_layers.LIMITS,)),
    Check("point_spacing", _of_place("point_spacing"), (resolution.LIMITS,)),
    Check("steep_mold", _of_place("steep_mold"), (steep.LIMITS,)),
    Check("mold_edge", _of_place("mold_edge"), (mold_edge.LIMITS,)),
    Check("level", _of_place("level"), (level.LIMITS,)),
    Check("ply_edge", _of_place("ply_edge"), (ply_edge.LIMITS,)),
    Check("reference_humps", lambda seen: humps.findings(seen.humps, seen.ply.recipe)),
    Check("coverage", pockets.coverage),
    Check("outline", pockets.outline),
    Check("fibre_angles", lambda seen: fibre_angles.findings(seen.found.runs, seen.ply)),
    Check("locked", lambda seen: fibre_angles.locked(seen.ply)),
    Check("pockets", pockets.pockets),
    Check("deadline", pockets.deadline),
    Check("holes", lambda seen: unseen.findings(seen.found, seen.judged.reports, seen.ply.recipe), (excess.LIMITS,)),
    Check("shared_fibres", lambda seen: shared_runs.findings(seen.found.runs, seen.judged.pockets, seen.ply)),
    Check("false_acceptance", pockets.false_acceptance),
    Check("plateaus", lambda seen: seen.plateaus, (plateaus.LIMITS,)),
    Check("wrinkles", lambda seen: _of_lost(seen, wrinkles=True), (narrow.LIMITS,)),
    Check("narrow_bumps", lambda seen: _of_lost(seen, wrinkles=False), (lost_places.LIMITS,)),
    Check("raw_scan", lambda seen: [] if seen.standing.unknown is None else [seen.standing.unknown]),
    Check(
        "filled",
        lambda seen: [*vouched.findings(seen.filled.made, seen.found, seen.ply.recipe), *seen.filled.late],
        (vouched.LIMITS, rounded.LIMITS),
    ),
    Check(
        "smoothed",
        lambda seen: seen.filled.smoothed.findings(),
        (shared_noise.LIMITS, edge_spread.LIMITS),
    ),
    Check("audit", pockets.audit),
    Check("approval", lambda seen: pockets.approval(seen.approved, seen.ply.recipe)),
)
"""Every check, in order."""
