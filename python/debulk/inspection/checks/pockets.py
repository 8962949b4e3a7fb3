"""What the pockets, the parts of the ply that were not seen, and the recipe say about the layup."""

from __future__ import annotations

from collections.abc import Sequence

from debulk.inspection.checks.seen import Seen
from debulk.recipe import Recipe
from debulk.results.approval import Approval, recipe_hash
from debulk.results.deciding import worst_first
from debulk.results.finding import Finding
from debulk.results.half_seen import MOLD_UNKNOWN, remedy_for
from debulk.verdict import Judgement, Verdict, criteria_of, judge_layup

_GIVE_IT = "give the ply's outline (ply_outline, --outline) if what is wrong lies beside the ply, or at the mold's edge"
_BEYOND = "check its size and place (scale, unit, pose), or give a reference that shows all of the mold below the ply"
_NO_OUTLINE = _GIVE_IT.replace("give the ply's outline", "the ply's outline is not given; give it")


def coverage(seen: Seen) -> list[Finding]:
    """Return INVALID if too little of the ply was seen; its reason says if the reference is the cause, or another."""
    found, limits = seen.found, criteria_of(seen.ply.recipe)
    share, known, least = found.unseen.coverage, found.unseen.reference_coverage, limits.min_coverage
    if share >= least:
        return []
    why = [judge_layup([], share, limits).reason]
    if beyond := seen.placed.beyond:
        why.insert(0, f"the outline reaches beyond the reference ({beyond}): {_BEYOND}")
    why += [f"the reference is known on {100 * known:.1f} % of the ply"] if known < least else []
    why += [found.doubt] if found.doubt and not beyond else []
    lacking = next((of for _, of in found.holes if of in MOLD_UNKNOWN), "reference")
    remedy = _BEYOND if beyond else remedy_for(lacking) if known < least else ""
    return [Finding("coverage", Verdict.INVALID, "; ".join(why), share, least, remedy=remedy)]


def outline(seen: Seen) -> list[Finding]:
    """Mention that the outline is not given, unless the scan is in the wrong place anyway."""
    misplaced = seen.placed.finding is not None and counts(seen)
    return [] if seen.ply.outline is not None or misplaced else [Finding("outline", None, _NO_OUTLINE, remedy=_GIVE_IT)]


def counts(seen: Seen) -> bool:
    """Return whether the finding on the scan's place counts.

    Too little coverage is a more helpful reason than a level that could not be read because of it. If no pockets were
    looked for, the level does not count either: the pockets stand in the squares that it is read from. Nor does
    anything that was read inside an outline too large for the reference.
    """
    enough = seen.found.unseen.coverage >= seen.ply.recipe.verdict.min_coverage
    return (seen.placed.level is not None or enough) and not seen.found.doubt and not seen.placed.beyond


def pockets(seen: Seen) -> list[Finding]:
    """Return the verdict of the worst pocket."""
    limits, reports = criteria_of(seen.ply.recipe), worst_first(seen.judged.reports)
    share = max(seen.found.unseen.coverage, limits.min_coverage)  # too little of it is a finding of its own
    judged = judge_layup([(p.id, Judgement(p.verdict, p.reason)) for p in reports], share, limits)
    return [Finding("pockets", judged.verdict, judged.reason, pocket=reports[0].id if reports else None)]


def deadline(seen: Seen) -> list[Finding]:
    """Name the pockets that only the deadline kept from a verdict."""
    judged = seen.judged
    late = "the deadline passed before all places were cut out where a fibre may be too long and no pocket is"
    missed = [Finding("deadline", Verdict.UNDECIDED, late)] if judged.late else []
    return missed + [
        Finding("deadline", None, f"the deadline cut off the {one.late} of pocket {p.id}", pocket=p.id)
        for p, one in zip(judged.reports, judged.evaluations, strict=True)
        if one.late and p.verdict is Verdict.UNDECIDED and not p.decided_by
    ]


def audit(seen: Seen) -> list[Finding]:
    """Name the pockets whose net contradicts the fibre lines by which they pass."""
    turned = [(one.report.id, one.turned) for one in seen.judged.evaluations if one.turned]
    return [Finding("audit", Verdict.UNDECIDED, why, pocket=number) for number, why in turned]


def false_acceptance(seen: Seen) -> list[Finding]:
    """Return UNDECIDED if all pockets are CEASE and their risk is above ``verdict.max_risk``, or not known.

    It is the probability that the layup would be accepted although a ridge exceeds the limit (docs/probability.md).
    """
    most = seen.ply.recipe.verdict.max_risk
    if most is None or any(report.verdict is not Verdict.CEASE for report in seen.judged.reports):
        return []
    found = seen.risks
    if found.layup is not None and found.layup <= most:
        return []
    if found.layup is None:
        unknown = "the probability of a ridge above the limit is not known"
        return [Finding("false_acceptance", Verdict.UNDECIDED, unknown)]
    number = max(found.pockets, key=lambda k: found.pockets[k] or 0.0)
    reason = (
        f"a ridge exceeds the limit with a probability of {100 * found.layup:.3g} %, allowed are {100 * most:.3g} %; "
        f"most likely that of pocket {number}, with {100 * (found.pockets[number] or 0.0):.3g} %"
    )
    return [Finding("false_acceptance", Verdict.UNDECIDED, reason, found.layup, most, "")]


def approval(approved: Sequence[Approval] | None, recipe: Recipe) -> list[Finding]:
    """Return UNDECIDED for a recipe that is none of the approved ones; nothing if no approval is asked for."""
    own = recipe_hash(recipe.model_dump())
    if approved is None or any(one.recipe_sha256 == own for one in approved):
        return []
    reason = f"the recipe, SHA-256 {own[:12]}, is none of the {len(approved)} approved: use one, or have it approved"
    return [Finding("approval", Verdict.UNDECIDED, reason)]
