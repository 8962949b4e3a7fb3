"""The probability that the layup would be accepted although a ridge exceeds the limit (docs/probability.md)."""

from __future__ import annotations

from debulk.inspection.checks.seen import Seen
from debulk.inspection.find.long_runs import long_runs
from debulk.results.finding import Finding
from debulk.risk import risk
from debulk.verdict import Verdict


def findings(seen: Seen) -> list[Finding]:
    """Return UNDECIDED if all pockets are CEASE and that probability is above ``verdict.max_risk``, or not known."""
    recipe = seen.ply.recipe
    most = recipe.verdict.max_risk
    if most is None or any(report.verdict is not Verdict.CEASE for report in seen.judged.reports):
        return []
    found = risk(seen.judged.reports, long_runs(seen.found.runs, seen.judged.pockets, seen.ply), recipe)
    if found.layup is not None and found.layup <= most:
        return []
    if found.layup is None:
        return [
            Finding("false_acceptance", Verdict.UNDECIDED, "the probability of a ridge above the limit is not known")
        ]
    number = max(found.pockets, key=lambda k: found.pockets[k] or 0.0)
    reason = (
        f"a ridge exceeds the limit with a probability of {100 * found.layup:.3g} %, allowed are {100 * most:.3g} %; "
        f"most likely that of pocket {number}, with {100 * (found.pockets[number] or 0.0):.3g} %"
    )
    return [Finding("false_acceptance", Verdict.UNDECIDED, reason, found.layup, most, "")]
